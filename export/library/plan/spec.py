"""The specification of a library: which sketches, sizes, gauges, seeds, formulations and formats.

Read from TOML and checked.

    format = "crossfield-library-spec"
    version = 1
    title = "..."                      one line
    formulations = ["..."]             all by default
    gauges = ["strokes"], facets = ["hull"]    may also stand in a rung, which then has its own
    ledger = "ledger.json"             what solvers found before, with its fields beside it; may be left out

    [rungs.tiny]                       tiny, small, medium or large
    sizes = [4]                        pixels on the longer side
    formats = ["nl", "mps"]            all by default
    compress = false                   .gz

    [[sketches]]
    name = "bend"                      lower case and digits, part of every name
    sample = "cylinder_bend"           or file = "drawing.svg" (with mask = "mask.png" if need be),
                                       or random = "full" | "ragged"
    seeds = [1, 2]                     of a random one
    rungs = ["tiny"]                   all by default
    sizes = { tiny = [10] }            other ones than the rung has, for a drawing that needs them

Files are found from the folder of the specification.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

from ....models.errors import InputError, shortened
from ....models.formulations.declaration import FACETS, FORMULATIONS
from ....models.input_limits import MAX_BYTES
from ....models.instance.instance import GAUGES
from ....models.sketch.samples import SAMPLES, sample_svg
from ....models.storage import read_bytes
from ...formats.registry import FORMATS

FORMAT: Final = "crossfield-library-spec"
VERSION: Final = 1
RUNGS: Final = ("tiny", "small", "medium", "large")
"""The ladder: every solver in seconds; optimum proven; gap open; reading and presolve."""
SHAPES: Final = ("full", "ragged")
"""Masks of random instances: the whole square, or a ragged part of it."""
DEFAULT: Final = Path(__file__).with_name("default.toml")

_NAME: Final = re.compile(r"[a-z][a-z0-9]{0,15}")
_MOST_SEED: Final = 999
_LARGEST: Final = 999  # three digits in names


@dataclass(frozen=True)
class Rung:
    """A step of the ladder: its sizes, and what is written of each instance there."""

    name: str
    sizes: tuple[int, ...]
    formats: tuple[str, ...]
    compress: bool
    gauges: tuple[str, ...]
    facets: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """The rung as a table of a specification."""
        return {
            "sizes": list(self.sizes),
            "formats": list(self.formats),
            "compress": self.compress,
            "gauges": list(self.gauges),
            "facets": list(self.facets),
        }


@dataclass(frozen=True)
class Sketch:
    """Where instances come from: a sample, a file (its bytes, with those of a mask),
    or random strokes of some seeds.

    name: short, part of every name. sizes: by rung, where they are not the rung's. what: the sample, the
    file's own name, or the shape of a random mask.
    """

    name: str
    kind: Literal["sample", "file", "random"]
    what: str
    title: str
    rungs: tuple[str, ...]
    sizes: tuple[tuple[str, tuple[int, ...]], ...] = ()
    seeds: tuple[int | None, ...] = (None,)
    drawing: bytes = b""
    mask: bytes = b""
    mask_name: str = ""

    def sizes_on(self, rung: Rung) -> tuple[int, ...]:
        """Its sizes on a rung."""
        return dict(self.sizes).get(rung.name, rung.sizes)

    @property
    def files(self) -> dict[str, bytes]:
        """Files of the library that hold the drawing and its mask, by name."""
        if self.kind == "sample" and SAMPLES[self.what].kind == "sketch":
            return {f"cf_{self.name}.sketch.svg": sample_svg(self.what).encode()}
        return {
            name: data for name, data in ((self._copy(), self.drawing), (self._mask(), self.mask)) if data
        }

    def _copy(self) -> str:
        return f"cf_{self.name}.sketch{Path(self.what).suffix.lower()}"

    def _mask(self) -> str:
        return f"cf_{self.name}.mask{Path(self.mask_name).suffix.lower()}"

    def document(self) -> dict[str, Any]:
        """The sketch as a table of a specification, its files as they lie in a library."""
        head: dict[str, Any] = {"name": self.name, "title": self.title, "rungs": list(self.rungs)}
        head["sizes"] = {rung: list(sizes) for rung, sizes in self.sizes}
        if self.kind == "sample":
            return head | {"sample": self.what}
        if self.kind == "random":
            return head | {"random": self.what, "seeds": list(self.seeds)}
        masked = {"mask": self._mask()} if self.mask else {}
        return head | {"file": self._copy(), "source": self.what} | masked


@dataclass(frozen=True)
class Spec:
    """A checked specification. ledger: the file of a ledger that the build takes as input, or None."""

    title: str
    formulations: tuple[str, ...]
    rungs: tuple[Rung, ...]
    sketches: tuple[Sketch, ...]
    ledger: Path | None = None

    def document(self) -> dict[str, Any]:
        """The specification with every default written out, as library.json holds it."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "title": self.title,
            "formulations": list(self.formulations),
            "rungs": {rung.name: rung.document() for rung in self.rungs},
            "sketches": [sketch.document() for sketch in self.sketches],
        }


