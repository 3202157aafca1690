"""Results of programs on files that break the rules of docs/format-rules.md (`docs/make.py traps`).

Each file has a few lines and one trap; the optimum that a program finds shows how it read the file.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

Answer = float | str
REFUSED: Final = "refused"
WRONG: Final = " (wrong)"
SECONDS: Final = 60
RESULTS: Final = Path(__file__).parent / "format-rules" / "traps.csv"


@dataclass(frozen=True)
class Trap:
    """A file: the rule it breaks (or keeps, when `good`), its subject, text and intended optimum."""

    rule: str
    what: str
    name: str
    text: str
    meant: Answer
    good: bool = False


def lp(
    rule: str, what: str, objective: str, row: str, meant: Answer, *, rest: str = "", good: bool = False
) -> Trap:
    """An LP with one row."""
    text = f"Minimize\n obj: {objective}\nSubject To\n c: {row}\n{rest}End\n"
    return Trap(rule, what, "model.lp", text, meant, good)


def mps(rule: str, what: str, meant: Answer, *, good: bool = False, **sections: str) -> Trap:
    """An MPS with the row c, one column x of cost 1 unless another section is given."""
    parts = {
        "HEAD": "",
        "ROWS": " G c\n",
        "COLUMNS": COST,
        "RHS": " RHS1 c 1\n",
        "BOUNDS": "",
        "TAIL": "",
    } | sections
    bounds = f"BOUNDS\n{parts['BOUNDS']}" if parts["BOUNDS"] else ""
    text = (
        f"NAME model FREE\n{parts['HEAD']}ROWS\n N obj\n{parts['ROWS']}COLUMNS\n{parts['COLUMNS']}"
        f"RHS\n{parts['RHS']}{bounds}{parts['TAIL']}ENDATA\n"
    )
    return Trap(rule, what, "model.mps", text, meant, good)


COST: Final = " x obj 1\n x c 1\n"
WHOLE: Final = " M1 'MARKER' 'INTORG'\n x obj -1\n x c 1\n M2 'MARKER' 'INTEND'\n"
UP_TO_5: Final = {"ROWS": " L c\n", "RHS": " RHS1 c 5\n"}
FIXED: Final = {
    "COLUMNS": " x c 1\n y c 1\n", "RHS": " RHS1 c 0\n", "BOUNDS": " FX BND1 x 1\n FX BND1 y 1\n",
}  # fmt: skip
"""x = y = 1, so that the objective is the sum of what was read of Q."""
ONE_TRIANGLE: Final = " x x 2\n x y 1\n y y 2\n"

TRAPS: Final = (
    lp("W2", "constant as the cost of a fixed column", "x + 7 ONE", "x >= 1", 8.0,
       rest="Bounds\n 1 <= ONE <= 1\n", good=True),
    lp("L1", "x + 7", "x + 7", "x >= 1", 8.0),
    lp("L2", "7 + x", "7 + x", "x >= 1", 8.0),
    lp("L3", "x + 5 <= 10, maximise x", "- x", "x + 5 <= 10", -5.0),
    lp("L4", "x <= 10 + z, z <= 1, maximise x", "- x", "x <= 10 + z", -11.0,
       rest="Bounds\n 0 <= z <= 1\n"),
    lp("L5", "Integers, maximise x, x <= 3.5", "- x", "x <= 3.5", -3.0, rest="Integers\n x\n"),
    lp("L6", "bounds after Generals, maximise x, x <= 2.5", "- x", "x <= 9", -2.0,
       rest="Generals\n x\nBounds\n 0 <= x <= 2.5\n"),
    lp("L9", "[ x^2 ] at x = 2", "[ x^2 ]", "x >= 2", 4.0),
    lp("L13", "-1 <= x <= 5", "x", "-1 <= x <= 5", 0.0),
    lp("L14", "x + x at x = 1", "x + x", "x >= 1", 2.0),
    lp("L17", "x <= -3 alone", "x", "x + y >= -9", "infeasible", rest="Bounds\n x <= -3\n"),
    lp("L18", "=>", "x", "x => 1", 1.0),
    lp("L20", "x + -3 y", "x + -3 y", "x >= 1", -2.0, rest="Bounds\n 0 <= y <= 1\n"),
    lp("L22", "-inf <= x", "x", "x >= -4", -4.0, rest="Bounds\n -inf <= x <= 5\n", good=True),
    lp("L22", "-infinity <= x", "x", "x >= -4", -4.0, rest="Bounds\n -infinity <= x <= 5\n"),
    lp("L34", "[ x ^2 ] / 2 at x = 2", "[ x ^2 ] / 2", "x >= 2", 2.0, good=True),
    lp("L34", "[ x ^ 2 ] / 2 at x = 2", "[ x ^ 2 ] / 2", "x >= 2", 2.0),
    mps("M1", "an integer without bounds, maximise x", -1.0, COLUMNS=WHOLE, **UP_TO_5),
    mps("M2", "an integer with LO 0 alone, maximise x, x <= 5", -5.0, COLUMNS=WHOLE,
        BOUNDS=" LO BND1 x 0\n", **UP_TO_5),
    mps("M3", "UP -3 alone, x >= -9", -9.0, RHS=" RHS1 c -9\n", BOUNDS=" UP BND1 x -3\n"),
    mps("M4", "right side 7 of the objective, at x = 1", -6.0, RHS=" RHS1 c 1\n RHS1 obj 7\n"),
    mps("M5", "OBJSENSE MAX, x <= 5", 5.0, HEAD="OBJSENSE MAX\n", **UP_TO_5),
    mps("M5", "OBJSENSE MAXIMIZE, x <= 5", 5.0, HEAD="OBJSENSE MAXIMIZE\n", **UP_TO_5),
    mps("M6", "OBJSENSE and MAX in two lines", 5.0, HEAD="OBJSENSE\n    MAX\n", **UP_TO_5),
    mps("M7", "cost 1 and cost 3, at x = 1", REFUSED, COLUMNS=f"{COST} x obj 3\n"),
    mps("M8", "the set of right sides is named like the row", 1.0, RHS=" c c 1\n"),
    mps("M9", "no set name", REFUSED, RHS=" c 1\n"),
    mps("M13", "QUADOBJ, one triangle", 3.0, TAIL=f"QUADOBJ\n{ONE_TRIANGLE}", good=True, **FIXED),
    mps("M13", "QUADOBJ, both triangles", REFUSED, TAIL=f"QUADOBJ\n{ONE_TRIANGLE} y x 1\n", **FIXED),
    mps("M14", "QMATRIX, one triangle", REFUSED, TAIL=f"QMATRIX\n{ONE_TRIANGLE}", **FIXED),
    mps("M15", "QSECTION", 3.0, TAIL=f"QSECTION obj\n{ONE_TRIANGLE}", **FIXED),
    mps("M25", "BV, then UP 5, maximise x", REFUSED, COLUMNS=" x obj -1\n x c 1\n",
        BOUNDS=" BV BND1 x\n UP BND1 x 5\n", **UP_TO_5),
)  # fmt: skip
"""`meant` is a human reader's interpretation of the file; `refused` for files without a clear meaning."""


