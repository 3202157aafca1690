"""Solution files of real solvers for two small instances: what each claims, and their problems."""

import struct
from functools import cache
from importlib.metadata import version

import crossfield as cf
import highspy
import numpy as np
import places

HERE = places.SOLUTIONS
TINY = HERE / "tiny"
GOOD = sorted(path for path in TINY.iterdir() if path.is_file())
BAD = sorted((TINY / "bad").iterdir())
OTHERS = sorted(HERE.glob("*.sol"))
"""Files of HiGHS and of AMPL's solvers for problems that are not ours."""
HIGHS_STATES_BOUNDS = tuple(map(int, version("highspy").split(".")[:2])) >= (1, 16)
"""Whether its solution files state the dual bound."""
WITH_POINT = {"optimal-global", "optimal-in-gap", "optimal-local", "feasible", "limit-with-point"}

G, C, S, B, K, X = "gurobi-13.0.3", "cplex-22.2.0.1", "scip-10.0", "cbc-2.10.8", "glpk-5.0", "xpress-9.9.1"
A, R = "gams-54.6.1", "baron-26.5.27"
L, Y, Q = "lp_solve-5.5.2.5", "symphony-5.6.17", "qsopt_ex-2.5.10.3"
GLOBAL, LOCAL, FEASIBLE, INFEASIBLE = "optimal-global", "optimal-local", "feasible", "infeasible"
IN_GAP = "optimal-in-gap"
LIMIT, NOTHING, UNBOUNDED, ERROR = "limit-with-point", "limit-without-point", "unbounded", "error"
SILENT = "no-point"

