"""What programs call the end of a search, in the words and codes of each layout, and what it claims."""

import json

from answers import ERROR, FEASIBLE, GLOBAL, IN_GAP, INFEASIBLE, LIMIT, LOCAL, NOTHING, SILENT, UNBOUNDED
from crossfield.export.solutions.readers.registry import parse_raw
from loops import for_each
from places import SOLUTIONS


def highs(words, primal="Feasible"):
    return f"Model status\n{words}\n\n# Primal solution values\n{primal}\nObjective 1\n# Columns 1\na 1\n"


def ampl(message="done", tail="objno 0 0\n", values=(1.5, -2)):
    numbers = [3, 1, 1, 0, 2, 0, 2, len(values), *values]
    return "\n".join(map(str, [message, "", "Options", *numbers])) + f"\n{tail}"


def gurobi(code, point=True):
    columns = {"Vars": [{"VarName": "x", "X": 2}, {"VarName": "y"}]} if point else {}
    return json.dumps({"SolutionInfo": {"Status": code, "ObjVal": 3}, **columns})


def scip(words, point=True):
    return f"solution status: {words}\n" + (
        "objective value: 3\nx 3 \t(obj:1)\n" if point else "no solution available\n"
    )


def cbc(words, point=True):
    return f"{words} - objective value {'3.0' if point else '1e+50'}\n" + "      0 x    3   0\n" * point


def glpk(letters):
    kind, *states = letters.split()
    line = {"mip": "2.5", "ipt": "2.5 7", "bas": "b 2.5 7"}[kind]
    return f"s {kind} 1 1 {' '.join(states)} -3\ni 1 {line}\nj 1 {line}\ne o f\n"


def real(file, old, new):
    """A function that puts words into a file of a real solver."""

    def text(words):
        data = (SOLUTIONS / "tiny" / file).read_text()
        assert old in data
        return data.replace(old, new.format(words), 1)

    return text


def gams(states):
    model, solver = states.split()
    old = "model_status,2\nsolver_status,1"
    new = f"model_status,{model}\nsolver_status,{solver}"
    return real("gams-54.6.1_conopt_qp_optimal.csv", old, new)("")


def document(words):
    return json.dumps({"status": words, "objective": 3.5, "bound": 3, "variables": {"x": 2}})


LAYOUTS = {
    "highs": (highs, set()),
    "highs without a point": (lambda words: highs(words, "Infeasible"), set()),
    "ampl": (lambda code: ampl(tail=f"objno 0 {code}\n"), set()),
    "ampl without a point": (lambda code: ampl(tail=f"objno 0 {code}\n", values=()), set()),
    "ampl message": (ampl, set()),
    "gurobi": (gurobi, {INFEASIBLE, UNBOUNDED}),
    "gurobi without a point": (lambda code: gurobi(code, point=False), set()),
    "cplex": (real("cplex-22.2.0.1_qp_optimal.sol", 'Value="1"', 'Value="{}"'), {INFEASIBLE, UNBOUNDED}),
    "scip": (scip, set()),
    "scip without a point": (lambda words: scip(words, point=False), set()),
    "cbc": (cbc, {INFEASIBLE, UNBOUNDED, NOTHING}),
    "cbc without a point": (lambda words: cbc(words, point=False), set()),
    "glpk": (glpk, {INFEASIBLE, UNBOUNDED}),
    "gams": (gams, {INFEASIBLE, UNBOUNDED, NOTHING, ERROR}),
    "gams listing": (
        real("gams-by-layout_milp_optimal.lst", "MODEL STATUS      1", "MODEL STATUS {:>6}"),
        {INFEASIBLE, UNBOUNDED, NOTHING},
    ),
    "pulp": (
        real("pulp-3.3.2_milp_optimal.json", '"sol_status": 1', '"sol_status": {}'),
        {INFEASIBLE, UNBOUNDED, SILENT},
    ),
    "symphony": (real("symphony-5.6.17_milp_optimal.txt", "Optimal Solution Found", "{}"), set()),
    "cplex display": (real("cplex-by-layout_milp_display.txt", "Integer optimal solution", "{}"), set()),
    "document": (document, {INFEASIBLE, UNBOUNDED}),
    "comment": (lambda words: f"# Status: {words}\nx 1\n", {INFEASIBLE, UNBOUNDED}),
    "other comment": (lambda words: f"# Solution status = {words}\nx 1\n", set()),
}
"""A text with the words, and the statuses for which its values are no point, of each layout."""

