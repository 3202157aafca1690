"""docs/performance.md from what the benchmark measured."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Callable, Sequence
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
    "pyoptinterface": "PyOptInterface",
}
PACKAGES = ("numpy", "sympy", "pyomo", "linopy", "highspy", "pyoptinterface")


def machine() -> dict[str, str]:
    """What the numbers depend on, without the name of the host."""
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
    """The measurements, by what was measured, and tables of them."""

    def __init__(self, document: Found) -> None:
        self.found: dict[str, Found] = document["found"]
        self.document = document

    def __call__(
        self, task: str, size: int, suffix: str = "lp", formulation: str = MILP, *rest: object
    ) -> Found | None:
        return self.found.get(" ".join(map(str, (task, formulation, suffix, size, *rest))))

    def ratio(self, other: Found | None, one: Found | None, what: str = "seconds") -> float | None:
        """How many times as much the other one takes."""
        return other[what] / one[what] if other and one and one[what] else None


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A Markdown table."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)] + [""]


def seconds(found: Found | None, what: str = "seconds") -> str:
    """Seconds with three digits that mean something."""
    return "" if found is None else f"{found[what]:.3g}" if found[what] < 100 else f"{found[what]:.0f}"


def page(document: Found, sizes: Sequence[int], names: Sequence[str], middle: int, pixels: int) -> str:
    """The page as Markdown."""
    at = Page(document)
    given = document["machine"]
    lines = [
        "# How fast files are written",
        "",
        "Written by `python tests/bench`; every number is measured in a process of its own, one at a time. The instance is a full square of pixels, a",
        "fifth of them with a stroke. Seconds go from the instance to the closed file (names, SHA-256 and, for .nl, the files of names included),",
        "the median of three runs, or of one when it takes more than 5 s. *CPU* is the time of all threads: where other programs shared the cores, it is",
        "the number to compare. Peak memory is that of the whole process, libraries included.",
        "",
        f"{given['processor']}, {given['system']}. Python {given['Python']}, "
        + ", ".join(f"{name} {given[name]}" for name in PACKAGES)
        + f". Load average while measuring: {min(f['load'] for f in at.found.values()):.1f} to {max(f['load'] for f in at.found.values()):.1f}.",
        "",
        "## Targets",
        "",
        *table(["", "target", "measured", ""], targets(at, sizes, names, middle, pixels)),
        *reasons(at, sizes[-2], sizes[-1]),
        "## LP and MPS of `milp-mccormick` beside the peers",
        "",
        "Peers build their model from whole arrays where they can (linopy, HiGHS), and write without our names: their files are smaller. A peer stops at the",
        "size before it would take more than about a minute. gurobipy's free licence ends at 2000 columns, so it is not here.",
        "",
    ]
    for suffix in ("lp", "mps"):
        lines += [f"### {suffix.upper()}", "", *peers(at, sizes, suffix)]
    lines += [
        "## Every formulation against Pyomo",
        "",
        f"{middle} x {middle}: seconds of ours, of Pyomo (model and writer), and how many times that is.",
        "",
    ]
    lines += against_pyomo(at, names, middle)
    lines += ["## Where the time goes", "", *where(at, sizes[-2]), *others(at, sizes, pixels)]
    return "\n".join(lines).rstrip() + "\n"


def reasons(at: Page, half: int, big: int) -> list[str]:
    """Why what is not met is not, in measured numbers."""
    steps = [
        at(task, half, "lp", MILP, *rest)
        for task, rest in (("rendered", ("",)), ("hashed", ()), ("ours", ()))
    ]
    shares = [round(100 * (at.ratio(step, steps[-1], "cpu") or 0)) for step in steps[:2]]
    bytes_ = at.ratio(at("linopy", half, "lp"), at("ours", half, "lp"), "bytes") or 0
    made = {
        s: at.ratio(at("rendered", big, s, MILP, ""), at("rendered", half, s, MILP, ""), "cpu")
        for s in ("lp", "mps", "nl")
    }
    grown = ", ".join(f"{suffix} {times(value)}" for suffix, value in made.items() if value)
    written = at.ratio(
        at("copied", big, "gms", MILP, "scalar"), at("copied", half, "gms", MILP, "scalar"), "cpu"
    )
    return [
        "What stands behind these numbers, and behind those not met:",
        "",
        f"- linopy, LP: it is handed whole arrays of column numbers here, past its own expressions, and its file has numbered names: {100 * bytes_:.0f} % of our bytes.",
        f"  Of our CPU seconds, making the text takes {shares[0]} % and SHA-256 for the manifest {shares[1]} %; the rest is the system's work for writing and for threads.",
        "- Pyomo, objectives with products in LP and MPS: what does not grow counts in small files (the algebra), and equal products are found by sorting.",
        "- One write: nothing is computed for it. Hashing alone takes as long as several of them, and so does making the text.",
        f"- Growth: making the text grows {grown} times in CPU seconds. One write of the GAMS file alone grew {times(written)} times: that part is the system's.",
        "",
    ]


def times(value: float | None) -> str:
    """A ratio with digits that mean something."""
    return "" if value is None else f"{value:.1f}" if value < 10 else f"{value:.0f}"


def targets(
    at: Page, sizes: Sequence[int], names: Sequence[str], middle: int, pixels: int
) -> list[list[str]]:
    """The lines of the table of targets."""
    big, half = sizes[-1], sizes[-2]
    rows: list[list[str]] = []

    def add(
        what: str, target: str, values: dict[str, float | None], met: Callable[[float], bool], unit: str = ""
    ) -> None:
        known = {name: value for name, value in values.items() if value is not None}
        text = ", ".join(f"{name} {value:.3g}{unit}".strip() for name, value in known.items())
        rows.append(
            [
                what,
                target,
                text or "not measured",
                "met" if known and all(map(met, known.values())) else "not met",
            ]
        )

    for what, key in (("seconds", "seconds"), ("CPU", "cpu")):
        add(
            f"LP and MPS, {half} x {half}, linopy over ours ({what})",
            "at least 10",
            {s.upper(): at.ratio(at("linopy", half, s), at("ours", half, s), key) for s in ("lp", "mps")},
            lambda value: value >= 10,
        )
    pyomo = {
        f"{name} {suffix}": at.ratio(*pair(at, name, suffix, middle))
        for name in names
        for suffix in ("nl", "lp", "mps", "gms")
    }
    least = min(((value, name) for name, value in pyomo.items() if value is not None), default=(None, ""))
    add(
        f"any formulation and format, {middle} x {middle}, Pyomo over ours (seconds)",
        "at least 40",
        {f"least ({least[1]})": least[0]},
        lambda value: value >= 40,
    )
    cpu = {
        f"{name} {suffix}": at.ratio(*pair(at, name, suffix, middle), "cpu")
        for name in names
        for suffix in ("nl", "lp", "mps", "gms")
    }
    least = min(((value, name) for name, value in cpu.items() if value is not None), default=(None, ""))
    add(
        f"any formulation and format, {middle} x {middle}, Pyomo over ours (CPU)",
        "at least 40",
        {f"least ({least[1]})": least[0]},
        lambda value: value >= 40,
    )
    add(
        "ours over one write of the same bytes (seconds)",
        "at most 3",
        {
            f"{s.upper()} {size}": at.ratio(at("ours", size, s), at("copied", size, s))
            for s in ("lp", "mps")
            for size in (half, big)
        },
        lambda value: value <= 3,
    )
    every = [at("everything", big, "scalar", MILP, jobs) for jobs in (1, 2)]
    add(
        f"{big} x {big}, all formats",
        "under 30 s",
        {f"{jobs} at once": f and f["seconds"] for jobs, f in zip((1, 2), every, strict=True)},
        lambda value: value < 30,
        " s",
    )
    add(
        "its peak memory",
        "under 2 GB",
        {f"{jobs} at once": f and f["memory"] / 1e9 for jobs, f in zip((1, 2), every, strict=True)},
        lambda value: value < 2,
        " GB",
    )
    for what in ("seconds", "cpu", "memory"):
        grown = {
            s.upper(): at.ratio(at("ours", big, s, MILP, *d), at("ours", half, s, MILP, *d), what)
            for s, d in (("lp", ()), ("mps", ()), ("nl", ("text",)), ("gms", ("scalar",)))
        }
        add(f"growth of {what} from {half} to {big}", "below 4.4", grown, lambda value: value < 4.4)
    small = at("everything", min(24, big), "indexed", "all", 1)
    add(
        "size 24, all formulations in all formats",
        "under 2 s",
        {"": small and small["seconds"]},
        lambda value: value < 2,
        " s",
    )
    add("`crossfield --help`", "under 0.4 s", {"": at.document["help"]}, lambda value: value < 0.4, " s")
    add(
        f"a solution of {pixels} x {pixels} pixels (4 million columns at 552) to a field",
        "under 4 s",
        {
            name: found and found["seconds"]
            for name, found in (
                ("HiGHS", at("solution", pixels, "highs")),
                ("AMPL", at("solution", pixels, "ampl")),
            )
        },
        lambda value: value < 4,
        " s",
    )
    return rows


def pair(at: Page, name: str, suffix: str, size: int) -> tuple[Found | None, Found | None]:
    """Pyomo's measurement and ours."""
    dialect = ("scalar",) if suffix == "gms" else ()
    return at("pyomo", size, suffix, name), at("ours", size, suffix, name, *dialect)


