"""The specification of a library, read from TOML: sketches, sizes, gauges, seeds, formulations and formats.

docs/library.md describes its keys, and library-spec.schema.json in this folder its form. This module checks
names in tables, and combinations of keys. Files are relative to the folder of the specification.
"""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, cast, get_args

from ....models.arguments import check_choice
from ....models.documents import schema_error
from ....models.errors import InputError, UnsupportedByFormatError, naming, shortened
from ....models.formulations.catalogue import (
    AT_JUMPS,
    FORMULATIONS,
    declaration_of,
    declare,
    norm_of,
    reason_against,
    short_names,
)
from ....models.formulations.declaration import FACETS
from ....models.input_limits import MAX_BYTES
from ....models.instance.instance import GAUGES, Gauge
from ....models.mesh.shapes import MESHES
from ....models.sketch.drawing_file import suffix_of_picture
from ....models.sketch.publication import publishable_sketch
from ....models.sketch.random_strokes import RAGGED_SHARE
from ....models.sketch.samples import SAMPLES, sample_svg
from ....models.storage import read_bytes
from ...formats.registry import FORMATS, problem_in_format
from ...solvers_table import smallest_problem
from .seeds import seeds_document, seeds_of

FORMAT: Final = "crossfield-library-spec"
VERSION: Final = 1
RUNGS: Final = ("tiny", "small", "medium", "large", "mesh")
OF_MESHES: Final = ("large", "mesh")  # rungs that take meshes, which are on the last one by default
PROVEN: Final = ("tiny", "small")  # rungs with proofs of 2-norm optima by default: most take a second
SketchKind = Literal["sample", "file", "random", "mesh"]
Effort = Literal["search", "none", "greedy", "proven"]
"""Work for the points of a sketch."""
RANDOM: Final = ("share", "mask_share")
"""Keys of random sketches that are options of `random_instance`."""
DEFAULT: Final = Path(__file__).with_name("default.toml")


@dataclass(frozen=True)
class Origin:
    """Author, licence (preferably an SPDX identifier) and source of a sketch; empty if not stated."""

    author: str = ""
    license: str = ""
    source: str = ""

    @classmethod
    def of(cls, table: dict[str, Any]) -> Origin:
        """Return the origin that the table of a sketch states."""
        return cls(*(table.get(key, "") for key in cls.__dataclass_fields__))

    def document(self) -> dict[str, str]:
        """Return the stated values by key."""
        return {key: value for key, value in asdict(self).items() if value}


@dataclass(frozen=True)
class Release:
    """A citable release of a library. date: as 2026-11-22; authors: names as they are cited."""

    version: str
    date: str
    authors: tuple[str, ...]

    @classmethod
    def of(cls, table: dict[str, Any]) -> Release:
        """Return the release that a table states."""
        return cls(table["version"], table["date"], tuple(table["authors"]))

    def document(self) -> dict[str, Any]:
        """Return the release as a table of a specification."""
        return asdict(self) | {"authors": list(self.authors)}


@dataclass(frozen=True)
class Rung:
    """A step of the ladder: its sizes, and the formats, gauges and facets of its entries.

    sizes: none on the rung of meshes. tightened: formulations with a second entry in the windows that a
    certificate leaves.
    """

    name: str
    sizes: tuple[int, ...]
    formats: tuple[str, ...]
    compress: bool
    gauges: tuple[str, ...]
    facets: tuple[str, ...]
    prove: bool
    added: str = ""
    tightened: tuple[str, ...] = ()

    def entries(
        self, formulations: tuple[str, ...], gauge: str, *, orthogonal: bool
    ) -> list[tuple[str, str]]:
        """Return formulation and facet of the entries of an instance. formulations: those of the library."""
        return [
            (name, facet)
            for facet in self.facets
            for name in formulations
            if facet in facets_of(name, gauge, orthogonal=orthogonal)
        ]

    def document(self) -> dict[str, Any]:
        """Return the rung as a table of a specification."""
        named = asdict(self).items()
        stated = {key: list(value) if isinstance(value, tuple) else value for key, value in named}
        return {key: value for key, value in stated.items() if key != "name" and value not in ("", [])}


