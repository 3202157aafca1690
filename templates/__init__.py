"""Layouts of texts, in Jinja2.

models: model files; library: texts of a library and its page; run: the page of a run; page: the style of
pages. Layout only: every line of bulk is streamed in.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined, select_autoescape

ENVIRONMENT: Final = Environment(
    loader=FileSystemLoader(Path(__file__).parent),
    undefined=StrictUndefined,
    autoescape=select_autoescape(enabled_extensions=("html.j2",)),
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
    newline_sequence="\n",
)
"""The one environment of all templates: a name that is not given is an error, only HTML is escaped."""

_MARK: Final = "\0"  # in no template and in no text that an instance may hold


def stream(name: str, blocks: Mapping[str, Iterable[bytes]], **context: object) -> Iterator[bytes]:
    """The bytes of a template with each block in place of its `{{ block.key }}`, read when needed.

    Raises jinja2.UndefinedError for a name that the template uses and nobody gave.
    """
    marks = {key: f"{_MARK}{key}{_MARK}" for key in blocks}
    text = ENVIRONMENT.get_template(name).render(context, block=marks)
    for number, part in enumerate(text.split(_MARK)):
        if number % 2:
            yield from blocks[part]
        elif part:
            yield part.encode()
