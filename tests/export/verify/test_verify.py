"""Every installed program reads and solves our files; wrong files, crashes and hangs are noticed."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cases import SKEWED, make_field, make_instance
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import FORMATS, problem_in_format
from crossfield.export.solutions.solution import Solution
from crossfield.export.solvers_table import PROGRAMS, SOLVERS, suitability
from crossfield.export.solving.local import SolveFiles, Solvers
from crossfield.export.statuses import Status
from crossfield.export.verify.checks import Verdict, Verification
from crossfield.export.verify.verify import (
    _energy_difference,
    _judge_answer,
    _subjects,
    is_same_optimum,
    random_field,
    verify,
)
from crossfield.models.errors import CrossfieldError, InputError
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.problem import Problem, formulate
from crossfield.models.instance.instance import Instance
from crossfield.models.processes.deadline import Deadline
from crossfield.models.processes.limits import Limits
from crossfield.models.samples.samples import sample
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


def each_of(programs: Iterable[str]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("program", [pytest.param(name, marks=needing(name)) for name in programs])


def on_grid(height: int, width: int, name: str = "small", seed: int = 4) -> Instance:
    rng = np.random.default_rng(seed)
    pixels = np.argwhere(np.ones((height, width), bool))[: max(1, 2 * height * width // 3)]
    theta, w = rng.uniform(0, np.pi, len(pixels)), rng.uniform(0.1, 1, len(pixels))
    return Instance.on_pixels(name, np.ones((height, width), bool), pixels, theta, w, skew_coefficient=1e-3)


INSTANCES: dict[str, Callable[[], Instance]] = {
    "1 x 3": lambda: on_grid(1, 3),
    "a sample": lambda: sample("skew", 5),
}
RELAXED = "1 x 3, relaxed"
LARGER = [name if name == "1 x 3" else pytest.param(name, marks=pytest.mark.slow) for name in INSTANCES]
PROVEN = ("miqcp-bilinear-l1", "miqp-mccormick", "milp-mccormick", "qp-fixed", "miqp-exact")
"""Formulations that every solver that takes them proves at once."""


@pytest.fixture(scope="session")
def verified(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Verification]:
    """The verification of all files of an instance, solves included, by name of the instance."""
    done: dict[str, Verification] = {}

    def verification(name: str) -> Verification:
        if name not in done:
            folder, instance = tmp_path_factory.mktemp("export"), INSTANCES[name.removesuffix(", relaxed")]()
            write_all(
                instance, folder, start=make_field(instance), options={"relax": name == RELAXED or None}
            )
            done[name] = verify(folder, seconds=SECONDS)
        return done[name]

    return verification


@pytest.mark.slow
@pytest.mark.parametrize("instance", LARGER)
@each_of(PROGRAMS)
def test_every_file_means_the_problem(verified: Callable[[str], Verification], program: str, instance: str):
    """Each file of the program's formats is read and agrees, or is refused for a reason of the table."""
    entry, verification = PROGRAMS[program], verified(instance)
    read = {f.file: f.verdict for f in verification.checks if f.program == program and f.step == "read"}
    files = [path.name for path in verification.folder.iterdir() if path.suffix[1:] in entry.formats]
    assert sorted(read) == sorted(files)
    refused = {name for name in files if refuses(verification.folder / name, program)}
    assert {name for name, verdict in read.items() if verdict == Verdict.REFUSED} == refused
    assert {verdict for name, verdict in read.items() if name not in refused} == {Verdict.AGREES}


def refuses(path: Path, solver: str) -> bool:
    problem = read_manifest(path.with_suffix(".manifest.json")).problem()
    held = problem_in_format(problem, FORMATS[path.suffix[1:]])
    return solver in SOLVERS and SOLVERS[solver].refusal(held, "read") is not None


@pytest.mark.slow
@pytest.mark.parametrize("instance", LARGER)
@each_solver
def test_the_optima_of_all_solvers_agree(verified: Callable[[str], Verification], solver: str, instance: str):
    solves = [f for f in verified(instance).checks if f.program == solver and f.step == "solve"]
    assert solves
    assert {f.verdict for f in solves} <= {Verdict.AGREES, Verdict.LIMIT, Verdict.REFUSED, Verdict.NOT_TRIED}
    assert all(f.reason for f in solves if f.verdict != Verdict.AGREES)
    for check in (f for f in solves if f.verdict == Verdict.AGREES):
        others = [f for f in verified(instance).checks if f.group == check.group and f.proven]
        assert all(is_same_optimum(check.objective, other.objective) for other in others)


@pytest.mark.slow
def test_every_solver_proves_what_it_takes_of_two_pixels(tmp_path: Path):
    """No time limit comes near: convex problems, or linear ones with products of binaries, of two pixels."""
    write_all(on_grid(1, 2), tmp_path, formulations=PROVEN, start=make_field(on_grid(1, 2)))
    solves = [f for f in verify(tmp_path, seconds=250).checks if f.step == "solve"]
    assert {f.verdict for f in solves} <= {Verdict.AGREES, Verdict.REFUSED, Verdict.NOT_TRIED}
    present = {name for name, solver in SOLVERS.items() if not solver.missing}
    assert {f.program for f in solves if f.verdict == Verdict.AGREES} == present


