"""The command `studio`: a page in the browser where strokes are drawn and field and surface follow."""

from __future__ import annotations

import secrets
import webbrowser
from pathlib import Path
from threading import Thread
from typing import Annotated, Any

import typer

from ...models.errors import InputError
from .output import print_line, show_progress


def studio_command(
    drawing: Annotated[
        str | None,
        typer.Argument(
            metavar="[SKETCH|SAMPLE]",
            help="A drawing (SVG, picture, .scap, .curves), a saved session, or a drawn sample.",
        ),
    ] = None,
    *,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Port of the page; 0 chooses a free one.")
    ] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Only print the address, and open no browser.")
    ] = False,
) -> None:
    """Draw strokes on a page in the browser, and see field and surface follow.

    The page is served on this machine only, until Ctrl-C. Its address contains a secret token. Drawings stay
    in the page; save them as session files. Needs the extra `studio`.
    """
    try:
        from ..studio.server import LOOPBACK, listen, serve
    except ModuleNotFoundError as error:
        raise InputError(
            f"studio needs the package {error.name}; pip install '.[studio]' in a clone"
        ) from error
    with show_progress() as show:
        show("reading the drawing")
        first = None if drawing is None else _read_strokes(drawing)
    token = secrets.token_urlsafe(24)
    with listen(port) as place:
        address = f"http://{LOOPBACK}:{place.getsockname()[1]}/{token}/"
        print_line(address)
        if not no_browser:
            # A browser in the terminal returns only when it is closed.
            Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        serve(place, token, first)


def _read_strokes(drawing: str) -> dict[str, Any]:
    """Strokes of a file or a sample. Raises InputError."""
    from ...models.errors import naming
    from ...models.sketch.drawing_file import read_file
    from ...models.sketch.samples import SAMPLES, sample_svg
    from ..studio.opening import open_drawing

    path = Path(drawing)
    if not path.is_file() and drawing in SAMPLES:
        return open_drawing(sample_svg(drawing).encode(), f"{drawing}.svg")
    data = read_file(path)
    with naming(path):
        return open_drawing(data, path.name)
