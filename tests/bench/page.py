"""docs/performance.md from the measurements of the benchmark."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

Found = dict[str, Any]
MILP = "milp-mccormick"
NAMES = {
    "ours": "crossfield",
    "copied": "one write",
    "highs": "HiGHS",
    "pyomo": "Pyomo",
}
METHOD = (
    "`python tests/bench` measures every number in a separate process, one at a time.",
    "The instance is a full square of pixels, a fifth of them with a stroke.",
    "",
    "- Seconds: from the instance to the closed file, with names, SHA-256 and, for .nl, the files of names.",
    "  Median of three runs, or one run if it takes more than 5 s.",
    "- CPU: time of all threads. Compare it if other programs shared the cores.",
    "- Peak memory: of the whole process, with its libraries.",
)
PACKAGES = ("numpy", "sympy", "pyomo", "linopy", "highspy")


def machine() -> dict[str, str]:
    """Facts about the machine that the numbers depend on, without the name of the host."""
    found = {"Python": platform.python_version(), "system": platform.system()}
    info = Path("/proc/cpuinfo")
    model = re.search(r"model name\s*:\s*(.+)", info.read_text()) if info.exists() else None
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    found["processor"] = (
        f"{os.cpu_count()} cores, {model[1] if model else platform.machine()}, {memory / 2**30:.0f} GB"
    )
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


class Page:
    """The measurements by their arguments, and tables of them."""

    def __init__(self, document: Found) -> None:
        self.found: dict[str, Found] = document["found"]

    def __call__(
        self, task: str, size: int, suffix: str = "lp", formulation: str = MILP, *rest: object
    ) -> Found | None:
        return self.found.get(" ".join(map(str, (task, formulation, suffix, size, *rest))))

    def ratio(self, other: Found | None, one: Found | None, what: str = "seconds") -> float | None:
        """The ratio of the other measurement to this one."""
        return other[what] / one[what] if other and one and one[what] else None


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A Markdown table."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)] + [""]


def seconds(found: Found | None, what: str = "seconds") -> str:
    """Seconds with three significant digits."""
    return "" if found is None else f"{found[what]:.3g}" if found[what] < 100 else f"{found[what]:.0f}"


def page(document: Found, sizes: Sequence[int], names: Sequence[str], middle: int, pixels: int) -> str:
    """The page as Markdown."""
    at = Page(document)
    given = document["machine"]
    packages = ", ".join(f"{name} {given[name]}" for name in PACKAGES)
    loads = [each["load"] for each in at.found.values()]
    lines = [
        "# How fast files are written",
        "",
        "[All pages](index.md). Speed and memory of the writers, compared with other programs.",
        "",
        *METHOD,
        "",
        f"{given['processor']}, {given['system']}. Python {given['Python']}, {packages}.",
        f"Load average while measuring: {min(loads):.1f} to {max(loads):.1f}.",
        "",
        f"## LP and MPS of `{MILP}` next to other programs",
        "",
        "linopy and HiGHS build their models from whole arrays. The other programs do not write our names.",
        "Each stops before the size that would take more than about a minute.",
        "gurobipy is missing, because its free licence ends at 2000 columns.",
        "",
    ]
    for suffix in ("lp", "mps"):
        lines += [f"### {suffix.upper()}", "", *peers(at, sizes, suffix)]
    lines += [
        "## Every formulation against Pyomo",
        "",
        f"{middle} x {middle}: seconds of crossfield, of Pyomo (model and writer), and their ratio.",
        "",
    ]
    lines += against_pyomo(at, names, middle)
    return "\n".join([*lines, *others(at, sizes, pixels)]).rstrip() + "\n"


def times(value: float | None) -> str:
    """A ratio with significant digits."""
    return "" if value is None else f"{value:.1f}" if value < 10 else f"{value:.0f}"


def pair(at: Page, name: str, suffix: str, size: int) -> tuple[Found | None, Found | None]:
    """Pyomo's measurement and ours."""
    return at("pyomo", size, suffix, name), at("ours", size, suffix, name)


def peers(at: Page, sizes: Sequence[int], suffix: str) -> list[str]:
    """Ours, the copy and the peers, by size."""
    rows = []
    for size in sizes:
        mine = at("ours", size, suffix)
        for task in ("ours", "copied", "linopy", "highs", "pyomo"):
            found = at(task, size, suffix)
            if found and mine:
                written = (mine if task == "copied" else found)["bytes"]
                cells = [
                    f"{written / 1e6:.3g}",
                    seconds(found),
                    seconds(found, "cpu"),
                    f"{written / 1e6 / found['seconds']:.0f}",
                    f"{found['memory'] / 1e6:.0f}",
                ]
                ratios = [times(at.ratio(found, mine, what)) for what in ("seconds", "cpu")]
                rows.append([str(size), NAMES.get(task, task), *cells, *ratios])
    return table(
        ["size", "writer", "MB", "seconds", "CPU s", "MB/s", "peak MB", "seconds / ours", "CPU / ours"], rows
    )


def against_pyomo(at: Page, names: Sequence[str], size: int) -> list[str]:
    """Ours and Pyomo for every formulation and format."""
    rows = []
    for name in names:
        cells = []
        for suffix in ("nl", "lp", "mps", "gms"):
            theirs, mine = pair(at, name, suffix, size)
            ratio = at.ratio(theirs, mine)
            cells.append(f"{seconds(mine)} / {seconds(theirs)} = {ratio:.0f}x" if ratio else seconds(mine))
        rows.append([f"`{name}`", *cells])
    return table(["", "nl", "lp", "mps", "gms"], rows)


def others(at: Page, sizes: Sequence[int], pixels: int) -> list[str]:
    """All formats at the two largest sizes, and other tasks that users wait for."""
    formats = [("lp", ()), ("mps", ()), ("nl", ("text",)), ("nl", ("binary",)), ("gms", ())]
    found = [
        (" ".join([suffix, *rest]), size, at("ours", size, suffix, MILP, *rest))
        for size in sizes[-2:]
        for suffix, rest in formats
    ]
    half, big, small = sizes[-2], sizes[-1], min(24, sizes[-1])
    found += [
        ("all formats, one at a time (`--jobs 1`)", big, at("everything", big, "", MILP, 1)),
        ("all formats, two at once (`--jobs 2`)", big, at("everything", big, "", MILP, 2)),
        ("all formulations in all formats", small, at("everything", small, "", "all", 1)),
        ("LP, compressed", half, at("ours", half, "lp.gz")),
        ("a solution file of HiGHS to a field", pixels, at("solution", pixels, "highs")),
        ("a solution file of AMPL to a field", pixels, at("solution", pixels, "ampl")),
    ]
    cells = [
        [what, str(size), seconds(f), seconds(f, "cpu"), f"{f['memory'] / 1e6:.0f}"]
        for what, size, f in found
        if f
    ]
    return ["## Formats and other tasks", "", *table(["", "size", "seconds", "CPU s", "peak MB"], cells)]