def default_spec() -> Spec:
    """The specification that ships."""
    return read_spec(DEFAULT)


def read_spec(path: str | Path) -> Spec:
    """The specification in a TOML file. Raises InputError that names file, key and remedy."""
    path = Path(path)
    try:
        document = tomllib.loads(read_bytes(path, MAX_BYTES).decode())
    except UnicodeDecodeError as error:
        raise InputError("is not UTF-8 text; save it as TOML in UTF-8", file=path) from error
    except (ValueError, RecursionError) as error:  # ValueError: also a number of thousands of digits
        raise InputError(f"is not valid TOML: {error}", file=path) from error
    return spec_of(document, path)


def spec_of(document: dict[str, Any], path: Path) -> Spec:
    """The specification that a document describes, whose files are found beside `path`.

    Raises InputError, naming `path`.
    """
    try:
        return _spec(_Table(document, ""), path.parent)
    except InputError as error:
        raise error if error.file is not None else InputError(str(error), file=path) from error


class _Table:
    """A table of the document: every key is taken once and checked; what is left in the end is unknown."""

    def __init__(self, given: Any, place: str) -> None:
        if not isinstance(given, dict):
            raise InputError(f"{place}: is not a table; write [{place}]")
        self._given, self.place, self._known = given, place, list[str]()

    def __contains__(self, key: str) -> bool:
        return key in self._given

    def at(self, key: str) -> str:
        """The place of a key in words."""
        return f"{self.place}.{key}" if self.place else key

    def raw(self, key: str, default: Any = None) -> Any:
        """The value of a key as it stands."""
        self._known.append(key)
        return self._given.get(key, default)

    def text(self, key: str, default: str | None = None) -> str:
        """One line of text."""
        value = self.raw(key, default)
        if not isinstance(value, str) or not value.strip() or not value.isprintable() or len(value) > 300:
            raise InputError(f"{self.at(key)}: must be one line of text, in quotes")
        return value

    def chosen(self, key: str, known: Iterable[str], default: Sequence[str] | None = None) -> tuple[str, ...]:
        """A list of known words, each once."""
        known = tuple(known)
        found = self.list(key, str, "text in quotes", list(known if default is None else default))
        for word in found:
            if word not in known:
                raise InputError(
                    f"{self.at(key)}: there is no {shortened(word)!r}; choose from {', '.join(known)}"
                )
        return found

    def numbers(self, key: str, least: int, most: int) -> tuple[int, ...]:
        """A list of whole numbers in a range, each once."""
        found = self.list(key, int, "whole numbers", None)
        for value in found:
            if not least <= value <= most:
                raise InputError(
                    f"{self.at(key)}: {shortened(value)} is out of range; choose {least} to {most}"
                )
        return found

    def list(self, key: str, kind: type[Any], words: str, default: Any) -> tuple[Any, ...]:
        """A list that is not empty, of values of one type, each once."""
        found = self.raw(key, default)
        if not isinstance(found, list) or not found or not all(type(value) is kind for value in found):
            raise InputError(f"{self.at(key)}: must be a list of {words}, at least one")
        twice = [value for number, value in enumerate(found) if value in found[:number]]
        if twice:
            raise InputError(f"{self.at(key)}: {shortened(twice[0])!r} is listed twice; list it once")
        return tuple(found)

    def flag(self, key: str) -> bool:
        """True or false, false by default."""
        value = self.raw(key, default=False)
        if not isinstance(value, bool):
            raise InputError(f"{self.at(key)}: must be true or false")
        return value

    def finish(self) -> None:
        """Refuse what nobody took."""
        for key in self._given:
            if key not in self._known:
                raise InputError(f"{self.at(key)}: is unknown; the keys here are {', '.join(self._known)}")


def _spec(table: _Table, folder: Path) -> Spec:
    for key, value in (("format", FORMAT), ("version", VERSION)):
        if table.raw(key) != value:
            raise InputError(
                f"{key}: must be {value!r}; this is no specification of a library, or another version"
            )
    gauges, facets = table.chosen("gauges", GAUGES, ["strokes"]), table.chosen("facets", FACETS, ["hull"])
    title = table.text("title")
    formulations = table.chosen("formulations", FORMULATIONS)
    rungs = _rungs(table, gauges, facets)
    sketches = _sketches(table, folder, rungs)
    ledger = folder / table.text("ledger") if "ledger" in table else None
    table.raw("ledger")
    table.finish()
    if ledger is not None and not ledger.is_file():
        raise InputError(f"ledger: there is no file {ledger.name}; leave the key out, or give a ledger.json")
    return Spec(title, formulations, rungs, sketches, ledger)