def peers(at: Page, sizes: Sequence[int], suffix: str) -> list[str]:
    """Ours, the copy and the peers, by size."""
    rows = []
    for size in sizes:
        mine = at("ours", size, suffix)
        for task in ("ours", "copied", "linopy", "highs", "pyoptinterface", "pyomo"):
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
    return table(["", "nl", "lp", "mps", "gms scalar"], rows)


def where(at: Page, size: int) -> list[str]:
    """What making, hashing and writing cost, and the sections of a file."""
    lines = [
        f"`{MILP}`, {size} x {size}. CPU seconds: the bytes alone, their SHA-256, one write of them, and the whole as it is.",
        "",
    ]
    rows = []
    for suffix, rest in (("lp", ()), ("mps", ()), ("nl", ("text",))):
        steps = [
            at("rendered", size, suffix, MILP, ""),
            at("hashed", size, suffix),
            at("copied", size, suffix, MILP, *rest),
            at("ours", size, suffix, MILP, *rest),
        ]
        rows.append([suffix, *(seconds(step, "cpu") for step in steps)])
    lines += table(["", "made", "hashed", "written", "whole"], rows)
    rows = []
    for suffix in ("lp", "mps", "nl"):
        found = at("sections", size, suffix)
        for title, (spent, length) in (found or {"sections": {}})["sections"].items():
            rows.append(
                [
                    suffix,
                    title,
                    f"{spent:.3f}",
                    f"{length / 1e6:.1f}",
                    f"{length / 1e6 / spent:.0f}" if spent else "",
                ]
            )
    lines += [
        "By section, in file order. The first sections include the algebra (SymPy, some 10 ms a family, whatever the size).",
        "",
    ]
    return lines + table(["", "section", "seconds", "MB", "MB/s"], rows)