def highs(path: Path) -> Answer:
    """HiGHS's optimum."""
    import highspy

    model: Any = highspy.Highs()
    model.setOptionValue("output_flag", "false")
    if model.readModel(str(path)) == highspy.HighsStatus.kError:
        return REFUSED
    model.run()
    status = model.modelStatusToString(model.getModelStatus())
    return float(model.getInfo().objective_function_value) if status == "Optimal" else status.lower()


def gurobi(path: Path) -> Answer:
    """Gurobi's optimum."""
    import gurobipy

    with gurobipy.Env(empty=True) as environment:
        environment.setParam("OutputFlag", 0)
        environment.start()
        try:
            model = gurobipy.read(str(path), environment)
        except gurobipy.GurobiError:
            return REFUSED
        model.optimize()
        return float(model.ObjVal) if model.Status == gurobipy.GRB.OPTIMAL else "infeasible"


def cplex(path: Path) -> Answer:
    """CPLEX's optimum."""
    import cplex

    model = cplex.Cplex()
    for silence in (
        model.set_log_stream,
        model.set_error_stream,
        model.set_warning_stream,
        model.set_results_stream,
    ):
        silence(None)
    try:
        model.read(str(path))
    except cplex.exceptions.CplexError:
        return REFUSED
    model.solve()
    solution = model.solution
    return (
        float(solution.get_objective_value()) if "optimal" in solution.get_status_string() else "infeasible"
    )