STATUSES = {
    "highs": {
        "Optimal": IN_GAP, "Solution limit reached": LIMIT, "Infeasible": INFEASIBLE, "Solve error": ERROR,
        "Words of a later version": ERROR,
    },
    "highs without a point": {"Optimal": ERROR, "Interrupted by user": NOTHING, "Infeasible": INFEASIBLE},
    "ampl": {
        0: LOCAL, 99: LOCAL, 100: FEASIBLE, 199: FEASIBLE, 200: INFEASIBLE, 299: INFEASIBLE, 300: UNBOUNDED,
        399: UNBOUNDED, 400: LIMIT, 449: LIMIT, 450: LIMIT, 470: NOTHING, 499: NOTHING, 500: ERROR, -1: ERROR,
    },
    "ampl without a point": {
        100: ERROR, 199: ERROR, 200: INFEASIBLE, 300: UNBOUNDED, 400: NOTHING, 450: NOTHING, 470: NOTHING,
        500: ERROR, -1: ERROR,
    },
    "ampl message": {
        "optimal solution found": GLOBAL, "Ipopt 3.14.16: Optimal Solution Found": LOCAL,
        "\nbonmin: Optimal": LOCAL, "\n couenne: Optimal": LOCAL,
        "Knitro 13: Locally optimal or satisfactory solution.": LOCAL,
        "BARON 24.1: 1 iterations, optimal within tolerances.\nObjective 3": IN_GAP,
        "CPLEX 22.1: locally optimal solution; optimal target 2": LOCAL,
        "Gurobi 11.0.0: optimal solution; objective 4": IN_GAP, "Gurobi 11.0.0: solved; objective 4": LOCAL,
        "": LOCAL,
    },
    "gurobi": {
        2: IN_GAP, 13: FEASIBLE, 18: LOCAL, 3: INFEASIBLE, 4: INFEASIBLE, 5: UNBOUNDED, 1: ERROR, 12: ERROR,
        14: ERROR, 20: ERROR, **dict.fromkeys([6, 7, 8, 9, 10, 11, 15, 16, 17, 19], LIMIT),
    },
    "gurobi without a point": {3: INFEASIBLE, 5: UNBOUNDED, 9: NOTHING, 12: ERROR, 13: ERROR},
    "cplex": {
        **dict.fromkeys([1, 101, 129], GLOBAL), **dict.fromkeys([102, 130], IN_GAP), 24: LOCAL,
        **dict.fromkeys([5, 127], FEASIBLE), **dict.fromkeys([3, 4, 103, 119], INFEASIBLE),
        **dict.fromkeys([2, 118], UNBOUNDED), **dict.fromkeys([104, 107, 113, 131, 11], LIMIT),
        **dict.fromkeys([108, 114], NOTHING), **dict.fromkeys([14, 301, 9999999], ERROR),
    },
    "scip": {
        "optimal solution found": GLOBAL, "gap limit reached": IN_GAP, "node limit reached": LIMIT,
        "user interrupt": LIMIT, "infeasible": INFEASIBLE, "infeasible or unbounded": INFEASIBLE,
        "unbounded": UNBOUNDED, "unknown": FEASIBLE, "words of a later version": ERROR,
    },
    "scip without a point": {
        "optimal solution found": ERROR, "node limit reached": NOTHING, "infeasible": INFEASIBLE,
        "unbounded": UNBOUNDED, "unknown": SILENT, "words of a later version": ERROR,
    },
    "cbc": {
        "Optimal": IN_GAP, "Optimal (within gap tolerance)": IN_GAP, "Infeasible": INFEASIBLE,
        "Integer infeasible": INFEASIBLE, "Unbounded": UNBOUNDED, "Stopped on time": LIMIT,
        "Stopped on iterations": LIMIT, "Stopped on difficulties": ERROR, "Status unknown": ERROR,
        "Stopped on time (no integer solution - continuous used)": NOTHING,
    },
    "cbc without a point": {"Stopped on time": NOTHING, "Stopped on nodes": NOTHING, "Optimal": ERROR},
    "glpk": {
        "mip o": GLOBAL, "mip f": LIMIT, "mip i": NOTHING, "mip n": INFEASIBLE, "mip u": NOTHING,
        "ipt o": GLOBAL, "ipt u": NOTHING, "bas f f": GLOBAL, "bas f u": LIMIT, "bas n u": INFEASIBLE,
        "bas f n": UNBOUNDED, "bas u u": NOTHING, "bas i f": NOTHING,
    },
    "gams": {
        "1 1": IN_GAP, "2 1": LOCAL, "3 1": UNBOUNDED, "4 1": INFEASIBLE, "5 1": NOTHING, "6 3": NOTHING,
        "7 1": FEASIBLE, "7 2": LIMIT, "8 3": LIMIT, "8 1": IN_GAP, "10 1": INFEASIBLE, "13 10": ERROR,
        "14 3": NOTHING, "14 7": ERROR, "19 1": INFEASIBLE, "99 1": ERROR,
    },
    "gams listing": {
        1: IN_GAP, 2: LOCAL, 8: IN_GAP, 10: INFEASIBLE, 4: INFEASIBLE, 3: UNBOUNDED, 14: NOTHING,
    },
    "pulp": {1: IN_GAP, 2: FEASIBLE, 0: SILENT, -1: INFEASIBLE, -2: UNBOUNDED},
    "symphony": {
        "Time Limit Reached": LIMIT, "Optimal Solution Found": GLOBAL, "Target Gap Achieved": IN_GAP,
        "Stopping After Finding First Feasible Solution": FEASIBLE,
    },
    "cplex display": {
        "Integer optimal, tolerance (0.0001/1e-06)": IN_GAP, "Integer optimal solution": GLOBAL,
        "Aborted, integer feasible": LIMIT, "Time limit exceeded, integer feasible": LIMIT,
    },
    "document": {
        "optimal": LOCAL, "feasible": FEASIBLE, "infeasible": INFEASIBLE, "unbounded": UNBOUNDED,
        "maxTimeLimit": LIMIT, "globallyOptimal": IN_GAP, "Optimal": LOCAL, "words of a tool": FEASIBLE,
    },
    "comment": {
        "Optimal": LOCAL, "optimal solution": LOCAL, "Infeasible": INFEASIBLE, "locally optimal": LOCAL,
        "Time limit reached": LIMIT, "unbounded": UNBOUNDED, "whatever": FEASIBLE,
    },
    "other comment": {"Optimal": LOCAL, "Infeasible": INFEASIBLE},
}  # fmt: skip


