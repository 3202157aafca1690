"""The core, the rooms round it, their folders and a picture of them (`python docs/make.py architecture`).

Descriptions are the first lines of docstrings, imports and lines are counted. Only the order of the folders,
what rooms they belong to, what a room may use, and the places in the picture are set here.
"""

from __future__ import annotations

import ast
from html import escape
from itertools import pairwise
from pathlib import Path
from textwrap import wrap
from typing import Final, NamedTuple

PARTS: Final = ("models", "export", "templates")
GROUND: Final = "models"
"""The folder whose top level every folder uses; it is left out of the table of folders."""
CORE: Final = "core"


class Room(NamedTuple):
    """A part of the package that can be taken out without touching those that it does not serve.

    uses: the other rooms that it may import, besides the core.
    """

    content: str
    folders: tuple[str, ...]
    uses: tuple[str, ...] = ()


ROOMS: Final = {
    CORE: Room(
        "from an instance to files for solvers, and from their answers to a field",
        (
            *(
                "models",
                "models/processes",
                "models/instance",
                "models/field",
                "models/formulations",
                "templates",
            ),
            *(
                "export/writing",
                "export/formats",
                "export",
                "export/solutions/readers",
                "export/solutions",
                "export/packages",
            ),
            *("export/bundle", "export/programs", "export/solving"),
        ),
    ),
    "drawings": Room("instances of drawings", ("models/sketch",)),
    "meshes": Room("instances of mesh files", ("models/mesh",)),
    "samples": Room("built-in instances", ("models/samples",), ("drawings", "meshes")),
    "fields": Room("fields without a solver", ("models/smooth", "models/orthogonal", "models/search")),
    "proofs": Room(
        "lower bounds with certificates",
        ("models/proof/checkers", "models/proof/bound", "models/proof/descent", "models/proof"),
        ("fields",),
    ),
    "surfaces": Room("surfaces over fields", ("models/surface", "export/shading"), ("fields",)),
    "pictures": Room(
        "pictures and files of surfaces", ("export/pictures", "export/surfaces"), ("drawings", "surfaces")
    ),
    "verify": Room("every program reads one model", ("export/verify",), ("fields",)),
    "runs": Room("all methods side by side", ("export/runs",), ("fields", "proofs", "surfaces", "pictures")),
    "studio": Room(
        "drawing in the browser", ("export/studio",), ("drawings", "fields", "surfaces", "pictures")
    ),
    "library": Room(
        "instances to share",
        tuple(
            f"export/library{part}"
            for part in ("", "/plan", "/documents", "/ledger", "/building", "/contributions")
        ),
        ("drawings", "meshes", "samples", "fields", "proofs", "pictures"),
    ),
}
ROOMS["commands"] = Room("the command line", ("export/cli",), tuple(name for name in ROOMS if name != CORE))
"""The core first, and each room after those that it uses."""

DEFAULT_JUMPS: Final = ("export/bundle", "models/search")
"""The one use of a room by the core: where no field is given for jumps that a problem takes as data."""

ORDER: Final = tuple(folder for room in ROOMS.values() for folder in room.folders)
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


def room_of(folder: str) -> str:
    """The room, or the core, that a folder belongs to."""
    return next(name for name, room in ROOMS.items() if folder in room.folders)


def lines_of(root: Path, room: Room) -> int:
    """The lines of the modules of a room, to hundreds."""
    paths = [path for folder in room.folders for path in (root / folder).glob("*.py")]
    return round(sum(path.read_text(encoding="utf-8").count("\n") for path in paths), -2)


def table(root: Path) -> list[dict[str, str]]:
    """Rows: room, content, folders, rooms that it may use, lines to hundreds."""
    return [
        {
            "room": name,
            "content": room.content,
            "folders": " ".join(room.folders),
            "uses": " ".join(room.uses),
            "lines": str(lines_of(root, room)),
        }
        for name, room in ROOMS.items()
    ]


# The picture: the core in the middle, with its data going round in it, and the rooms round it.

WIDE, HIGH = 168, 92
COLUMNS: Final = (24, 264, 484, 704, 944)
ROWS: Final = (96, 214, 338, 462, 586)
WIDTH, HEIGHT = 1136, 702
AROUND: Final = {
    "runs": (1, 0), "studio": (2, 0), "library": (3, 0),
    "verify": (0, 1), "proofs": (0, 2), "meshes": (4, 1), "samples": (4, 2), "drawings": (4, 3),
    "fields": (0, 4), "surfaces": (2, 4), "pictures": (4, 4),
}  # fmt: skip
"""Column and row of each room."""
FLOW: Final = (
    ("models/instance", (1, 1), "Instance"), ("models/formulations", (2, 1), "Problem"),
    ("export/writing", (3, 1), "records"), ("export/formats", (3, 2), "files"),
    ("export/bundle", (3, 3), "sets"), ("export/solving", (2, 3), "answers"),
    ("export/solutions", (1, 3), "Solution"), ("models/field", (1, 2), ""),
)  # fmt: skip
"""Folders of the core in the order of the data, their places, and the data that they pass on."""
INK: Final = {
    "models": ("#e3edf9", "#3d6ea8"),
    "export": ("#e6f3e6", "#4b8b50"),
    "room": ("#ffffff", "#667788"),
}
STYLE: Final = """text { font-family: Inter, 'Segoe UI', Helvetica, Arial, sans-serif; fill: #223; }
.name { font-weight: 600; font-size: 14px; } .what { font-size: 12px; }
.data { font-size: 11.5px; font-style: italic; fill: #555; }
.flow { stroke: #667; stroke-width: 1.6; fill: none; marker-end: url(#tip); }
.use { stroke: #a0622d; stroke-width: 1.4; fill: none; marker-end: url(#use); }"""
TIPS: Final = "".join(
    f'<marker id="{name}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" '
    f'orient="auto-start-reverse"><path d="M0 1L9 5L0 9z" fill="{colour}"/></marker>'
    for name, colour in (("tip", "#667"), ("use", "#a0622d"))
)


