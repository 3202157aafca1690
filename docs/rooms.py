"""Table and picture of the folders of the package (`python docs/make.py architecture`).

Descriptions are the first lines of docstrings, and arrows are imports. Only the order of the folders and
their places in the picture are set here.
"""

from __future__ import annotations

import ast
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import Final

PARTS: Final = ("models", "export", "templates")
GROUND: Final = "models"
"""The folder whose top level every folder uses; it is left out of the table."""

ORDER: Final = (
    "models", "models/processes", "models/instance", "models/mesh", "models/sketch", "models/samples",
    "models/field", "models/smooth", "models/surface", "models/orthogonal", "models/formulations",
    "models/search", "models/proof/checkers", "models/proof/bound", "models/proof/descent", "models/proof",
    "templates",
    "export/writing", "export/formats", "export", "export/solutions/readers",
    "export/solutions",
    "export/bundle", "export/shading", "export/pictures", "export/surfaces", "export/programs",
    "export/solving", "export/verify", "export/runs", "export/studio",
    "export/library", "export/library/plan", "export/library/documents", "export/library/ledger",
    "export/library/building", "export/library/contributions",
    "export/cli",
)  # fmt: skip
"""From the ground up: a folder uses only earlier folders."""


def folders(root: Path) -> list[str]:
    """Every folder of the package below its parts, as `export/formats`."""
    packages = (path.parent for part in PARTS for path in (root / part).rglob("__init__.py"))
    return sorted(path.relative_to(root).as_posix() for path in packages)


def first_line(root: Path, folder: str) -> str:
    """Description of a folder: the first line of its docstring."""
    text = ast.get_docstring(ast.parse((root / folder / "__init__.py").read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0]


def used_folders(root: Path, folder: str) -> list[str]:
    """The other folders from which the modules of a folder import, except the ground."""
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in (root / folder).glob("*.py")]
    nodes = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    used = {other for node in nodes if node.level for other in target_folders(root, folder, node)}
    return sorted(used - {folder, GROUND})


def target_folders(root: Path, folder: str, node: ast.ImportFrom) -> set[str]:
    """The folders to which a relative import leads."""
    base = (root / folder).joinpath(*[".."] * (node.level - 1), *(node.module or "").split(".")).resolve()
    if not base.is_dir():
        return {base.parent.relative_to(root).as_posix()}
    return {
        (base / name.name if (base / name.name).is_dir() else base).relative_to(root).as_posix()
        for name in node.names
    }


def table(root: Path) -> list[dict[str, str]]:
    """Rows in the order from the ground up: folder, content, imports besides the top of models/."""
    return [
        {
            "folder": folder,
            "content": first_line(root, folder),
            "imports": " ".join(used_folders(root, folder)),
        }
        for folder in ORDER
    ]


# The picture has five columns. Data goes right in the first row and left in the third; surfaces are below.

WIDE, HIGH, GAP, LEFT = 168, 84, 78, 30
WHOLE: Final = 5 * WIDE + 4 * GAP
WIDTH: Final = WHOLE + 2 * LEFT
HEIGHT: Final = 940
PLACES: Final = {
    "models/sketch": (0, 320), "models/instance": (1, 320), "models/formulations": (2, 320),
    "export/writing": (3, 320), "export/formats": (4, 320),
    "models/proof": (0, 470), "models/search": (1, 470), "templates": (3, 470), "export/bundle": (4, 470),
    "export/pictures": (1, 620), "models/field": (2, 620), "export/solutions": (3, 620),
    "export/solving": (4, 620),
    "export/shading": (0, 770), "export/surfaces": (1, 770), "models/surface": (2, 770),
}  # fmt: skip
FLOW: Final = (
    ("models/sketch", "models/instance", "strokes,", "mask"),
    ("models/instance", "models/formulations", "Instance", ""),
    ("models/formulations", "export/writing", "Problem", ""),
    ("export/writing", "export/formats", "names,", "records"),
    ("export/formats", "export/bundle", ".nl .gms .lp .mps", ""),
    ("export/bundle", "export/solving", "files, manifest", ""),
    ("export/solving", "export/solutions", "solution", "file"),
    ("export/solutions", "models/field", "Solution", ""),
    ("models/field", "export/pictures", "CrossField", ""),
    ("models/field", "models/surface", "CrossField", ""),
    ("models/surface", "export/surfaces", "Surface", ""),
    ("export/surfaces", "export/shading", "normals", ""),
    ("models/instance", "models/search", "Instance", ""),
    ("templates", "export/formats", "layouts", ""),
    ("models/search", "models/field", "CrossField", ""),
    ("models/search", "models/proof", "a field", ""),
)
"""Arrows of data: from, to, and the name of the data."""
INK: Final = {
    "models": ("#e3edf9", "#3d6ea8"),
    "export": ("#e6f3e6", "#4b8b50"),
    "templates": ("#f8efdc", "#b08a3c"),
}
STYLE: Final = """text { font-family: Inter, 'Segoe UI', Helvetica, Arial, sans-serif; fill: #223; }
.name { font-weight: 600; font-size: 14px; } .what { font-size: 12px; }
.data { font-size: 11.5px; font-style: italic; fill: #555; }
.flow { stroke: #667; stroke-width: 1.6; fill: none; marker-end: url(#tip); }"""