@for_each("layout", STATUSES)
def test_words_and_codes_are_statuses(layout):
    text, pointless = LAYOUTS[layout]
    has_no_point = "without a point" in layout and "highs" not in layout
    for words, status in STATUSES[layout].items():
        raw = parse_raw(text(words).encode())
        assert (raw.status, words) == (status, words)
        assert raw.has_point == (status not in pointless and not has_no_point), words
        if isinstance(words, str) and layout not in {"glpk", "gams", "symphony", "cplex display"}:
            assert raw.message == " ".join(words.split())
        if not raw.has_point:
            assert (raw.objective, raw.values.size) == (None, 0)


def test_infeasible_or_unbounded_is_believed_from_its_words_alone():
    for message, status in (("infeasible or unbounded", INFEASIBLE), ("user interrupt", NOTHING)):
        assert parse_raw(ampl(message, "objno 0 450\n", ()).encode()).status == status


def test_a_stopped_simplex_claims_a_point_only_when_it_is_feasible():
    data = LAYOUTS["cplex"][0](11).replace('primalFeasible="1"', 'primalFeasible="0"')
    raw = parse_raw(data.encode())
    assert (raw.status, raw.has_point) == (NOTHING, True)


def test_an_infeasible_problem_in_a_log_of_cplex():
    words = b"MIP - Integer infeasible.\nCurrent MIP best bound is infinite.\n"
    assert parse_raw(b"CPLEX> optimize\n" + words).status == INFEASIBLE


def test_a_document_states_objective_and_bound_of_a_point_only():
    for words in STATUSES["document"]:
        raw = parse_raw(document(words).encode())
        facts = (3.5, 3) if raw.has_point else (None, None)
        assert (raw.objective, raw.bound) == facts