@dataclass(frozen=True)
class Sketch:
    """Source of instances: a sample, a file with its mask, random strokes of some seeds, or a built-in mesh.

    what: the sample, the file's own name, the shape of a random mask, or the mesh. sizes: by rung, if they
    differ from the rung's. points: a word of Effort. random: options of `random_instance`. drawing, mask:
    published bytes.
    """

    name: str
    kind: SketchKind
    what: str
    title: str
    rungs: tuple[str, ...]
    origin: Origin
    sizes: tuple[tuple[str, tuple[int, ...]], ...] = ()
    seeds: tuple[int | None, ...] = (None,)
    points: Effort = "search"
    random: tuple[tuple[str, Any], ...] = ()
    drawing: bytes = b""
    suffix: str = ""
    mask: bytes = b""
    mask_suffix: str = ""
    added: str = ""

    @property
    def orthogonal(self) -> bool:
        """Whether the crosses of its instances are orthogonal."""
        return self.kind == "mesh"

    def sizes_on(self, rung: Rung) -> tuple[int, ...]:
        """Return its sizes on a rung: pixels, or the faces of a mesh."""
        if self.orthogonal:
            return (MESHES[self.what][1]().size,)
        return dict(self.sizes).get(rung.name, rung.sizes)

    def proves(self, rung: Rung) -> bool:
        """Return whether the optima of its instances on a rung are proven."""
        return rung.prove if self.points == "search" else self.points == "proven"

    @property
    def drawn(self) -> dict[str, Any]:
        """The options of random strokes by name."""
        return {"mask_share": RAGGED_SHARE if self.what == "ragged" else 1.0} | dict(self.random)

    def settings(self) -> dict[str, Any]:
        """Return the stated options of its instances that have a default, other than sizes."""
        points = {} if self.points == "search" else {"points": self.points}
        return dict(self.random) | points

    @property
    def files(self) -> dict[str, bytes]:
        """Files of the library that hold the drawing and its mask, by name."""
        if self.kind == "sample" and SAMPLES[self.what].kind == "sketch":
            return {f"cf_{self.name}.sketch.svg": sample_svg(self.what).encode()}
        drawing, mask = f"cf_{self.name}.sketch{self.suffix}", f"cf_{self.name}.mask{self.mask_suffix}"
        return {name: data for name, data in ((drawing, self.drawing), (mask, self.mask)) if data}

    def document(self) -> dict[str, Any]:
        """Return the sketch as a table of a specification, with its file names in a library."""
        head: dict[str, Any] = {"name": self.name, "title": self.title, "rungs": list(self.rungs)}
        head |= {} if self.orthogonal else {"sizes": {rung: list(sizes) for rung, sizes in self.sizes}}
        head |= self.origin.document() | ({"added": self.added} if self.added else {})
        head |= self.settings()
        if self.kind in ("sample", "mesh"):
            return head | {self.kind: self.what}
        if self.kind == "random":
            return head | {"random": self.what, "seeds": seeds_document(self.seeds)}
        drawing, *mask = self.files
        return head | {"file": drawing, "file_name": self.what} | ({"mask": mask[0]} if mask else {})


