"""The specification of a library, read from TOML: sketches, sizes, gauges, seeds, formulations and formats.

docs/library/specification.csv describes its keys, and library-spec.schema.json in this folder its form.
This module checks names in tables, and combinations of keys. Files are relative to the folder of the
specification.
"""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, cast, get_args

from ....models.arguments import check_choice
from ....models.documents import schema_error
from ....models.errors import InputError, naming, shortened
from ....models.formulations.catalogue import AT_JUMPS, FORMULATIONS, declaration_of
from ....models.formulations.choice import declare, norm_of, reason_against
from ....models.formulations.declaration import FACETS
from ....models.input_limits import MAX_BYTES
from ....models.instance.instance import GAUGES, Gauge
from ....models.mesh.shapes import MESHES
from ....models.sketch.drawing_file import suffix_of_picture
from ....models.sketch.publication import publishable_sketch
from ....models.sketch.random_strokes import STROKE_SHARE
from ....models.sketch.samples import SAMPLES, sample_svg
from ....models.storage import read_bytes
from ...formats.registry import FORMATS
from ...solvers_table import smallest_problem

FORMAT: Final = "crossfield-library-spec"
VERSION: Final = 1
RUNGS: Final = ("tiny", "small", "medium", "large", "mesh")
OF_MESHES: Final = ("large", "mesh")  # rungs that take meshes, which are on the last one by default
_PROVEN: Final = ("tiny", "small")  # rungs with proofs of 2-norm optima by default: most take a second
ORIGIN: Final = ("author", "license", "source")
MOST_SEEDS: Final = 100_000  # of a sketch: each one becomes many files
SketchKind = Literal["sample", "file", "random", "mesh"]
DEFAULT: Final = Path(__file__).with_name("default.toml")


@dataclass(frozen=True)
class Rung:
    """A step of the ladder: its sizes, and the formats, gauges and facets of its entries.

    sizes: none on the rung of meshes. tightened: formulations with a second entry in the windows that a
    certificate leaves.
    """

    name: str
    sizes: tuple[int, ...] = ()
    formats: tuple[str, ...] = tuple(FORMATS)
    compress: bool = False
    gauges: tuple[str, ...] = ("strokes",)
    facets: tuple[str, ...] = ("hull",)
    prove: bool = False
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
        return {key: value for key, value in vars(self).items() if key != "name" and value != ()}


@dataclass(frozen=True)
class Sketch:
    """Source of instances: a sample, a file with its mask, random strokes of some seeds, or a built-in mesh.

    what: the sample, the file's own name, the shape of a random mask, or the mesh. origin: author, licence
    and source, as far as stated. sizes: by rung, if they differ from the rung's. seeds: as stated. share: of
    random strokes. points: the work for them. stroke_weight, skew_weight: as of `Instance.with_weights`; None
    for the coefficients of the paper. drawing, mask: published bytes.
    """

    name: str
    kind: SketchKind
    what: str
    title: str
    rungs: tuple[str, ...]
    origin: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, tuple[int, ...]] = field(default_factory=dict)
    seeds: str | list[int] | None = None
    points: Literal["search", "greedy", "proven"] = "search"
    share: float = STROKE_SHARE
    stroke_weight: float | None = None
    skew_weight: float | None = None
    drawing: bytes = b""
    suffix: str = ""
    mask: bytes = b""
    added: str = ""

    @property
    def orthogonal(self) -> bool:
        """Whether the crosses of its instances are orthogonal."""
        return self.kind == "mesh"

    @property
    def all_seeds(self) -> tuple[int | None, ...]:
        """Every seed of random strokes; None for other sketches."""
        if isinstance(self.seeds, str):
            first, last = map(int, self.seeds.split("-"))
            return tuple(range(first, last + 1))
        return (None,) if self.seeds is None else tuple(self.seeds)

    def sizes_on(self, rung: Rung) -> tuple[int, ...]:
        """Return its sizes on a rung: pixels, or the faces of a mesh."""
        if self.orthogonal:
            return (MESHES[self.what][1]().size,)
        return self.sizes.get(rung.name, rung.sizes)

    def proves(self, rung: Rung) -> bool:
        """Return whether the optima of its instances on a rung are proven."""
        return rung.prove if self.points == "search" else self.points == "proven"

    def settings(self) -> dict[str, Any]:
        """Return the options of its instances that differ from their defaults, other than sizes."""
        defaults = {"share": STROKE_SHARE, "points": "search", "stroke_weight": None, "skew_weight": None}
        return {key: getattr(self, key) for key, value in defaults.items() if getattr(self, key) != value}

    @property
    def files(self) -> dict[str, bytes]:
        """Files of the library that hold the drawing and its mask, by name."""
        if self.kind == "sample" and SAMPLES[self.what].kind == "sketch":
            return {f"cf_{self.name}.sketch.svg": sample_svg(self.what).encode()}
        drawing, mask = f"cf_{self.name}.sketch{self.suffix}", f"cf_{self.name}.mask"
        named = {drawing: self.drawing, f"{mask}{suffix_of_picture(self.mask)}": self.mask}
        return {name: data for name, data in named.items() if data}

    def document(self) -> dict[str, Any]:
        """Return the sketch as a table of a specification, with its file names in a library."""
        head: dict[str, Any] = {"name": self.name, "title": self.title, "rungs": self.rungs}
        head |= {} if self.orthogonal else {"sizes": self.sizes}
        head |= self.origin | ({"added": self.added} if self.added else {}) | self.settings()
        if self.kind == "file":
            drawing, *mask = self.files
            return head | {"file": drawing, "file_name": self.what} | ({"mask": mask[0]} if mask else {})
        return head | {self.kind: self.what} | ({"seeds": self.seeds} if self.seeds else {})