FILES = {
    f"{G}_milp_optimal.sol": ("gurobi", FEASIBLE),
    f"{G}_qp_optimal.sol": ("gurobi", FEASIBLE),
    f"{G}_quartic_optimal.sol": ("gurobi", FEASIBLE),
    f"{G}_milp_optimal.json": ("gurobi-json", IN_GAP),
    f"{G}_milp_pool.json": ("gurobi-json", IN_GAP),
    f"{G}_qp_optimal.json": ("gurobi-json", IN_GAP),
    f"{G}_quartic_optimal.json": ("gurobi-json", IN_GAP),
    f"{G}_milp_infeasible.json": ("gurobi-json", INFEASIBLE),
    f"{G}_milp_time_without_point.json": ("gurobi-json", NOTHING),
    f"{G}_milp_nodes_with_point.json": ("gurobi-json", LIMIT),
    f"{C}_milp_optimal.sol": ("cplex", GLOBAL),
    f"{C}_milp_optimal_nonzero.sol": ("cplex", GLOBAL),
    f"{C}_milp_within_tolerance.sol": ("cplex", IN_GAP),
    f"{C}_milp_pool.sol": ("cplex", LIMIT),
    f"{C}_qp_optimal.sol": ("cplex", GLOBAL),
    f"{C}_milp_infeasible.sol": ("cplex", INFEASIBLE),
    f"{C}_milp_time_with_point.sol": ("cplex", LIMIT),
    f"{C}_milp_solution_limit.sol": ("cplex", LIMIT),
    f"{C}_other_unbounded.sol": ("cplex", UNBOUNDED),
    f"{S}_milp_optimal.sol": ("scip", GLOBAL),
    f"{S}_qp_optimal.sol": ("scip", GLOBAL),
    f"{S}_quartic_nl_without_status.sol": ("scip", FEASIBLE),
    f"{S}_milp_zeros_without_status.sol": ("scip", FEASIBLE),
    f"{S}_milp_infeasible.sol": ("scip", INFEASIBLE),
    f"{S}_milp_infeasible_without_status.sol": ("scip", SILENT),
    f"{S}_milp_time_with_point.sol": ("scip", LIMIT),
    f"{S}_milp_time_without_point.sol": ("scip", NOTHING),
    f"{S}_milp_solution_limit.sol": ("scip", LIMIT),
    f"{S}_other_infinite.sol": ("scip", FEASIBLE),
    f"{B}_milp_optimal.sol": ("cbc", IN_GAP),
    f"{B}_milp_optimal_all.sol": ("cbc", IN_GAP),
    f"{B}_milp_infeasible.sol": ("cbc", INFEASIBLE),
    f"{B}_milp_infeasible_all.sol": ("cbc", INFEASIBLE),
    f"{B}_milp_solution_limit.sol": ("cbc", LIMIT),
    f"{B}_milp_time_without_point.sol": ("cbc", NOTHING),
    f"{K}_milp_optimal_lp.sol": ("glpk", GLOBAL),
    f"{K}_milp_optimal_mps.sol": ("glpk", GLOBAL),
    f"{K}_milp_infeasible.sol": ("glpk", INFEASIBLE),
    f"{K}_milp_time_without_point.sol": ("glpk", NOTHING),
    f"{K}_milp_relaxed_bas.sol": ("glpk", GLOBAL),
    f"{K}_milp_relaxed_ipt.sol": ("glpk", GLOBAL),
    f"{X}_milp_optimal.slx": ("xpress-slx", FEASIBLE),
    f"{X}_qp_optimal.slx": ("xpress-slx", FEASIBLE),
    f"{X}_milp_time_without_point.slx": ("xpress-slx", FEASIBLE),
    f"{X}_milp_infeasible.slx": ("xpress-slx", SILENT),
    "xpress-by-layout_milp_two_solutions.slx": ("xpress-slx", FEASIBLE),
    f"{A}_cplex_milp_optimal.csv": ("gams-csv", IN_GAP),
    f"{A}_conopt_qp_optimal.csv": ("gams-csv", LOCAL),
    f"{A}_baron_quartic_optimal.csv": ("gams-csv", IN_GAP),
    f"{A}_sbb_quartic_optimal.csv": ("gams-csv", IN_GAP),
    f"{A}_baron_quartic_time_with_point.csv": ("gams-csv", LIMIT),
    f"{A}_cplex_milp_time_without_point.csv": ("gams-csv", NOTHING),
    f"{A}_cplex_milp_infeasible.csv": ("gams-csv", INFEASIBLE),
    f"{R}_qp_optimal_res.lst": ("baron-res", IN_GAP),
    f"{R}_pair_optimal_res.lst": ("baron-res", IN_GAP),
    f"{R}_pair_first_point_res.lst": ("baron-res", FEASIBLE),
    f"{R}_pair_iterations_with_point_res.lst": ("baron-res", LIMIT),
    f"{R}_qp_infeasible_res.lst": ("baron-res", INFEASIBLE),
    f"{R}_other_unbounded_res.lst": ("baron-res", UNBOUNDED),
    f"{R}_other_iterations_without_point_res.lst": ("baron-res", NOTHING),
    f"{G}_milp_optimal.attr": ("gurobi-attr", FEASIBLE),
    f"{X}_milp_optimal.asc": ("xpress-asc", FEASIBLE),
    "mip-2.0.0_milp_optimal.sol": ("python-mip", FEASIBLE),
    "copt-8.0.7_milp_optimal.sol": ("gurobi", FEASIBLE),
    "cuopt-by-layout_milp_optimal.sol": ("cuopt", LOCAL),
    "cuopt-by-layout_milp_infeasible.sol": ("cuopt", INFEASIBLE),
    f"{L}_milp_optimal.txt": ("lp_solve", FEASIBLE),
    f"{L}_milp_infeasible.txt": ("lp_solve", INFEASIBLE),
    f"{Y}_milp_optimal.txt": ("symphony", GLOBAL),
    f"{Y}_milp_infeasible.txt": ("symphony", INFEASIBLE),
    f"{Y}_milp_time_without_point.txt": ("symphony", NOTHING),
    f"{Q}_milp_optimal_fixed.sol": ("qsopt_ex", GLOBAL),
    f"{Q}_milp_relaxed.sol": ("qsopt_ex", GLOBAL),
    f"{Q}_milp_infeasible.sol": ("qsopt_ex", INFEASIBLE),
    "mosek-by-layout_milp_optimal.int": ("mosek", IN_GAP),
    "gams-by-layout_milp_optimal.lst": ("gams-listing", IN_GAP),
    "gams-by-layout_milp_display.txt": ("gams-display", FEASIBLE),
    "ampl-by-layout_milp_display.txt": ("ampl-display", FEASIBLE),
    "cplex-by-layout_milp_display.txt": ("cplex-display", GLOBAL),
    "pulp-3.3.2_milp_optimal.json": ("json", IN_GAP),
    "pulp-3.3.2_milp_infeasible.json": ("json", INFEASIBLE),
    "pulp-3.3.2_milp_optimal_prints.txt": ("pairs", FEASIBLE),
    "pyomo-6.10.1_milp_optimal.json": ("json", LOCAL),
    "pyomo-6.10.1_milp_optimal.yml": ("pyomo", LOCAL),
    "pyomo-6.10.1_milp_infeasible.yml": ("pyomo", INFEASIBLE),
    "python-3.11.7_milp_optimal.json": ("json", FEASIBLE),
    "python-3.11.7_milp_optimal_nested.json": ("json", LOCAL),
    "python-3.11.7_milp_optimal_colon.txt": ("pairs", FEASIBLE),
    "pandas-3.1.1_milp_optimal.csv": ("pairs", FEASIBLE),
    "pandas-3.1.1_milp_optimal_quoted.csv": ("pairs", FEASIBLE),
    "pandas-3.1.1_milp_optimal_semicolon.csv": ("pairs-semicolon", FEASIBLE),
    "miplib-by-layout_milp_optimal.sol": ("miplib", FEASIBLE),
    "miplib-by-layout_milp_infeasible.sol": ("miplib", INFEASIBLE),
    # Answers in other text: logs, prints and mails.
    "highs-1.15.1_milp_optimal_log.txt": ("highs", IN_GAP),
    f"{S}_milp_optimal_log.txt": ("scip", FEASIBLE),
    f"{B}_milp_optimal_log.txt": ("cbc", IN_GAP),
    f"{K}_milp_optimal_log.txt": ("glpk", GLOBAL),
    "neos-by-layout_milp_optimal_scip.txt": ("scip", FEASIBLE),
    "neos-by-layout_milp_optimal_ampl.txt": ("ampl-display", FEASIBLE),
    "mail-by-layout_milp_list.txt": ("list-in-text", FEASIBLE),
}
"""Every file of the folder: its reader and what it claims."""

