"""The page of a run: a file in its folder that shows what is there, without a network."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from ...models.field.field import CrossField
from ...models.instance.mesh import Mesh
from ...models.storage import read_bytes, write_bytes
from ...templates import ENVIRONMENT
from ..bundle.manifest import Manifest
from ..formats.registry import FORMATS
from ..pictures.mesh_view import model_data
from ..solvers_table import BUNDLED
from .methods import table_cells

PAGE: Final = "index.html"
REPORT: Final = "report.json"
_LAYERS: Final = (
    ("drawing", True),
    ("strokes", False),
    ("crosses", False),
    ("streamlines-u", True),
    ("streamlines-v", True),
    ("singularities", True),
)
"""Layers of overlay.svg, and whether they are shown at first."""
_COLUMNS: Final = ("1-norm", "off strokes", "lines < 45°", "singularities", "seconds")
_FILES: Final = {
    "field.npz": "the field that is kept; also .json, and .rawfield with .obj and .sings",
    "lowest.npz": "the field of lowest 2-norm energy",
    "certificate.npz": "proof of the bound, for `crossfield prove --check`",
    "overlay.svg": "the field in layers, in the coordinates of the drawing",
    "overlay.png": "the same as a picture",
    "overview.png": "strokes, crosses, streamlines and angle",
    "field.png": "streamlines",
    "crosses.png": "crosses",
    "angle.png": "angle between the lines",
    "instance.png": "strokes, on the mask or the mesh",
    "shaded.png": "the surface, a layer for the drawing",
    "normals.png": "its normal map (OpenGL: green up), a layer for the drawing",
    "mask.png": "the pixels that are solved for; paint it and give it back with --mask",
    "report.json": "all facts",
}


def write_page(
    folder: Path,
    report: dict[str, Any],
    manifests: tuple[Manifest, ...],
    names: set[str],
    field: CrossField,
) -> None:
    """Write the page of a run.

    report: the document of report.json. names: the files that the run wrote. field: the kept one. Raises
    InputError, OutputError.
    """
    overlay = _read_svg(folder / "overlay.svg") if "overlay.svg" in names else ""
    text = ENVIRONMENT.get_template("run/index.html.j2").render(
        report=report,
        on_mesh="faces" in report["instance"],
        model=_model_of(field),
        names=names,
        seconds=f"{report['seconds']:.0f}",
        bound=report["proof"] and f"{report['proof']['bound_2_norm']:.6g}",
        layers=[entry for entry in _LAYERS if entry[0] != "drawing" or 'id="drawing"' in overlay],
        overlay=overlay,
        columns=["method", "2-norm", *["gap"] * bool(report["proof"]), *_COLUMNS],
        methods=[
            [facts["method"] + (" (kept)" if facts["method"] == report["kept"] else ""), *table_cells(facts)]
            for facts in report["methods"]
        ],
        sets=sorted(map(_describe_set, manifests), key=lambda entry: not entry["solve"]),
        files=[(name, meaning) for name, meaning in _FILES.items() if name in names | {REPORT}],
    )
    write_bytes(folder / PAGE, text.encode())


def _model_of(field: CrossField) -> str:
    """The data of the model that the page turns; empty without one."""
    data = model_data(field) if isinstance(field.instance.domain, Mesh) else None
    return "" if data is None else json.dumps(data)


def _read_svg(path: Path) -> str:
    """Our own SVG without its XML declaration."""
    return read_bytes(path).decode().partition("?>\n")[2]


def _describe_set(manifest: Manifest) -> dict[str, Any]:
    """The model files of a formulation, each with the lines that solve it and read its answer.

    solve: the line that solves the formulation with a solver that is installed with crossfield, if one can.
    """
    document = manifest.document
    counts = document["counts"]
    solver = next((name for name in BUNDLED if document["solvers"][name]["answer"] == "yes"), "")
    name, instance = manifest.formulation, f"models/{document['instance']['file']}"
    return {
        "solve": solver and f"crossfield solve {instance} -f {name} --solver {solver} -o {name}",
        "solver": solver and BUNDLED[solver].title,
        "formulation": document["formulation"],
        "kind": document["class"],
        "columns": counts["columns"],
        "rows": counts["rows"],
        "files": [
            _describe_file(file)
            for file in document["files"]
            if FORMATS[file["format"]].is_model(file["name"])
        ],
        "refused": list(document["refused"].values()),
    }


def _describe_file(file: dict[str, Any]) -> dict[str, Any]:
    """A model file, with the line that solves it, if its format has one, and the line that reads the answer.

    A program that is given no name for its answer, such as an AMPL solver, writes it next to the model.
    """
    entry = FORMATS[file["format"]]
    stem = file["name"].removesuffix(entry.suffix)
    beside = bool(entry.command) and "{answer}" not in entry.command
    answer = f"{'models/' if beside else ''}{stem}{entry.answers}"
    return {
        "name": file["name"],
        "kilobytes": max(1, round(file["bytes"] / 1000)),
        "solve": entry.command.format(model=f"models/{file['name']}", answer=answer),
        "read": f"crossfield read {answer} --manifest models/{stem}.manifest.json -o {stem}.npz",
    }