def test_a_point_may_save_only_what_the_rows_it_breaks_are_worth(tmp_path: Path):
    """Slacks of weighted deviations, each reduced by a solver's tolerance for its row: the same field."""
    problem = formulate(sample("skew", 4), "milp-mccormick")
    write_all(problem.instance, tmp_path, formulations=["milp-mccormick"])
    subjects, _ = _subjects([read_manifest(next(tmp_path.glob("*.manifest.json")))], tmp_path)
    index, cost = problem.merged_objective(1)
    for less, verdict in ((0.0, Verdict.AGREES), (4e-6, Verdict.AGREES), (1e-4, Verdict.DIFFERS)):
        point = problem.point(random_field(problem, 1))
        point[index[cost > 0, 0]] -= less
        answer = Solution(problem, point, Status.OPTIMAL_GLOBAL, "", "test", identified=True)
        check = _judge_answer(subjects[0], "highs", answer)
        assert check.verdict == verdict, (less, check.reason)
        assert check.objective <= check.energy <= check.objective + check.leeway + 1e-9
    assert _energy_difference(problem, 1.0, 1.2, 0.1, proven=False)
    assert not _energy_difference(problem, 1.0, 1.05, 0.1, proven=False)


@pytest.mark.slow
def test_packed_files_with_options_are_read(tmp_path: Path):
    """Printed facet, box, 1-norms, binary .nl, scalar GAMS, .gz."""
    instance = make_instance("hole", "box")
    chosen = {"facet": "printed", "stroke_norm": 1, "beta_norm": 1}
    names = ["miqp-mccormick", "milp-mccormick", "miqcp-bilinear"]
    dialects = {"nl": "binary"}
    write_all(
        instance, tmp_path / "options", formulations=names, options=chosen, dialects=dialects, compress=True
    )
    verification = verify(tmp_path / "options")
    assert verification.failed_checks == []
    assert {f.program for f in verification.checks if f.verdict == Verdict.AGREES} >= {"highs", "casadi"}


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
def spoiled(tmp_path_factory: pytest.TempPathFactory) -> Verification:
    """The verification of a folder in which every file has one thing wrong, with manifests that match."""
    folder = tmp_path_factory.mktemp("spoiled")
    for name, (formulation, kind, pattern, replacement) in WRONG.items():
        instance = replace(on_grid(2, 3), name=name)
        (manifest,) = write_all(instance, folder, formulations=[formulation], formats=[kind])
        path = folder / f"{name}.{formulation}.{kind}"
        text = path.read_text()
        wrong = re.sub(
            pattern, replacement, text, count=0 if name in {"name", "whole"} else 1, flags=re.MULTILINE
        )
        assert wrong != text, name
        forge(manifest.path, path, wrong.encode())
    return verify(folder)


def forge(manifest: Path, path: Path, data: bytes) -> None:
    """Change a file and its entry in the manifest."""
    import hashlib

    old = hashlib.sha256(path.read_bytes()).hexdigest()
    path.write_bytes(data)
    manifest.write_text(manifest.read_text().replace(old, hashlib.sha256(data).hexdigest()))


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.slow
def test_a_wrong_file_is_noticed_by_every_program(spoiled: Verification, name: str):
    formulation, kind, *_ = WRONG[name]
    checks = {f.program: f for f in spoiled.checks if f.problem == f"{name} {formulation}"}
    expected = {entry.name for entry in PROGRAMS.values() if kind in entry.formats and not entry.missing}
    assert set(checks) == expected
    blind = blind_to(name)
    for program, check in checks.items():
        if check.verdict == Verdict.REFUSED or program in blind:
            continue
        bad = {Verdict.DIFFERS, Verdict.FAILED} | ({Verdict.NOT_TRIED} if program == "cbc" else set())
        assert check.verdict in bad, (
            program,
            check,
        )  # CBC's export may leave out what its presolve removes
        assert check.reason


def blind_to(name: str) -> set[str]:
    """Programs that report too few digits to notice: CBC exports some ten."""
    return {"cost": {"cbc"}}.get(name, set())


def test_a_file_that_is_not_the_manifests_is_not_tried(tmp_path: Path):
    write_all(on_grid(1, 2), tmp_path, formulations=["qp-fixed"], formats=["lp", "mps"])
    path = tmp_path / "small.qp-fixed.lp"
    path.write_bytes(path.read_bytes() + b"\n")
    (tmp_path / "small.qp-fixed.mps").unlink()
    verification = verify(tmp_path, programs=["highs"])
    assert [f.file for f in verification.failed_checks] == ["small.qp-fixed.lp", "small.qp-fixed.mps"]
    assert all("export again" in f.reason for f in verification.checks)
    assert not verification.is_ok