def _rungs(table: _Table, gauges: tuple[str, ...], facets: tuple[str, ...]) -> tuple[Rung, ...]:
    given = table.raw("rungs", {})
    names = _Table(given, "rungs")
    found = [
        _rung(name, _Table(names.raw(name), f"rungs.{name}"), gauges, facets)
        for name in RUNGS
        if name in names
    ]
    for name in RUNGS:
        names.raw(name)
    names.finish()
    if not found:
        raise InputError("rungs: there is none; write at least one table, say [rungs.tiny] with sizes = [4]")
    return tuple(found)


def _rung(name: str, table: _Table, gauges: tuple[str, ...], facets: tuple[str, ...]) -> Rung:
    rung = Rung(
        name,
        table.numbers("sizes", 1, _LARGEST),
        table.chosen("formats", FORMATS),
        table.flag("compress"),
        table.chosen("gauges", GAUGES, gauges),
        table.chosen("facets", FACETS, facets),
    )
    table.finish()
    return rung


def _sketches(table: _Table, folder: Path, rungs: tuple[Rung, ...]) -> tuple[Sketch, ...]:
    given = table.raw("sketches")
    if not isinstance(given, list) or not given:
        raise InputError("sketches: there is none; write at least one table [[sketches]]")
    found = [_sketch(_Table(each, f"sketches[{number}]"), folder, rungs) for number, each in enumerate(given)]
    names = [sketch.name for sketch in found]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise InputError(
                f"sketches[{number}].name: {name!r} is the name of two sketches; give each its own"
            )
    return tuple(found)


def _sketch(table: _Table, folder: Path, rungs: tuple[Rung, ...]) -> Sketch:
    name = table.text("name")
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{table.at('name')}: {name[:40]!r} is not allowed; use a lower-case letter, "
            "then at most 15 lower-case letters and digits, no path"
        )
    wanted = table.chosen("rungs", [rung.name for rung in rungs])
    sizes = _sizes(table, wanted)
    kinds = [kind for kind in _KINDS if kind in table]
    if len(kinds) != 1:
        raise InputError(f"{table.place}: {name} needs exactly one of {', '.join(_KINDS)}")
    sketch = replace(_KINDS[kinds[0]](table, name, wanted, folder), sizes=sizes)
    table.finish()
    every = [size for rung in rungs if rung.name in wanted for size in sketch.sizes_on(rung)]
    for size in every:
        if every.count(size) > 1:
            raise InputError(
                f"{table.place}: {name} has size {size} on two rungs; keep it on one, "
                "because names carry the size alone"
            )
    return sketch


def _sizes(table: _Table, rungs: tuple[str, ...]) -> tuple[tuple[str, tuple[int, ...]], ...]:
    given = _Table(table.raw("sizes", {}), table.at("sizes"))
    found = tuple((rung, given.numbers(rung, 1, _LARGEST)) for rung in rungs if rung in given)
    for rung in rungs:
        given.raw(rung)
    given.finish()
    return found


def _sample(table: _Table, name: str, rungs: tuple[str, ...], _folder: Path) -> Sketch:
    what = table.text("sample")
    if what not in SAMPLES:
        raise InputError(
            f"{table.at('sample')}: there is no sample {shortened(what)!r}; choose from {', '.join(SAMPLES)}"
        )
    return Sketch(name, "sample", what, table.text("title", SAMPLES[what].description), rungs)


def _random(table: _Table, name: str, rungs: tuple[str, ...], _folder: Path) -> Sketch:
    what = table.text("random")
    if what not in SHAPES:
        raise InputError(
            f"{table.at('random')}: there is no shape {shortened(what)!r}; choose from {', '.join(SHAPES)}"
        )
    seeds = table.numbers("seeds", 0, _MOST_SEED)
    title = f"random strokes on a {'full square' if what == 'full' else 'ragged part of a square'}"
    return Sketch(name, "random", what, table.text("title", title), rungs, seeds=seeds)


def _file(table: _Table, name: str, rungs: tuple[str, ...], folder: Path) -> Sketch:
    what, mask = table.text("file"), table.text("mask") if "mask" in table else ""
    source = table.text("source", Path(what).name)
    table.raw("mask")
    drawing = _content(folder / what, table.at("file"))
    masked = _content(folder / mask, table.at("mask")) if mask else b""
    return Sketch(
        name, "file", source, table.text("title", source), rungs, drawing=drawing, mask=masked, mask_name=mask
    )


_KINDS: Final[dict[str, Callable[[_Table, str, tuple[str, ...], Path], Sketch]]] = {
    "sample": _sample,
    "file": _file,
    "random": _random,
}


def _content(path: Path, place: str) -> bytes:
    if not path.is_file():
        raise InputError(
            f"{place}: there is no file {path}; check the path, which starts at the specification's folder"
        )
    return read_bytes(path, MAX_BYTES)