def xpress(path: Path) -> Answer:
    """Xpress's optimum."""
    import xpress

    model = xpress.problem()
    model.controls.outputlog = 0
    try:
        model.readProb(str(path))
    except xpress.SolverError:
        return REFUSED
    model.optimize()
    attributes = model.attributes
    return float(attributes.objval) if attributes.solstatus == xpress.SolStatus.OPTIMAL else "infeasible"


def scip(path: Path) -> Answer:
    """SCIP's optimum."""
    from pyscipopt import Model

    model = Model()
    model.hideOutput()
    try:
        model.readProblem(str(path))
    except OSError:
        return REFUSED
    model.optimize()
    return float(model.getObjVal()) if model.getStatus() == "optimal" else str(model.getStatus())


def glpk(path: Path) -> Answer:
    """GLPK's optimum."""
    report = path.with_suffix(".txt")
    kind = "--lp" if path.suffix == ".lp" else "--freemps"
    run_program("glpsol", kind, str(path), "-o", str(report))
    text = report.read_text() if report.exists() else ""
    match = re.search(r"Objective:.*= *(\S+)", text)
    return REFUSED if match is None else float(match[1]) if "OPTIMAL" in text else "infeasible"


def cbc(path: Path) -> Answer:
    """CBC's optimum."""
    report = path.with_suffix(".txt")
    run_program("cbc", str(path), "solve", "solution", str(report))
    text = report.read_text() if report.exists() else ""
    match = re.match(r"Optimal - objective value (\S+)", text)
    return REFUSED if not text else float(match[1]) if match else "infeasible"


def run_program(*words: str) -> None:
    """Run a program without its output."""
    command = [shutil.which(words[0]) or words[0], *words[1:]]
    subprocess.run(command, capture_output=True, check=False, timeout=SECONDS)


PROGRAMS: Final[dict[str, tuple[str, Callable[[Path], Answer]]]] = {
    "HiGHS": ("highspy", highs), "Gurobi": ("gurobipy", gurobi), "CPLEX": ("cplex", cplex),
    "Xpress": ("xpress", xpress), "SCIP": ("pyscipopt", scip), "GLPK": ("glpsol", glpk), "CBC": ("cbc", cbc),
}  # fmt: skip
"""Title -> its Python package or executable, and the function for its optimum."""


def installed_programs() -> list[str]:
    """The programs that are installed."""
    return [title for title, (needs, _) in PROGRAMS.items() if shutil.which(needs) or find_spec(needs)]


def answer(title: str, trap: Trap) -> Answer:
    """Result of a program on a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / trap.name
        path.write_text(trap.text)
        return PROGRAMS[title][1](path)


def result_cell(value: Answer, trap: Trap) -> str:
    """A cell: wrong where the program neither refuses nor finds the intended optimum."""
    text = f"{value:g}" if isinstance(value, float) else value
    return text if value in {REFUSED, trap.meant} else f"{text}{WRONG}"


def meant_cell(trap: Trap) -> str:
    """The intended optimum, as a cell."""
    return f"{trap.meant:g}" if isinstance(trap.meant, float) else trap.meant.replace(REFUSED, "unclear")


def table() -> list[list[str]]:
    """Heads and rows: rule, file, intended optimum, and the result of each program."""
    titles = installed_programs()
    rows = [
        [trap.rule, trap.what, meant_cell(trap)]
        + [result_cell(answer(title, trap), trap) for title in titles]
        for trap in TRAPS
    ]
    return [["rule", "file", "meant", *titles], *rows]


def summary(heads: list[str], *rows: list[str]) -> tuple[tuple[str, ...], list[list[str]]]:
    """Heads and rows: numbers of files that each program reads as intended, refuses, and reads wrongly."""
    counts = []
    for column, title in enumerate(heads[3:], 3):
        cells = [row[column] for row in rows]
        wrong = sum(cell.endswith(WRONG) for cell in cells)
        refused = cells.count(REFUSED)
        counts.append([title, str(len(cells) - wrong - refused), str(refused), str(wrong)])
    return ("program", "as meant", "refused", "wrong"), counts
