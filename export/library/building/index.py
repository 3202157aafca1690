"""The files about a library as a whole: texts, drawings, checker, optima, index and SHA256SUMS."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ....models.formulations.catalogue import FORMULATIONS
from ....models.proof import check_certificate
from ....models.storage import read_bytes, sha256_of, write_bytes
from ....templates import ENVIRONMENT
from ...formats.registry import FORMATS, generator
from ...writing.records import number
from ..documents import check_point
from ..documents.citation import PAPER, REFERENCES, cited, terms
from ..documents.documents import INDEX, INDEX_FORMAT, VERSION, about_file, as_bytes, read_about, read_sidecar
from ..documents.standalone import standalone
from ..ledger.ledger import FILE as LEDGER
from ..ledger.ledger import read_ledger
from ..plan.recipe import NORMS, InstancePlan, norm_minimised
from ..plan.spec import RUNGS, Spec
from .dataset import CROISSANT, PARQUET, croissant, parquet
from .table import TABLE, table

CHECKER: Final = "check_point.py"
CERTIFICATES: Final = "check_certificate.py"
SOLU: Final = "library.solu"
SUMS: Final = "SHA256SUMS"
TEXTS: Final = ("README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md")

_OURS: Final = re.compile(r"cf_[a-z0-9_]+(?:\.[A-Za-z0-9]+)+")


def write_index(folder: Path, spec: Spec, plans: Sequence[InstancePlan], skipped: Mapping[str, str]) -> None:
    """Write the files about the library as a whole and remove the files of entries that left it.

    skipped: names of instances that the specification asks for and that are not in the plans, and why.
    """
    sidecars = [read_sidecar(folder / f"{entry.name}.json") for each in plans for entry in each.entries]
    written = general(folder, spec, sidecars, skipped)
    packed = parquet(written[TABLE])
    if packed is None:
        (folder / PARQUET).unlink(missing_ok=True)  # of an earlier build
    else:
        written[PARQUET] = packed
    for name, data in written.items():
        write_bytes(folder / name, data)
    abouts = [about_file(each.recipe.name) for each in plans]
    documents = sidecars + [read_about(folder / name) for name in abouts]
    listed = {file["name"] for each in documents for file in each["files"]}
    present = {*written, LEDGER, *abouts, *listed, *read_ledger(folder).files}
    present |= {f"{each['name']}.json" for each in sidecars}
    _remove_stale(folder, present)
    sums = "".join(f"{sha256_of(folder / name)}  {name}\n" for name in sorted(present))
    write_bytes(folder / SUMS, sums.encode())


def general(
    folder: Path, spec: Spec, sidecars: list[dict[str, Any]], skipped: Mapping[str, str]
) -> dict[str, bytes]:
    """Return the files about the library as a whole, the index last. folder: holds all other files."""
    context = _context(spec, sidecars) | {"skipped": skipped}
    texts = {name: ENVIRONMENT.get_template(f"library/{name}.j2").render(context).encode() for name in TEXTS}
    drawings = {name: data for sketch in spec.sketches for name, data in sketch.files.items()}
    checkers = {CHECKER: standalone(Path(check_point.__file__))}
    if context["certified"]:
        checkers[CERTIFICATES] = read_bytes(Path(check_certificate.__file__))
    index = _index(folder, spec, sidecars) | ({"skipped": dict(skipped)} if skipped else {})
    rows = table(folder, sidecars)
    facts = {SOLU: _optima(sidecars), TABLE: rows, CROISSANT: croissant(spec, rows)}
    return texts | drawings | checkers | facts | {INDEX: as_bytes(index)}


def _context(spec: Spec, sidecars: list[dict[str, Any]]) -> dict[str, Any]:
    rungs = [_rung(name, [each for each in sidecars if each["rung"] == name]) for name in RUNGS]
    written = {file["format"] for each in sidecars for file in each["files"]}
    return {
        "spec": spec,
        "generator": generator(),
        "release": cited(spec),
        "terms": terms(spec.sketches),
        "references": REFERENCES,
        "paper": PAPER,
        "rungs": [rung for rung in rungs if rung["entries"]],
        "instances": len({each["instance"]["sha256"] for each in sidecars}),
        "entries": len(sidecars),
        "tokens": {name: FORMULATIONS[name].short for name in spec.formulations},
        "kinds": {each["formulation"]: each for each in reversed(sidecars)},
        "formats": [entry for name, entry in FORMATS.items() if name in written],
        "packed": any(file["name"].endswith(".gz") for each in sidecars for file in each["files"]),
        "tightened": sum("tightened" in each for each in sidecars),
        "certified": any("certificate" in bound for each in sidecars for bound in each["bounds"]),
        "proven_by": _minimising(spec),
        "example": sidecars[0],
    }


def _minimising(spec: Spec) -> list[str]:
    """The formulations of a specification by the norm that they minimise."""
    found = {norm: [each for each in spec.formulations if norm_minimised(each) == norm] for norm in NORMS}
    return [f"norm {norm}, {', '.join(names)}" for norm, names in found.items() if names]


def _rung(name: str, sidecars: list[dict[str, Any]]) -> dict[str, Any]:
    """Facts about a rung: sizes, share of strokes, numbers of entries, optima and grades."""
    sizes = sorted({each["source"]["size"] for each in sidecars})
    proven = sum(each["status"] == "optimal" for each in sidecars)
    density = sum(each["density"] for each in sidecars) / max(len(sidecars), 1)
    grades = Counter(each["difficulty"] for each in sidecars)
    stated = {"name": name, "sizes": sizes, "entries": len(sidecars), "optimal": proven, "grades": grades}
    return stated | {"density": f"{density:.2f}"}


def _optima(sidecars: list[dict[str, Any]]) -> bytes:
    """The content of library.solu as MINLPLib and SCIP have it: =opt= or =best=, and =bestdual=."""
    lines = []
    for each in sidecars:
        tag = "=opt=" if each["status"] == "optimal" else "=best="
        lines.append(f"{tag} {each['name']} {number(each['best']['objective'])}\n")
        if each["status"] != "optimal" and each["bound"] is not None:
            lines.append(f"=bestdual= {each['name']} {number(each['bound'])}\n")
    return "".join(lines).encode()


def _index(folder: Path, spec: Spec, sidecars: list[dict[str, Any]]) -> dict[str, Any]:
    names = [each["name"] for each in sidecars]
    return {
        "format": INDEX_FORMAT,
        "version": VERSION,
        "generator": generator(),
        "release": cited(spec),
        "spec": spec.document(),
        "entries": names,
        "sha256": {name: sha256_of(folder / f"{name}.json") for name in names},
    }


def _remove_stale(folder: Path, present: set[str]) -> None:
    """Remove files that an earlier build listed and this one lacks; other files stay."""
    sums = folder / SUMS
    if not sums.is_file():
        return
    for line in read_bytes(sums).decode("ascii", "replace").splitlines():
        expected, _, name = line.partition("  ")
        path = folder / name
        if name not in present and _OURS.fullmatch(name) and path.is_file() and sha256_of(path) == expected:
            path.unlink()