def picture(root: Path) -> str:
    """The core, the rooms round it, and who may use whom, as SVG."""
    core = ROOMS[CORE]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
    parts = [
        f'{head}height="{HEIGHT}" role="img">',
        "<title>The core of crossfield with the flow of data through it, and the rooms round it</title>",
        f"<style>{STYLE}</style><defs>{TIPS}</defs>",
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        panel("room", 24, 20, WIDTH - 48, 52),
        words(40, 42, ("commands", "name"), (size_of(root, "commands"), "data")),
        words(40, 60, ("use the core and all rooms", "what")),
        panel("room", COLUMNS[1] - 16, ROWS[1] - 16, 3 * 220 - 20, 3 * 124 - 4),
        words(COLUMNS[2] - 8, ROWS[2] + 34, (CORE, "name"), (size_of(root, CORE), "data")),
        *(
            words(COLUMNS[2] - 8, ROWS[2] + 54 + 17 * at, (line, "what"))
            for at, line in enumerate(wrap(core.content, 30))
        ),
        *(
            box(
                "models" if folder.startswith("models") else "export", folder, first_line(root, folder), place
            )
            for folder, place, _ in FLOW
        ),
        *(flow(*pair) for pair in pairwise(FLOW)),
        *(
            box("room", name, ROOMS[name].content, place, size_of(root, name))
            for name, place in AROUND.items()
        ),
        *(
            use(name, other)
            for name, other in (
                ("proofs", "fields"),
                ("surfaces", "fields"),
                ("pictures", "surfaces"),
                ("pictures", "drawings"),
                ("samples", "drawings"),
                ("samples", "meshes"),
            )
        ),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def size_of(root: Path, name: str) -> str:
    """The lines of a room in words."""
    return f"{lines_of(root, ROOMS[name]):,} lines"


def words(x: float, y: float, *spans: tuple[str, str]) -> str:
    """A line of text, each part with its class."""
    inner = "".join(
        f'<tspan class="{kind}" dx="{8 * bool(at)}">{escape(text)}</tspan>'
        for at, (text, kind) in enumerate(spans)
    )
    return f'<text x="{x}" y="{y}">{inner}</text>'


def panel(ink: str, x: float, y: float, width: float, height: float) -> str:
    """A box in the colour of its part."""
    fill, line = INK[ink]
    place = f'x="{x}" y="{y}" width="{width}" height="{height}"'
    return f'<rect {place} rx="8" fill="{fill}" stroke="{line}" stroke-width="1.4"/>'


def box(ink: str, name: str, content: str, place: tuple[int, int], size: str = "") -> str:
    """A folder or a room with its description and, for a room, its lines and the rooms that it may use."""
    x, y = COLUMNS[place[0]], ROWS[place[1]]
    lines = [(line, "what") for line in wrap(content, 26)]
    uses = ROOMS[name].uses if name in ROOMS else ()
    lines += [(line, "data") for line in wrap(f"→ {', '.join(uses)}", 26) if uses]
    text = [words(x + 12, y + 39 + 16 * at, line) for at, line in enumerate(lines)]
    return (
        panel(ink, x, y, WIDE, HIGH) + words(x + 12, y + 22, (name, "name"), (size, "data")) + "".join(text)
    )


def flow(begin: tuple[str, tuple[int, int], str], end: tuple[str, tuple[int, int], str]) -> str:
    """The arrow of the data from one folder of the core to the next."""
    return line("flow", begin[1], end[1], begin[2])


def use(name: str, other: str) -> str:
    """The arrow from a room to one beside it that it may use."""
    return line("use", AROUND[name], AROUND[other])


def line(kind: str, begin: tuple[int, int], end: tuple[int, int], data: str = "") -> str:
    """An arrow between two places in one row or column."""
    (x, y), (to_x, to_y) = ((COLUMNS[column], ROWS[row]) for column, row in (begin, end))
    if y == to_y:
        start, stop = (x + WIDE, to_x - 3) if to_x > x else (x, to_x + WIDE + 3)
        path, at = f"M{start} {y + HIGH / 2}H{stop}", ((start + stop) / 2, y + HIGH / 2 - 8)
    else:
        start, stop = (y + HIGH, to_y - 3) if to_y > y else (y, to_y + HIGH + 3)
        path, at = f"M{x + WIDE / 2} {start}V{stop}", (x + WIDE / 2 + 28, (start + stop) / 2 + 4)
    label = f'<text class="data" text-anchor="middle" x="{at[0]}" y="{at[1]}">{data}</text>' if data else ""
    return f'<path class="{kind}" d="{path}"/>{label}'
