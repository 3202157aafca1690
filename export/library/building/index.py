"""The files about a library as a whole: texts, pictures, drawings, checkers, optima, index and SHA256SUMS."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ....models.field.field import NORMS
from ....models.field.file import read_field
from ....models.formulations.catalogue import FORMULATIONS
from ....models.proof.checkers import check_certificate, check_orthogonal
from ....models.storage import read_bytes, write_bytes
from ....models.written_files import is_unchanged
from ....templates import ENVIRONMENT
from ...formats.registry import FORMATS, program_version
from ...pictures.draw import page_picture
from ...writing.records import number_text
from ..documents import check_point
from ..documents.checksums import SUMS, write_checksums
from ..documents.citation import PAPER, REFERENCES, licence_terms
from ..documents.documents import (
    INDEX,
    INDEX_FORMAT,
    VERSION,
    about_file,
    document_bytes,
    files_of_entry,
    files_of_instance,
    load_document,
)
from ..ledger.ledger import LEDGER, read_ledger
from ..plan.recipe import InstanceRecipe, norm_minimised
from ..plan.spec import RUNGS, Spec
from .table import TABLE, instance_name, table

CHECKER: Final = "check_point.py"
SOLU: Final = "library.solu"
TEXTS: Final = ("README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "index.html")

CHECKERS: Final = {"certified": check_certificate, "orthogonal": check_orthogonal}
"""Checkers of certificates, by the fact of a library that needs them."""
GENERAL: Final = frozenset(
    {*TEXTS, CHECKER, SOLU, TABLE, INDEX, LEDGER, SUMS, "check_certificate.py", "check_orthogonal.py"}
)
"""Names of the files about a library as a whole, but for pictures and drawings."""

_OURS: Final = re.compile(r"cf_[a-z0-9_]+(?:\.[A-Za-z0-9]+)+")


def write_index(
    folder: Path,
    spec: Spec,
    plans: Sequence[InstanceRecipe],
    skipped: Mapping[str, str],
    *,
    failed: Iterable[str],
    earlier: Mapping[str, str],
) -> None:
    """Write the files about the library as a whole and remove the files of entries that left it.

    skipped: names of instances that the specification asks for and that are not in the plans, and why;
    failed: those of them that an error keeps out; earlier: checksums of the build before.
    """
    sidecars = [load_document(folder / f"{entry.name}.json") for recipe in plans for entry in recipe.entries]
    written = general_files(folder, spec, sidecars, skipped)
    for name, data in written.items():
        write_bytes(folder / name, data)
    abouts = [about_file(recipe.name) for recipe in plans]
    present = {*written, LEDGER, *read_ledger(folder).files, *abouts}
    present |= {name for file in abouts for name in files_of_instance(load_document(folder / file))}
    for sidecar in sidecars:
        present |= {f"{sidecar['name']}.json", *files_of_entry(sidecar)}
    for name in earlier.keys() - present:  # files that were added by hand stay, and those of what failed
        is_ours = (name in GENERAL or _OURS.fullmatch(name)) and is_unchanged(folder / name)
        if is_ours and not name.startswith(tuple(failed)):
            (folder / name).unlink()
    write_checksums(folder, present)


def general_files(
    folder: Path, spec: Spec, sidecars: list[dict[str, Any]], skipped: Mapping[str, str]
) -> dict[str, bytes]:
    """Return the files about the library as a whole, the index last. folder: holds all other files."""
    pictures = dict(_draw_pictures(folder, sidecars))
    context = _template_context(spec, sidecars) | {"skipped": skipped, "pictures": pictures}
    texts = {name: ENVIRONMENT.get_template(f"library/{name}.j2").render(context).encode() for name in TEXTS}
    drawings = {name: data for sketch in spec.sketches for name, data in sketch.files.items()}
    programs = [check_point, *(program for key, program in CHECKERS.items() if context[key])]
    paths = [Path(str(program.__file__)) for program in programs]
    checkers = {path.name: read_bytes(path) for path in paths}
    index = {
        "format": INDEX_FORMAT,
        "version": VERSION,
        "generator": program_version(),
        "spec": spec.document(),
        "entries": [sidecar["name"] for sidecar in sidecars],
        **({"skipped": dict(skipped)} if skipped else {}),
    }
    facts = {SOLU: _solu_content(sidecars), TABLE: table(folder, sidecars)}
    return texts | pictures | drawings | checkers | facts | {INDEX: document_bytes(index)}


def _draw_pictures(folder: Path, sidecars: list[dict[str, Any]]) -> Iterator[tuple[str, bytes]]:
    """Name and content of a picture per sketch: the field of least 2-norm energy on its largest domain."""
    largest = {
        sidecar["family"]: sidecar
        for sidecar in sorted(sidecars, key=lambda each: (each["source"]["size"], each["source"]["gauge"]))
    }
    for family in sorted(largest):
        about = load_document(folder / about_file(instance_name(largest[family])))
        field = read_field(folder / about["fields"]["least_2"]["file"])
        suffix = "png" if "faces" in about["instance"] else "svg"
        yield f"cf_{family}.field.{suffix}", page_picture(field)


def _template_context(spec: Spec, sidecars: list[dict[str, Any]]) -> dict[str, Any]:
    rungs = [
        _rung_facts(name, [sidecar for sidecar in sidecars if sidecar["rung"] == name]) for name in RUNGS
    ]
    written = {file["format"] for sidecar in sidecars for file in sidecar["files"]}
    certified = {
        sidecar["source"]["kind"]
        for sidecar in sidecars
        if any("certificate" in bound for bound in sidecar["bounds"])
    }
    minimising = {
        norm: [formulation for formulation in spec.formulations if norm_minimised(formulation) == norm]
        for norm in NORMS
    }
    return {
        "spec": spec,
        "generator": program_version(),
        "release": {"title": spec.title, "authors": []} | (spec.release or {}),
        "terms": licence_terms(spec.sketches),
        "references": REFERENCES,
        "paper": PAPER,
        "rungs": [rung for rung in rungs if rung["entries"]],
        "instances": len({sidecar["instance"]["sha256"] for sidecar in sidecars}),
        "entries": len(sidecars),
        "sidecars": sidecars,
        "tokens": {name: FORMULATIONS[name].short for name in spec.formulations},
        "kinds": {sidecar["formulation"]: sidecar for sidecar in reversed(sidecars)},
        "formats": [entry for name, entry in FORMATS.items() if name in written],
        "packed": any(file["name"].endswith(".gz") for sidecar in sidecars for file in sidecar["files"]),
        "tightened": sum("tightened" in sidecar for sidecar in sidecars),
        "certified": bool(certified),
        "orthogonal": "mesh" in certified,
        "proven_by": [f"norm {norm}, {', '.join(names)}" for norm, names in minimising.items() if names],
        "example": sidecars[0],
    }


def _rung_facts(name: str, sidecars: list[dict[str, Any]]) -> dict[str, Any]:
    """Facts about a rung: sizes, share of strokes, numbers of entries, optima and grades."""
    sizes = sorted({sidecar["source"]["size"] for sidecar in sidecars})
    proven = sum(sidecar["status"] == "optimal" for sidecar in sidecars)
    density = sum(sidecar["density"] for sidecar in sidecars) / max(len(sidecars), 1)
    grades = Counter(sidecar["difficulty"] for sidecar in sidecars)
    stated = {"name": name, "sizes": sizes, "entries": len(sidecars), "optimal": proven, "grades": grades}
    return stated | {"density": f"{density:.2f}"}


def _solu_content(sidecars: list[dict[str, Any]]) -> bytes:
    """The content of library.solu as MINLPLib and SCIP have it: =opt= or =best=, and =bestdual=."""
    lines = []
    for sidecar in sidecars:
        tag = "=opt=" if sidecar["status"] == "optimal" else "=best="
        lines.append(f"{tag} {sidecar['name']} {number_text(sidecar['best']['objective'])}\n")
        if sidecar["status"] != "optimal" and sidecar["bound"] is not None:
            lines.append(f"=bestdual= {sidecar['name']} {number_text(sidecar['bound'])}\n")
    return "".join(lines).encode()
