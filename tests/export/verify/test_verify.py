"""Every installed program reads and solves our files; wrong files, crashes and hangs are noticed."""

import hashlib
import json
import re
import shutil
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from cases import SKEWED, make_field
from command_line import invoke
from crossfield.export.formats.registry import FORMATS, problem_in_format
from crossfield.export.solutions.solution import Solution
from crossfield.export.solvers_table import PROGRAMS, SOLVERS, suitability
from crossfield.export.solving.local import SolveFiles, Solvers
from crossfield.export.statuses import Status
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import _judge_answer, _subjects, is_same_optimum, random_field, verify
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.processes.deadline import Deadline
from loops import for_each

pytestmark = pytest.mark.oracles

SECONDS = 0.3
needing = pytest.mark.needs
each_solver = pytest.mark.parametrize(
    "solver",
    [
        pytest.param(name, marks=[needing(solver.program), *([needing(name)] if solver.package else [])])
        for name, solver in SOLVERS.items()
    ],
)


def on_grid(height, width, name="small", seed=4):
    rng = np.random.default_rng(seed)
    pixels = np.argwhere(np.ones((height, width), bool))[: max(1, 2 * height * width // 3)]
    theta, w = rng.uniform(0, np.pi, len(pixels)), rng.uniform(0.1, 1, len(pixels))
    return cf.Instance.on_pixels(
        name, np.ones((height, width), bool), pixels, theta, w, skew_coefficient=1e-3
    )


@pytest.fixture(scope="session")
def verified(tmp_path_factory):
    """The verification of all files of three pixels, solves included, whole and relaxed."""
    done = {}
    for kind in ("whole", "relaxed"):
        folder, instance = tmp_path_factory.mktemp(kind), on_grid(1, 3)
        options = {"relax": kind == "relaxed" or None}
        cf.write_all(instance, folder, start=make_field(instance), options=options)
        done[kind] = verify(folder, seconds=SECONDS)
        assert done[kind].failed_checks == []
    return done


@pytest.mark.slow
def test_every_solver_proves_what_it_takes_of_two_pixels(tmp_path):
    """No time limit comes near: convex problems, or linear ones with products of binaries, of two pixels."""
    proven = ("miqcp-bilinear-l1", "miqp-mccormick", "milp-mccormick", "qp-fixed", "miqp-exact")
    cf.write_all(on_grid(1, 2), tmp_path, formulations=proven, start=make_field(on_grid(1, 2)))
    solves = [f for f in verify(tmp_path, seconds=250).checks if f.step == "solve"]
    assert {f.verdict for f in solves} <= {Verdict.AGREES, Verdict.REFUSED, Verdict.NOT_TRIED}
    present = {name for name, solver in SOLVERS.items() if not solver.missing}
    assert {f.program for f in solves if f.verdict == Verdict.AGREES} == present


def test_a_point_may_save_only_what_the_rows_it_breaks_are_worth(tmp_path):
    """Slacks of weighted deviations, each reduced by a solver's tolerance for its row: the same field."""
    problem = cf.formulate(cf.sample("skew", 4), "milp-mccormick")
    cf.write_all(problem.instance, tmp_path, formulations=["milp-mccormick"])
    subjects, _ = _subjects([cf.read_manifest(next(tmp_path.glob("*.manifest.json")))], tmp_path)
    index, cost = problem.merged_objective(1)
    for less, verdict in ((0.0, Verdict.AGREES), (4e-6, Verdict.AGREES), (1e-4, Verdict.DIFFERS)):
        point = problem.point(random_field(problem, 1))
        energy = problem.objective_value(point)
        point[index[cost > 0, 0]] -= less
        answer = Solution(problem, point, Status.OPTIMAL_GLOBAL, "", "test", identified=True)
        check = _judge_answer(subjects[0], "highs", answer)
        assert check.verdict == verdict, (less, check.reason)
        assert check.objective <= check.attained == pytest.approx(energy)


# what is wrong is noticed

WRONG = {
    "bound": ("milp-mccormick", "mps", r" UP BND1 alpha_00_00 \S+", " UP BND1 alpha_00_00 1.5"),
    "cost": ("milp-mccormick", "mps", r" s_00_00_r obj 2", " s_00_00_r obj 2.0000000001"),
    "whole": ("milp-mccormick", "mps", r" MARKER\d+ 'MARKER' 'INT\w+'\n", ""),
    "sense": ("milp-mccormick", "lp", r"(c14_00_00_r:.*) >= ", r"\1 <= "),
    "sign": ("milp-mccormick", "lp", r"(c15_00_00_r:.* )\+ 1 alpha", r"\1- 1 alpha"),
    "name": ("milp-mccormick", "lp", r"\bz_00_00_r\b", "zz_00_00_r"),
    "half": ("miqp-exact", "lp", r"4 d_00_00_r \^2", "2 d_00_00_r ^2"),
    "constant": ("miqp-exact", "lp", r"obj(\w*): \+ \S+ ONE", r"obj\1: + 1 ONE"),
    "double": ("miqp-exact", "mps", r" d_00_00_r d_00_00_r 4", " d_00_00_r d_00_00_r 8"),
    "product": (
        "miqcp-bilinear", "mps", r"(QCMATRIX c16_00_00_r\n \S+ \S+ )1\n( \S+ \S+ )1\n", r"\g<1>2\n\g<2>2\n"
    ),
    "number": ("minlp-quartic", "nl", r"\nn1\.5707963267948966\n", "\nn1.571\n"),
    "limit": ("miqp-exact", "nl", r"\nr\n4 0\n", "\nr\n4 1\n"),
    "groups": ("milp-mccormick", "nl", r"^((?:.*\n){6}) (\d+) (\d+) 0 0 0\n", r"\1 0 0 0 0 0\n"),
    "square": ("minlp-cubic", "gms", r"\+ 2\*", "+ 2.001*"),
    "greater": ("miqp-exact", "gms", r"=l=", "=g="),
}  # fmt: skip
"""Changes of a file: formulation, format, old and new text (once, or everywhere for a name)."""


@pytest.fixture(scope="session")
def spoiled(tmp_path_factory):
    """The verification of a folder in which every file has one thing wrong, with manifests that match."""
    folder = tmp_path_factory.mktemp("spoiled")
    for name, (formulation, kind, pattern, replacement) in WRONG.items():
        instance = replace(on_grid(2, 3), name=name)
        (manifest,) = cf.write_all(instance, folder, formulations=[formulation], formats=[kind])
        path = folder / f"{name}.{formulation}.{kind}"
        text = path.read_text()
        wrong = re.sub(
            pattern, replacement, text, count=0 if name in {"name", "whole"} else 1, flags=re.MULTILINE
        )
        assert wrong != text, name
        forge(manifest.path, path, wrong.encode())
    return verify(folder)


def forge(manifest, path, data):
    """Change a file and its entry in the manifest."""
    old = hashlib.sha256(path.read_bytes()).hexdigest()
    path.write_bytes(data)
    manifest.write_text(manifest.read_text().replace(old, hashlib.sha256(data).hexdigest()))


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.slow
def test_a_wrong_file_is_noticed_by_every_program(spoiled, name):
    formulation, kind, *_ = WRONG[name]
    checks = {f.program: f for f in spoiled.checks if f.problem == f"{name} {formulation}"}
    expected = {entry.name for entry in PROGRAMS.values() if kind in entry.formats and not entry.missing}
    assert set(checks) == expected
    # CBC exports some ten digits, and may leave out what its presolve removes.
    checks.pop("cbc" if name == "cost" else "", None)
    for program, check in checks.items():
        allowed = {Verdict.DIFFERS, Verdict.FAILED, Verdict.REFUSED}
        assert check.verdict in allowed | ({Verdict.NOT_TRIED} if program == "cbc" else set()), (
            program,
            check,
        )
        assert check.reason


def test_files_that_are_not_the_manifests_and_absent_programs_are_named(tmp_path, monkeypatch):
    with pytest.raises(cf.InputError, match="crossfield export"):
        verify(tmp_path)
    cf.write_all(on_grid(1, 2), tmp_path, formulations=["qp-fixed"], formats=["lp", "mps"])
    monkeypatch.setitem(PROGRAMS, "xpress", replace(PROGRAMS["xpress"], needs="no_such_package"))
    verification = verify(tmp_path, programs=["highs", "xpress"])
    assert verification.absent == {"xpress": "Xpress is not installed; pip install xpress"}
    assert {f.program for f in verification.checks} == {"highs"}
    assert verification.is_ok
    path = tmp_path / "small.qp-fixed.lp"
    path.write_bytes(path.read_bytes() + b"\n")
    (tmp_path / "small.qp-fixed.mps").unlink()
    verification = verify(tmp_path, programs=["highs"])
    assert [f.file for f in verification.failed_checks] == ["small.qp-fixed.lp", "small.qp-fixed.mps"]
    assert all("export again" in f.reason for f in verification.checks)
    assert not verification.is_ok


@needing("scip")
def test_a_crash_is_a_row_of_the_table(tmp_path):
    """An understated count of nonlinear variables crashes SCIP's process; the next file is still read."""
    for name in ("crash", "well"):
        cf.write_all(
            replace(on_grid(2, 3), name=name), tmp_path, formulations=["miqcp-bilinear"], formats=["nl"]
        )
    path = tmp_path / "crash.miqcp-bilinear.nl"
    lines = path.read_text().splitlines(keepends=True)
    lines[4] = " 0 0 0\n"
    forge(tmp_path / "crash.miqcp-bilinear.manifest.json", path, "".join(lines).encode())
    checks = {f.problem.split()[0]: f for f in verify(tmp_path, programs=["scip"]).checks}
    assert checks["crash"].verdict in {Verdict.FAILED, Verdict.DIFFERS}
    assert checks["well"].verdict == Verdict.AGREES


@pytest.mark.slow
def test_the_command_reports_what_differs(tmp_path, capsys):
    cf.write_all(on_grid(1, 2), tmp_path, formulations=["qp-fixed"], formats=["lp"])
    assert invoke(["verify", str(tmp_path), "--solve", "10", "-p", "highs", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"] is True
    assert invoke(["verify", str(tmp_path), "-p", "highs"]) == 0
    assert "verify.json" in capsys.readouterr().out
    path = tmp_path / "small.qp-fixed.lp"
    wrong = path.read_bytes().replace(b"<= +1.5", b"<= 1.6").replace(b"<= 1.57", b"<= 1.58")
    forge(tmp_path / "small.qp-fixed.manifest.json", path, wrong)
    assert invoke(["verify", str(tmp_path), "-p", "highs"]) == 1
    words = "small.qp-fixed.lp: highs: differs: columns at alpha_00_01 have (0.0, 1.58"
    assert words in capsys.readouterr().err
    assert invoke(["verify", str(tmp_path), "-p", "nobody"]) == 1
    assert invoke(["verify", str(tmp_path / "absent")]) == 1


# the table of capabilities is true


@pytest.fixture(scope="session")
def solvers():
    """Solvers, with a child process for each program in use."""
    with Solvers() as running:
        yield running


CLAIMS = [
    (kind, name)
    for kind in ("whole", "relaxed")
    for name in SKEWED
    if kind == "whole" or "relax" in FORMULATIONS[name].option_names
]


@pytest.mark.slow
@each_solver
@for_each("kind, name", CLAIMS)
def test_claims_of_the_table_of_solvers_are_true(verified, solvers, tmp_path, solver, kind, name):
    """A solver that takes a problem is not contradicted; others refuse the file or prove no optimum."""
    verification = verified[kind]
    problem = cf.read_manifest(verification.folder / f"small.{name}.manifest.json").problem()
    taking = suitability(problem, solver)
    solves = [f for f in verification.checks if f.problem == f"small {name}" and f.step == "solve"]
    mine = [f for f in solves if f.program == solver]
    if taking.answer == "yes":
        assert {f.verdict for f in mine} & {Verdict.AGREES, Verdict.LIMIT, Verdict.NOT_TRIED}
    elif taking.answer == "no" and (path := verification.folder / f"small.{name}.{taking.format}").exists():
        optimum = min(f.objective for f in solves if f.objective is not None)
        shutil.copytree(verification.folder, tmp_path, dirs_exist_ok=True)
        held, files = problem_in_format(problem, FORMATS[taking.format]), tmp_path / path.name
        assert not proves(solvers, held, SolveFiles.for_model(files, solver), solver, optimum)


def proves(solvers, held, files, solver, optimum):
    """Whether the solver, run all the same, returns the optimum with that status."""
    limits, deadline = cf.Limits(1.0, 0.0, 1), Deadline.after(21.0)
    try:
        answer = solvers.solve_file(held, solver, files, limits, deadline, precise=True)
    except cf.CrossfieldError:
        return False
    is_known = answer.reported is not None and is_same_optimum(answer.reported, optimum)
    return answer.claimed.startswith("optimal") and is_known