@dataclass(frozen=True)
class Spec:
    """A checked specification. ledger: its file; points: a folder of results that replace searches."""

    title: str
    formulations: tuple[str, ...]
    rungs: tuple[Rung, ...]
    sketches: tuple[Sketch, ...]
    ledger: Path | None = None
    points: Path | None = None
    release: Release | None = None

    def document(self) -> dict[str, Any]:
        """Return the specification with every default written out, as library.json holds it."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "title": self.title,
            **({"release": self.release.document()} if self.release else {}),
            "formulations": list(self.formulations),
            "rungs": {rung.name: rung.document() for rung in self.rungs},
            "sketches": [sketch.document() for sketch in self.sketches],
        }


def default_spec() -> Spec:
    """Read the specification that ships with crossfield; a test checks its form and its entries."""
    return _read_document(tomllib.loads(DEFAULT.read_text("utf-8")), DEFAULT.parent)


def read_spec(path: str | Path) -> Spec:
    """Read the specification in a TOML file. Raises InputError that names file, key and remedy."""
    path = Path(path)
    try:
        document = tomllib.loads(read_bytes(path, MAX_BYTES).decode())
    except UnicodeDecodeError as error:
        raise InputError("is not UTF-8 text; save it as TOML in UTF-8", file=path) from error
    except (ValueError, RecursionError) as error:  # ValueError: also a number of thousands of digits
        raise InputError(f"is not valid TOML: {error}", file=path) from error
    return spec_of(document, path)


def spec_of(document: dict[str, Any], path: Path) -> Spec:
    """Return the specification of a document with files next to `path`. Raises InputError."""
    with naming(path):
        _check_form(document)
        spec = _read_document(document, path.parent)
        _check_entries(spec)
    return spec


def _check_form(document: dict[str, Any]) -> None:
    try:
        error = schema_error(document, "library-spec", __package__)
    except ValueError as large:  # of a whole number of more digits than Python writes
        raise InputError("holds a number of thousands of digits; write a smaller one") from large
    if error is not None:
        raise InputError(describe_schema_error(error))


def describe_schema_error(error: Any) -> str:
    """Return place and fault of a schema error, and as the remedy the description in the schema."""
    place = error.json_path[2:]
    message = f"{error.instance} has no place there" if error.validator == "not" else error.message
    fault = f"{shortened(message, 200)}; write {error.schema['description']}"
    return f"{place}: {fault}" if place else fault


def _read_document(document: dict[str, Any], folder: Path) -> Spec:
    defaults = {
        "formats": tuple(FORMATS),
        "gauges": _read_words(document, "gauges", GAUGES, ("strokes",)),
        "facets": _read_words(document, "facets", FACETS, ("hull",)),
    }
    kinds = {"mesh" in sketch for sketch in document["sketches"]}
    taken = [name for name in FORMULATIONS if any(facets_of(name, orthogonal=right) for right in kinds)]
    formulations = _read_formulations(document, "formulations", tuple(taken))
    rungs = tuple(
        _read_rung(name, document["rungs"][name], defaults, formulations)
        for name in RUNGS
        if name in document["rungs"]
    )
    sketches = tuple(
        _read_sketch(table, f"sketches[{number}].", folder, rungs)
        for number, table in enumerate(document["sketches"])
    )
    if (name := _first_repetition([sketch.name for sketch in sketches])) is not None:
        raise InputError(
            f"sketches[{name[0]}].name: {name[1]!r} is the name of two sketches; give each its own"
        )
    ledger = folder / document["ledger"] if "ledger" in document else None
    if ledger is not None and not ledger.is_file():
        raise InputError(f"ledger: there is no file {ledger.name}; omit the key, or give a ledger.json")
    points = folder / document["points"] if "points" in document else None
    if points is not None and not points.exists():
        raise InputError(f"points: there is no {points.name}; omit the key, or give the points of a library")
    release = Release.of(document["release"]) if "release" in document else None
    return Spec(document["title"], formulations, rungs, sketches, ledger, points, release)


@cache
def facets_of(formulation: str, gauge: str = "strokes", *, orthogonal: bool = False) -> tuple[str, ...]:
    """Return the facets of which a formulation has entries: none on instances that it refuses.

    Only hull, unless it has the option and crosses may have any angle. Formulations of orthogonal crosses in
    other norms than the 2-norm, which certificates are in, have none.
    """
    declaration = FORMULATIONS[formulation]
    if not orthogonal:
        any_facets = FACETS if "facet" in declaration.option_names else ("hull",)
        return () if declaration.orthogonal else any_facets
    if norm_of(declaration, declaration.options({})) != 2:
        return ()
    smallest = smallest_problem(declare(formulation)).instance
    instance = replace(smallest, gauge=cast("Gauge", gauge), orthogonal=True)
    return () if reason_against(declare(formulation, instance), instance) else ("hull",)


def _check_entries(spec: Spec) -> None:
    """Check that every formulation and rung has entries, every entry a model file, and a proof jumps."""
    formulations = spec.formulations
    rungs = [rung for rung in spec.rungs if any(rung.name in sketch.rungs for sketch in spec.sketches)]
    present = {
        rung.name: list(
            dict.fromkeys(
                name
                for sketch in spec.sketches
                if rung.name in sketch.rungs
                for gauge in rung.gauges
                for name, _ in rung.entries(formulations, gauge, orthogonal=sketch.orthogonal)
            )
        )
        for rung in rungs
    }
    for name in formulations:
        if not any(name in names for names in present.values()):
            hull = any("hull" in rung.facets for rung in rungs)
            why = f"no rung has {name}" if hull else f"{name} has no facet 'printed'; add hull to facets"
            raise InputError(f"formulations: {why}{';' if hull else ', or'} omit {name}")
    for rung in rungs:
        if not present[rung.name]:
            raise InputError(
                f"rungs.{rung.name}.facets: none of the formulations has the facet 'printed'; add hull"
            )
        for name in present[rung.name]:
            if not any(_can_hold(file_format, name) for file_format in rung.formats):
                raise InputError(
                    f"rungs.{rung.name}.formats: none of {', '.join(rung.formats)} holds {name}; "
                    "add nl or gms, or omit the formulation"
                )
    proven = [sketch.name for sketch in spec.sketches if sketch.points == "proven"]
    if proven and all(FORMULATIONS[formulation].minimises == AT_JUMPS for formulation in formulations):
        raise InputError(
            f"formulations: {proven[0]} has proven points, and no formulation has jumps to prove; "
            "add miqp-exact, or choose other points"
        )


def _can_hold(file_format: str, formulation: str) -> bool:
    try:
        problem_in_format(smallest_problem(declare(formulation)), FORMATS[file_format])
    except UnsupportedByFormatError:
        return False
    return True


def _first_repetition(names: Sequence[str]) -> tuple[int, str] | None:
    """Place and name of the first repetition."""
    return next(((at, name) for at, name in enumerate(names) if name in names[:at]), None)


def _read_words(
    table: dict[str, Any],
    key: str,
    known: Collection[str],
    default: tuple[str, ...],
    place: str = "",
    *,
    kind: str = "",
) -> tuple[str, ...]:
    """The words of a list, all of them known, or the default. kind: of word; by default the key's."""
    words = tuple(table.get(key, default))
    for word in words:
        check_choice(kind or key.removesuffix("s"), word, known, place=f"{place}{key}")
    return words


