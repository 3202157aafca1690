"""docs/performance.md from the measurements of the benchmark."""

from __future__ import annotations

import operator
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
WHAT = {"seconds": "seconds", "cpu": "CPU"}
MET: dict[str, Callable[[float, float], bool]] = {
    "at least": operator.ge,
    "at most": operator.le,
    "under": operator.lt,
    "below": operator.lt,
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
PACKAGES = ("numpy", "sympy", "pyomo", "linopy", "highspy", "pyoptinterface")


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
        self.document = document

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
    loads = [found["load"] for found in at.found.values()]
    lines = [
        "# How fast files are written",
        "",
        "[All pages](index.md). Speed and memory of the writers, compared with other programs.",
        "",
        in_short(at, sizes, targets(at, sizes, names, middle, pixels)),
        "",
        *METHOD,
        "",
        f"{given['processor']}, {given['system']}. Python {given['Python']}, {packages}.",
        f"Load average while measuring: {min(loads):.1f} to {max(loads):.1f}.",
        "",
        "## Targets",
        "",
        *table(["", "target", "measured", ""], targets(at, sizes, names, middle, pixels)),
        *reasons(at, sizes[-2], sizes[-1], middle),
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
    lines += ["## Where the time goes", "", *where(at, sizes[-2]), *others(at, sizes, pixels)]
    return "\n".join(lines).rstrip() + "\n"


def in_short(at: Page, sizes: Sequence[int], lines: list[list[str]]) -> str:
    """How many targets are met, how fast LP and MPS are written, and what all formats take.
    lines: the table of targets.
    """
    size = sizes[-2]
    speeds = {
        suffix.upper(): found["bytes"] / 1e6 / found["seconds"]
        for suffix in ("lp", "mps")
        if (found := at("ours", size, suffix))
    }
    rates = " and ".join(f"{suffix} at {speed:.0f} MB/s" for suffix, speed in speeds.items())
    all_formats = at("everything", sizes[-1], "scalar", MILP, 1)
    took = f"{seconds(all_formats)} s" if all_formats else "a time that was not measured"
    return (
        f"{sum(line[3] == 'met' for line in lines)} of {len(lines)} [targets](#targets) are met. "
        f"At {size} x {size} pixels crossfield writes {rates or 'at a speed that was not measured'}. "
        f"All formats of the largest grid, {sizes[-1]} x {sizes[-1]}, take {took}."
    )


def reasons(at: Page, half: int, big: int, middle: int) -> list[str]:
    """The limits of the writers, in numbers of the same run."""
    lines = [linopy_reason(at, half), pyomo_reason(at, middle), growth_reason(at, half, big)]
    return [
        "Limits behind these numbers:",
        "",
        *filter(None, lines),
        "- One write computes nothing. SHA-256 works through a file from end to end in one thread,",
        "  and a file is closed after its last byte is hashed:",
        "",
        *table(
            ["file", "one write, s", "SHA-256 / one write", "half of our CPU seconds / one write"],
            [row for suffix in ("lp", "mps") for size in (half, big) for row in hashing(at, size, suffix)],
        ),
    ]


def pyomo_reason(at: Page, size: int) -> str:
    """Comparison of a small file with products and a larger one without."""
    mine, other = (at("ours", size, "lp", name) for name in ("qp-fixed", MILP))
    if not (mine and other):
        return ""
    small, large = (
        f"{found['bytes'] / 1e6:.1f} MB at {found['bytes'] / 1e6 / found['seconds']:.0f} MB/s"
        for found in (mine, other)
    )
    return (
        "- Pyomo, LP and MPS: fixed costs weigh more in small files, and products in objectives are sorted. "
        f"At {size} x {size}, the LP of `qp-fixed` is {small}, that of `{MILP}` {large}."
    )


def linopy_reason(at: Page, size: int) -> str:
    """Work that linopy does not do, and the least time of ours."""
    mine, theirs = at("ours", size), at("linopy", size)
    if not (mine and theirs):
        return ""
    return (
        "- linopy, LP: it receives arrays of column numbers, hashes nothing and writes numbered names: "
        f"{100 * theirs['bytes'] / mine['bytes']:.0f} % of our bytes. "
        f"A tenth of its time is {theirs['seconds'] / 10:.3f} s. "
        f"On two cores our {mine['cpu']:.3f} CPU seconds take at least {mine['cpu'] / 2:.3f} s."
    )


def hashing(at: Page, size: int, suffix: str) -> list[list[str]]:
    """A row with the time of hashing, and of our CPU seconds on two cores, relative to one write."""
    mine, hashed, written = at("ours", size, suffix), at("hashed", size, suffix), at("copied", size, suffix)
    if not (mine and hashed and written):
        return []
    ratios = (hashed["seconds"] / written["seconds"], mine["cpu"] / 2 / written["seconds"])
    name = f"{suffix.upper()} {size}"
    return [[name, f"{written['seconds']:.3f}", *(f"{ratio:.1f}" for ratio in ratios)]]


def growth_reason(at: Page, half: int, big: int) -> str:
    """The growth of the parts with size."""
    made = {
        s: at.ratio(at("rendered", big, s, MILP, ""), at("rendered", half, s, MILP, ""), "cpu")
        for s in ("lp", "mps", "nl")
    }
    gms = [at("copied", size, "gms", MILP, "scalar") for size in (big, half)]
    copies = {"lp": at.ratio(at("copied", big), at("copied", half)), "gms": at.ratio(*gms)}
    making, writing = (
        ", ".join(f"{suffix} {times(value)}" for suffix, value in found.items() if value)
        for found in (made, copies)
    )
    return (
        f"- Growth from {half} to {big}: CPU seconds for making the text grow {making} times. "
        f"Seconds for one write, which depend on the system, grow {writing} times."
    )


def times(value: float | None) -> str:
    """A ratio with significant digits."""
    return "" if value is None else f"{value:.1f}" if value < 10 else f"{value:.0f}"


def targets(
    at: Page, sizes: Sequence[int], names: Sequence[str], middle: int, pixels: int
) -> list[list[str]]:
    """The lines of the table of targets."""
    half, big = sizes[-2:]
    return [
        *(linopy_target(at, half, what) for what in WHAT),
        *(pyomo_target(at, names, middle, what) for what in WHAT),
        write_target(at, half, big),
        *everything_targets(at, big),
        *(growth_target(at, half, big, what) for what in ("seconds", "cpu", "memory")),
        *small_targets(at, min(24, big)),
        solution_target(at, pixels),
    ]


def target(what: str, values: dict[str, float | None], met: str, limit: float, unit: str = "") -> list[str]:
    """A line: what is measured, the target (a word of MET and a limit), the values known,
    and whether they meet it.
    """
    known = {name: value for name, value in values.items() if value is not None}
    text = ", ".join(f"{name} {value:.3g}{unit}".strip() for name, value in known.items())
    reached = bool(known) and all(MET[met](value, limit) for value in known.values())
    return [what, f"{met} {limit:g}{unit}", text or "not measured", "met" if reached else "not met"]


def linopy_target(at: Page, size: int, what: str) -> list[str]:
    """linopy over ours."""
    ratios = {s.upper(): at.ratio(at("linopy", size, s), at("ours", size, s), what) for s in ("lp", "mps")}
    return target(f"LP and MPS, {size} x {size}, linopy over ours ({WHAT[what]})", ratios, "at least", 10)


def pyomo_target(at: Page, names: Sequence[str], size: int, what: str) -> list[str]:
    """Pyomo over ours, at its smallest ratio."""
    ratios = {
        f"{name} {suffix}": at.ratio(*pair(at, name, suffix, size), what)
        for name in names
        for suffix in ("nl", "lp", "mps", "gms")
    }
    least = min(((value, name) for name, value in ratios.items() if value is not None), default=(None, ""))
    title = f"any formulation and format, {size} x {size}, Pyomo over ours ({WHAT[what]})"
    return target(title, {f"least ({least[1]})": least[0]}, "at least", 40)


def write_target(at: Page, half: int, big: int) -> list[str]:
    """Ours over one write of the same bytes."""
    ratios = {
        f"{s.upper()} {size}": at.ratio(at("ours", size, s), at("copied", size, s))
        for s in ("lp", "mps")
        for size in (half, big)
    }
    return target("ours over one write of the same bytes (seconds)", ratios, "at most", 3)


def everything_targets(at: Page, size: int) -> list[list[str]]:
    """All formats of the largest size: seconds and memory."""
    runs = {f"{jobs} at once": at("everything", size, "scalar", MILP, jobs) for jobs in (1, 2)}
    spent = {name: found and found["seconds"] for name, found in runs.items()}
    peak = {name: found and found["memory"] / 1e9 for name, found in runs.items()}
    return [
        target(f"{size} x {size}, all formats", spent, "under", 30, " s"),
        target("its peak memory", peak, "under", 2, " GB"),
    ]


def growth_target(at: Page, half: int, big: int, what: str) -> list[str]:
    """Ratio of times for four times the pixels."""
    grown = {
        s.upper(): at.ratio(at("ours", big, s, MILP, *rest), at("ours", half, s, MILP, *rest), what)
        for s, rest in (("lp", ()), ("mps", ()), ("nl", ("text",)), ("gms", ("scalar",)))
    }
    return target(f"growth of {WHAT.get(what, what)} from {half} to {big}", grown, "below", 4.4)


def small_targets(at: Page, size: int) -> list[list[str]]:
    """Targets of small tasks: one drawing in everything, and the help."""
    found = at("everything", size, "indexed", "all", 1)
    spent = {"": found and found["seconds"]}
    return [
        target(f"size {size}, all formulations in all formats", spent, "under", 2, " s"),
        target("`crossfield --help`", {"": at.document["help"]}, "under", 0.4, " s"),
    ]


def solution_target(at: Page, pixels: int) -> list[str]:
    """Reading a large solution back."""
    runs = {name: at("solution", pixels, suffix) for name, suffix in (("HiGHS", "highs"), ("AMPL", "ampl"))}
    spent = {name: found and found["seconds"] for name, found in runs.items()}
    title = f"a solution of {pixels} x {pixels} pixels (4 million columns at 552) to a field"
    return target(title, spent, "under", 4, " s")


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
    """Times of making, hashing and writing, and the sections of a file."""
    lines = [
        (
            f"`{MILP}`, {size} x {size}. CPU seconds for making the bytes, for their SHA-256, "
            "for one write of them, and for the whole."
        ),
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
        "By section, in file order. The first sections include SymPy, about 10 ms per family at every size.",
        "",
    ]
    return lines + table(["", "section", "seconds", "MB", "MB/s"], rows)


def others(at: Page, sizes: Sequence[int], pixels: int) -> list[str]:
    """All formats at the two largest sizes, and other tasks that users wait for."""
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
        "## Other tasks",
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