PROVEN = {
    *(f"{G}_{kind}.json" for kind in ("milp_optimal", "milp_pool", "qp_optimal", "quartic_optimal")),
    *(f"{R}_{kind}_optimal_res.lst" for kind in ("qp", "pair")),
    "pyomo-6.10.1_milp_optimal.json", "pyomo-6.10.1_milp_optimal.yml",
}  # fmt: skip
"""Files that state the bound or the gap of their optimum, or are of a problem without a gap."""

RELAXATIONS = {"milp_time_without_point", "milp_relaxed"}
"""Files that hold the point of a relaxation, as the solver writes it."""

ROUNDED = {f"{L}_milp_optimal", "gams-by-layout_milp_optimal", "cplex-by-layout_milp_display"}
"""Files whose program rounds values to so few digits that their points are feasible to 1e-4 only."""

OPTIMA = {
    "milp": 0.5565360828459345,
    "qp": 8.8679297733801,
    "quartic": 0.183341329995846,
    "pair": 0.000162736965904,
}
"""Found by several solvers alike; that of the MILP and the QP by HiGHS in the first place."""


@cache
def problem(name):
    """The problems behind the files: 2 x 2 pixels with three strokes, and a pair of pixels."""
    if name == "pair":
        pair = cf.Instance.on_pixels(
            "pair", np.ones((1, 2), bool), np.array([[0, 0], [0, 1]]), np.array([0.2, 1.2]),
            np.array([1.0, 0.75]), stroke_coefficient=1.5, skew_coefficient=1e-3, gauge="strokes",
        )  # fmt: skip
        return cf.formulate(pair, "minlp-quartic")
    tiny = cf.Instance.on_pixels(
        "tiny", np.ones((2, 2), bool), np.array([[0, 0], [0, 1], [1, 1]]), np.array([0.2, 1.6, 2.6]),
        np.array([1.0, 0.75, 0.5]), stroke_coefficient=1.5, skew_coefficient=1e-3, gauge="strokes",
    )  # fmt: skip
    formulation = {"milp": "milp-mccormick", "qp": "qp-fixed", "quartic": "minlp-quartic"}[name]
    return cf.formulate(tiny, formulation, p=np.array([0, 0, -1, 0]) if name == "qp" else None)


def problem_of(path):
    """The problem that a file is of, named after its solver, in GAMS after that of GAMS's solver."""
    words = path.stem.split("_")
    return next((word for word in words if word in OPTIMA), None)


def listed(raw):
    """Entries of a file: values by name, or by place."""
    names = range(len(raw.values)) if raw.names is None else raw.names.tolist()
    return dict(zip(names, raw.values.tolist(), strict=True))


def by_highs(model, answer, gap=0.0, style=0, **options):
    """Let HiGHS answer a model file."""
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.readModel(str(model))
    for name, value in {"mip_rel_gap": gap, "threads": 1, **options}.items():
        highs.setOptionValue(name, value)
    highs.run()
    highs.writeSolution(str(answer), style)
    return answer


def binary_sol(message, of, point):
    """An AMPL solution file in binary form, as the AMPL Solver Library writes it."""
    options = b"Options" + struct.pack("<8i", 3, 1, 1, 0, of.n_rows, 0, of.n_columns, of.n_columns)
    records = (b"binary", message, b"", options, b"", point.astype("<f8").tobytes(), struct.pack("<2i", 0, 0))
    return b"".join(
        struct.pack("<i", len(record)) + record + struct.pack("<i", len(record)) for record in records
    )