def _read_formulations(
    table: dict[str, Any], key: str, default: tuple[str, ...], place: str = ""
) -> tuple[str, ...]:
    """The full names of formulations in a list, or the default."""
    named = _read_words(table, key, (*FORMULATIONS, *short_names()), default, place, kind="formulation")
    formulations = tuple(declaration_of(name).name for name in named)
    if (name := _first_repetition(formulations)) is not None:
        raise InputError(f"{place}{key}: {name[1]!r} is listed twice; list it once")
    return formulations


def _read_rung(
    name: str, table: dict[str, Any], defaults: dict[str, tuple[str, ...]], formulations: tuple[str, ...]
) -> Rung:
    known = {"formats": FORMATS, "gauges": GAUGES, "facets": FACETS}
    words = {key: _read_words(table, key, known[key], defaults[key], f"rungs.{name}.") for key in known}
    compress, prove = table.get("compress", False), table.get("prove", name in PROVEN)
    tightened = _read_formulations(table, "tightened", (), f"rungs.{name}.")
    for formulation in tightened:
        if formulation not in formulations:
            raise InputError(f"rungs.{name}.tightened: {formulation!r} is not in formulations; add it there")
        if FORMULATIONS[formulation].minimises == AT_JUMPS:
            raise InputError(
                f"rungs.{name}.tightened: {formulation} has fixed jumps, and no certificate is about it; "
                "omit it"
            )
    return Rung(
        name,
        _whole_numbers(table.get("sizes", [])),
        compress=compress,
        prove=prove,
        added=table.get("added", ""),
        tightened=tightened,
        **words,
    )