@dataclass(frozen=True)
class Spec:
    """A checked specification. ledger: its file; points: a folder of results that replace searches.

    release: version, date and authors of a citable release.
    """

    title: str
    formulations: tuple[str, ...]
    rungs: tuple[Rung, ...]
    sketches: tuple[Sketch, ...]
    ledger: Path | None = None
    points: Path | None = None
    release: dict[str, Any] | None = None

    def document(self) -> dict[str, Any]:
        """Return the specification with every default written out, as library.json holds it."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "title": self.title,
            **({"release": self.release} if self.release else {}),
            "formulations": self.formulations,
            "rungs": {rung.name: rung.document() for rung in self.rungs},
            "sketches": [sketch.document() for sketch in self.sketches],
        }


@cache
def default_spec() -> Spec:
    """Read the specification that ships with crossfield; a test checks its form."""
    return _read_document(tomllib.loads(DEFAULT.read_text("utf-8")), DEFAULT.parent)


def read_spec(path: str | Path) -> Spec:
    """Read the specification in a TOML file. Raises InputError that names file, key and remedy."""
    path = Path(path)
    try:
        document = tomllib.loads(read_bytes(path, MAX_BYTES).decode())
    except (ValueError, RecursionError) as error:  # ValueError: also a number of thousands of digits
        raise InputError(f"is not valid TOML: {error}", file=path) from error
    return spec_of(document, path)


def spec_of(document: dict[str, Any], path: Path) -> Spec:
    """Return the specification of a document with files next to `path`. Raises InputError."""
    with naming(path):
        try:
            error = schema_error(document, "library-spec", __package__)
        except ValueError as large:  # of a whole number of more digits than Python writes
            raise InputError("holds a number of thousands of digits; write a smaller one") from large
        if error is not None:
            raise InputError(describe_schema_error(error))
        return _read_document(document, path.parent)


def describe_schema_error(error: Any) -> str:
    """Return place and fault of a schema error, and as the remedy the description in the schema."""
    place = error.json_path[2:]
    message = f"{error.instance} has no place there" if error.validator == "not" else error.message
    fault = f"{shortened(message, 200)}; write {error.schema['description']}"
    return f"{place}: {fault}" if place else fault


def _read_document(document: dict[str, Any], folder: Path) -> Spec:
    formulations = _full_names(document.get("formulations", FORMULATIONS), FORMULATIONS, "formulations")
    tables = document["rungs"]
    rungs = tuple(_read_rung(name, tables[name], formulations) for name in RUNGS if name in tables)
    sketches = tuple(
        _read_sketch(table, f"sketches[{number}].", folder, rungs)
        for number, table in enumerate(document["sketches"])
    )
    if len({sketch.name for sketch in sketches}) < len(sketches):
        raise InputError("sketches: two have the same name; give each its own")
    present = {
        name
        for sketch in sketches
        for rung in rungs
        if rung.name in sketch.rungs
        for gauge in rung.gauges
        for name, _ in rung.entries(formulations, gauge, orthogonal=sketch.orthogonal)
    }
    absent = [name for name in formulations if name not in present]
    if absent and ("formulations" in document or not present):
        raise InputError(f"formulations: no rung has {absent[0]}; omit it, or add the facet hull to a rung")
    formulations = tuple(name for name in formulations if name in present)
    ledger, points = (
        _existing_path(folder, document[key], key) if key in document else None
        for key in ("ledger", "points")
    )
    return Spec(document["title"], formulations, rungs, sketches, ledger, points, document.get("release"))


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


def _check_words(words: Iterable[str], kind: str, known: Collection[str], place: str) -> None:
    for word in words:
        check_choice(kind, word, known, place=place)


def _full_names(words: Iterable[str], formulations: Collection[str], place: str) -> tuple[str, ...]:
    """The full names of some of these formulations, each once."""
    short = [FORMULATIONS[name].short for name in formulations]
    _check_words(words, "formulation", (*formulations, *short), place)
    return tuple(dict.fromkeys(declaration_of(word).name for word in words))


def _read_rung(name: str, table: dict[str, Any], formulations: tuple[str, ...]) -> Rung:
    for key, known in (("formats", FORMATS), ("gauges", GAUGES), ("facets", FACETS)):
        _check_words(table.get(key, ()), key.removesuffix("s"), known, f"rungs.{name}.{key}")
    # No certificate is about fixed jumps.
    proven = [formulation for formulation in formulations if FORMULATIONS[formulation].minimises != AT_JUMPS]
    stated: dict[str, Any] = {"prove": name in _PROVEN}
    stated |= {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}
    stated["sizes"] = _whole_numbers(table.get("sizes", ()))
    stated["tightened"] = _full_names(table.get("tightened", ()), proven, f"rungs.{name}.tightened")
    return Rung(name, **stated)


def _whole_numbers(numbers: Iterable[float]) -> tuple[int, ...]:
    """The numbers of a list that is checked: 4.0 is whole too."""
    return tuple(map(int, numbers))


def _read_sketch(table: dict[str, Any], place: str, folder: Path, rungs: tuple[Rung, ...]) -> Sketch:
    kind = next(kind for kind in get_args(SketchKind) if kind in table)
    suited = OF_MESHES if kind == "mesh" else RUNGS[:-1]
    names = [rung.name for rung in rungs if rung.name in suited]
    if not names:
        raise InputError(
            f"{place}{kind}: no rung takes it; add {suited[-1 if kind == 'mesh' else 0]} to rungs"
        )
    wanted = tuple(table.get("rungs", names[-1:] if kind == "mesh" else names))
    _check_words(wanted, "rung", names, f"{place}rungs")
    sizes = table.get("sizes", {})
    _check_words(sizes, "rung", wanted, f"{place}sizes")
    what, drawn = table[kind], {}
    if kind == "file":
        what = title = table.get("file_name", Path(what).name)
        drawn = _read_drawing(table, place, folder)
    elif kind == "random":
        title = f"random strokes on a {'full square' if what == 'full' else 'ragged part of a square'}"
    else:
        check_choice(kind, what, MESHES if kind == "mesh" else SAMPLES, place=f"{place}{kind}")
        title = MESHES[what][0] if kind == "mesh" else SAMPLES[what].description
    seeds = table.get("seeds")
    sketch = Sketch(
        table["name"],
        kind,
        what,
        title=table.get("title", title),
        rungs=wanted,
        origin={key: table[key] for key in ORIGIN if key in table},
        sizes={rung: _whole_numbers(sizes[rung]) for rung in wanted if rung in sizes},
        seeds=list(map(int, seeds)) if isinstance(seeds, list) else seeds,
        **{
            key: table[key]
            for key in ("points", "share", "stroke_weight", "skew_weight", "added")
            if key in table
        },
        **drawn,
    )
    if not 0 < len(sketch.all_seeds) <= MOST_SEEDS:
        raise InputError(f"{place}seeds: {seeds!r} must rise, by less than {MOST_SEEDS}; write it as 1-1000")
    return sketch


def _read_drawing(table: dict[str, Any], place: str, folder: Path) -> dict[str, Any]:
    """The published drawing and mask of a sketch."""
    drawing, mask = (
        read_bytes(_existing_path(folder, table[key], f"{place}{key}"), MAX_BYTES) if key in table else b""
        for key in ("file", "mask")
    )
    try:
        drawing, suffix = publishable_sketch(
            drawing, Path(table.get("file_name", table["file"])).suffix.lower()
        )
    except InputError as error:
        raise InputError(f"{place}file: {table['file']}: {error}") from error
    return {"drawing": drawing, "suffix": suffix, "mask": mask}


def _existing_path(folder: Path, name: str, place: str) -> Path:
    path = folder / name
    if not (path.is_file() or (place == "points" and path.exists())):
        raise InputError(
            f"{place}: there is no file {path}; check the path, which starts at the specification's folder"
        )
    return path