@needing("scip")
def test_a_crash_is_a_row_of_the_table(tmp_path: Path):
    """An understated count of nonlinear variables crashes SCIP's process; the next file is still read."""
    for name in ("crash", "well"):
        write_all(
            replace(on_grid(2, 3), name=name), tmp_path, formulations=["miqcp-bilinear"], formats=["nl"]
        )
    path = tmp_path / "crash.miqcp-bilinear.nl"
    lines = path.read_text().splitlines(keepends=True)
    lines[4] = " 0 0 0\n"
    forge(tmp_path / "crash.miqcp-bilinear.manifest.json", path, "".join(lines).encode())
    checks = {f.problem.split()[0]: f for f in verify(tmp_path, programs=["scip"]).checks}
    assert checks["crash"].verdict in {Verdict.FAILED, Verdict.DIFFERS}
    assert checks["well"].verdict == Verdict.AGREES


def test_absent_programs_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_all(on_grid(1, 2), tmp_path, formulations=["qp-fixed"], formats=["lp"])
    monkeypatch.setitem(PROGRAMS, "xpress", replace(PROGRAMS["xpress"], needs="no_such_package"))
    verification = verify(tmp_path, programs=["highs", "xpress"])
    assert verification.absent == {"xpress": "Xpress is not installed; pip install xpress"}
    assert {f.program for f in verification.checks} == {"highs"}
    assert verification.is_ok


@pytest.mark.slow
def test_the_command_reports_what_differs(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    write_all(on_grid(1, 2), tmp_path, formulations=["qp-fixed"], formats=["lp"])
    assert invoke(["verify", str(tmp_path), "--solve", "10", "-p", "highs", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"] is True
    assert invoke(["verify", str(tmp_path), "-p", "highs"]) == 0
    assert "verify.json" in capsys.readouterr().out
    path = tmp_path / "small.qp-fixed.lp"
    forge(
        tmp_path / "small.qp-fixed.manifest.json",
        path,
        path.read_bytes().replace(b"<= +1.5", b"<= 1.6").replace(b"<= 1.57", b"<= 1.58"),
    )
    assert invoke(["verify", str(tmp_path), "-p", "highs", "-q"]) == 1
    assert "small.qp-fixed.lp: highs: differs: upper" in capsys.readouterr().err
    assert invoke(["verify", str(tmp_path), "-p", "nobody"]) == 1
    assert invoke(["verify", str(tmp_path / "absent")]) == 1


def test_a_folder_without_manifests_is_an_error(tmp_path: Path):
    with pytest.raises(InputError, match="crossfield export"):
        verify(tmp_path)


@needing("xpress")
def test_an_answer_of_xpress_that_was_cut_short_has_all_columns(tmp_path: Path):
    problem = formulate(sample("skew", 5), "minlp-quartic")
    with Solvers() as solvers:
        solution = solvers.solve(problem, "xpress", folder=tmp_path, limits=Limits(1.0, threads=1))
    assert solution.point is None or len(solution.point) == solution.problem.n_columns


# the table of capabilities is true


@pytest.fixture(scope="session")
def solvers() -> Iterator[Solvers]:
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
def test_claims_of_the_table_of_solvers_are_true(
    verified: Callable[[str], Verification],
    solvers: Solvers,
    tmp_path: Path,
    solver: str,
    kind: str,
    name: str,
):
    """A solver that takes a problem is not contradicted; others refuse the file or prove no optimum."""
    verification = verified("1 x 3" if kind == "whole" else RELAXED)
    problem = read_manifest(verification.folder / f"small.{name}.manifest.json").problem()
    taking = suitability(problem, solver)
    solves = [f for f in verification.checks if f.problem == f"small {name}" and f.step == "solve"]
    mine = [f for f in solves if f.program == solver]
    if taking.answer == "yes":
        assert {f.verdict for f in mine} & {Verdict.AGREES, Verdict.LIMIT, Verdict.NOT_TRIED}
    elif taking.answer == "no" and (path := verification.folder / f"small.{name}.{taking.format}").exists():
        optimum = min(f.objective for f in solves if f.objective is not None)
        shutil.copytree(verification.folder, tmp_path, dirs_exist_ok=True)
        assert not proves(
            solvers, problem_in_format(problem, FORMATS[taking.format]), tmp_path / path.name, solver, optimum
        )


def proves(solvers: Solvers, held: Problem, path: Path, solver: str, optimum: float) -> bool:
    """Whether the solver, run all the same, returns the optimum with that status."""
    files, limits = SolveFiles.for_model(path, solver), Limits(1.0, 0.0, 1)
    try:
        solution = solvers.solve_file(held, solver, files, limits, Deadline.after(21.0), precise=True)
    except CrossfieldError:
        return False
    return (
        solution.claimed.startswith("optimal")
        and solution.reported is not None
        and is_same_optimum(solution.reported, optimum)
    )