def others(at: Page, sizes: Sequence[int], pixels: int) -> list[str]:
    """All formats at the two largest sizes, and what else users wait for."""
    rows = []
    for size in sizes[-2:]:
        for suffix, rest in (
            ("lp", ()),
            ("mps", ()),
            ("nl", ("text",)),
            ("nl", ("binary",)),
            ("gms", ("scalar",)),
            ("gms", ("indexed",)),
        ):
            found = at("ours", size, suffix, MILP, *rest)
            if found:
                label = " ".join([suffix, *rest])
                rows.append(
                    [
                        str(size),
                        label,
                        f"{found['bytes'] / 1e6:.0f}",
                        seconds(found),
                        seconds(found, "cpu"),
                        f"{found['memory'] / 1e6:.0f}",
                    ]
                )
    lines = [
        "## Every format",
        "",
        *table(["size", "format", "MB", "seconds", "CPU s", "peak MB"], rows),
        "## And",
        "",
    ]
    rest = [
        (
            "all formats, one at a time (`--jobs 1`)",
            at("everything", sizes[-1], "scalar", MILP, 1),
            sizes[-1],
        ),
        ("all formats, two at once (`--jobs 2`)", at("everything", sizes[-1], "scalar", MILP, 2), sizes[-1]),
        (
            "all formulations in all formats",
            at("everything", min(24, sizes[-1]), "indexed", "all", 1),
            min(24, sizes[-1]),
        ),
        ("LP, compressed", at("ours", sizes[-2], "lp.gz"), sizes[-2]),
        ("a picture of four times the size to an instance", at("picture", sizes[-1]), sizes[-1]),
        ("a solution file of HiGHS to a field", at("solution", pixels, "highs"), pixels),
        ("a solution file of AMPL to a field", at("solution", pixels, "ampl"), pixels),
    ]
    cells = [
        [what, str(size), seconds(f), seconds(f, "cpu"), f"{f['memory'] / 1e6:.0f}"]
        for what, f, size in rest
        if f
    ]
    return lines + table(["", "size", "seconds", "CPU s", "peak MB"], cells)