TIP: Final = """<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7"
orient="auto-start-reverse">
<path d="M0 1L9 5L0 9z" fill="#667"/></marker></defs>"""


def picture(root: Path) -> str:
    """The folders and the data between them, as SVG."""
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
    parts = [
        f'{head}height="{HEIGHT}" role="img">',
        "<title>The folders of crossfield and the flow of data through them</title>",
        f"<style>{STYLE}</style>",
        TIP,
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        *bars(root),
        *(box(root, folder) for folder in PLACES),
        *(arrow(*step) for step in FLOW),
        *data_at_ends(),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def bars(root: Path) -> list[str]:
    """The folders that use the whole flow, above it, and the ground below it."""
    library = [folder for folder in ORDER if folder.startswith("export/library/")]
    step = (WHOLE - 24 + 8) / len(library)
    places = [(folder.rpartition("/")[2], LEFT + 12 + at * step) for at, folder in enumerate(library)]
    return [
        bar(root, "export/cli", 20, 50),
        bar(root, "export/library", 82, 84),
        *(chip(name, x, 130, step - 8) for name, x in places),
        bar(root, "export/verify", 178, 50),
        chip("programs", LEFT + WHOLE - 132, 191, 120),
        bar(root, GROUND, 875, 50),
        data_label("at its top errors and storage, which every folder uses", WIDTH - LEFT - 14, 905, "end"),
    ]


def bar(root: Path, folder: str, y: int, height: int) -> str:
    """A folder over the whole width."""
    words = f'<tspan class="what" dx="14">{escape(first_line(root, folder))}</tspan>'
    text = f'<text x="{LEFT + 14}" y="{y + 30}"><tspan class="name">{folder}</tspan>{words}</text>'
    return panel(folder, LEFT, y, WHOLE, height) + text


def chip(text: str, x: float, y: float, width: float) -> str:
    """The name of a folder inside another one."""
    return (
        f'<rect x="{x:.1f}" y="{y}" width="{width:.1f}" height="24" rx="12" fill="#ffffff" stroke="#4b8b50"/>'
        f'<text class="what" text-anchor="middle" x="{x + width / 2:.1f}" y="{y + 16}">{text}</text>'
    )


def panel(folder: str, x: float, y: float, width: float, height: float) -> str:
    """A box in the colour of its part."""
    fill, line = INK[folder.partition("/")[0]]
    return (
        f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="8" fill="{fill}" '
        f'stroke="{line}" stroke-width="1.4"/>'
    )


def corner(folder: str) -> tuple[int, int]:
    """Top left corner of a folder."""
    column, y = PLACES[folder]
    return LEFT + column * (WIDE + GAP), y


def box(root: Path, folder: str) -> str:
    """A folder with its name and description."""
    x, y = corner(folder)
    lines = [
        f'<tspan x="{x + 12}" dy="17">{escape(line)}</tspan>' for line in wrap(first_line(root, folder), 25)
    ]
    name = f'<text class="name" x="{x + 12}" y="{y + 24}">{folder}</text>'
    words = f'<text class="what" x="{x + 12}" y="{y + 27}">{"".join(lines)}</text>'
    return panel(folder, x, y, WIDE, HIGH) + name + words


def arrow(begin: str, end: str, above: str, below: str) -> str:
    """An arrow between two folders, with the names of the data."""
    (x, y), (to_x, to_y) = corner(begin), corner(end)
    middle, level = to_x + WIDE / 2, y + HIGH / 2
    if y == to_y:
        start, stop = (x + WIDE, to_x - 3) if to_x > x else (x, to_x + WIDE + 3)
        path, at = f"M{start} {level}H{stop}", (start + stop) / 2
        words = data_label(above, at, level - 8) + (data_label(below, at, level + 18) if below else "")
    elif x == to_x:
        path = f"M{middle} {y + HIGH}V{to_y - 3}"
        words = data_label(above, middle + 8, (y + HIGH + to_y - 3) / 2 + 4, "start")
    elif to_y < y:  # up between two rows
        leave, enter, lane = x + WIDE - 30, to_x + 30, y - 26
        path = f"M{leave} {y}V{lane}H{enter}V{to_y + HIGH + 3}"
        words = data_label(above, (leave + enter) / 2, lane - 6)
    else:
        path = f"M{x + WIDE} {level}H{middle}V{to_y - 3}"
        words = data_label(above, (x + WIDE + middle) / 2, level - 8)
    return f'<path class="flow" d="{path}"/>{words}'


def data_label(text: str, x: float, y: float, anchor: str = "middle") -> str:
    """The name of some data."""
    return f'<text class="data" text-anchor="{anchor}" x="{x}" y="{y}">{escape(text)}</text>'


def data_at_ends() -> list[str]:
    """The data that enter at the first folder, and those that leave at the last one."""
    middle, (x, _) = LEFT + WIDE / 2, corner("export/pictures")
    sketch = data_label("a sketch: SVG, bitmap, .scap, .curves", LEFT, 270, "start")
    answer = data_label("pictures, report", x - 58, 666, "end")
    return [
        f'{sketch}<path class="flow" d="M{middle} 280V317"/>',
        f'<path class="flow" d="M{x} 662H{x - 50}"/>{answer}',
    ]