def _whole_numbers(numbers: list[float]) -> tuple[int, ...]:
    """The numbers of a list that is checked: 4.0 is whole too."""
    return tuple(map(int, numbers))


def _read_sketch(table: dict[str, Any], place: str, folder: Path, rungs: tuple[Rung, ...]) -> Sketch:
    name, kind = table["name"], next(kind for kind in get_args(SketchKind) if kind in table)
    suited = OF_MESHES if kind == "mesh" else RUNGS[:-1]
    names = tuple(rung.name for rung in rungs if rung.name in suited)
    if not names:
        raise InputError(
            f"{place}{kind}: no rung takes it; add {'mesh' if kind == 'mesh' else 'tiny'} to rungs"
        )
    wanted = _read_words(table, "rungs", names, names[-1:] if kind == "mesh" else names, place)
    sizes = table.get("sizes", {})
    if unknown := [rung for rung in sizes if rung not in wanted]:
        raise InputError(f"{place}sizes.{unknown[0]}: is unknown; the keys here are {', '.join(wanted)}")
    word = table[kind]
    if kind == "file":
        drawn = _read_drawing(table, place, folder)
    elif kind == "random":
        shape = "full square" if word == "full" else "ragged part of a square"
        title = f"random strokes on a {shape}"
        drawn = {"what": word, "title": title, "seeds": seeds_of(table["seeds"], f"{place}seeds")}
        drawn["random"] = _read_random(table, word, place)
    elif kind == "mesh":
        check_choice("mesh", word, MESHES, place=f"{place}mesh")
        drawn = {"what": word, "title": MESHES[word][0]}
    else:
        check_choice("sample", word, SAMPLES, place=f"{place}sample")
        drawn = {"what": word, "title": SAMPLES[word].description}
    sketch = Sketch(
        name,
        kind,
        title=table.get("title", drawn.pop("title")),
        rungs=wanted,
        sizes=tuple((rung, _whole_numbers(sizes[rung])) for rung in wanted if rung in sizes),
        origin=Origin.of(table),
        added=table.get("added", ""),
        points=table.get("points", "search"),
        **drawn,
    )
    every = [size for rung in rungs if rung.name in wanted for size in sketch.sizes_on(rung)]
    for size in every:
        if every.count(size) > 1:
            raise InputError(
                f"{place[:-1]}: {name} has size {size} on two rungs; keep it on one, "
                "because names carry the size alone"
            )
    return sketch


def _read_random(table: dict[str, Any], shape: str, place: str) -> tuple[tuple[str, Any], ...]:
    """The stated options of random strokes, in order."""
    if shape == "full" and "mask_share" in table:
        raise InputError(f'{place}mask_share: goes with random = "ragged"; omit it, or change the shape')
    return tuple((key, table[key]) for key in RANDOM if key in table)


def _read_drawing(table: dict[str, Any], place: str, folder: Path) -> dict[str, Any]:
    file, mask = table["file"], table.get("mask", "")
    source = table.get("file_name", Path(file).name)
    drawn = _read_file(folder / file, f"{place}file")
    try:
        drawing, suffix = publishable_sketch(drawn, Path(source).suffix.lower())
    except InputError as error:
        raise InputError(f"{place}file: {file}: {error}") from error
    masked = _read_file(folder / mask, f"{place}mask") if mask else b""
    return {
        "what": source,
        "title": source,
        "drawing": drawing,
        "suffix": suffix,
        "mask": masked,
        "mask_suffix": suffix_of_picture(masked) if masked else "",
    }


def _read_file(path: Path, place: str) -> bytes:
    if not path.is_file():
        raise InputError(
            f"{place}: there is no file {path}; check the path, which starts at the specification's folder"
        )
    return read_bytes(path, MAX_BYTES)
