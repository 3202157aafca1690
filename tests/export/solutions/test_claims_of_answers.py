"""Claims are checked against their points: relaxations, damaged files, codes of failure, foreign values."""

import codecs
import inspect
import json
import re
import struct
import subprocess

import crossfield as cf
import highspy
import numpy as np
import pytest
from answers import FILES, GOOD, TINY, WITH_POINT, problem, problem_of
from cases import make_field, make_instance
from crossfield.export.cli.app import invoke, read_command
from crossfield.export.formats.registry import write
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.export.solutions.readers.registry import parse_raw, read_raw
from crossfield.export.solutions.solution import AGREEMENT, LARGEST, TOLERANCE, Solution, read_solution
from crossfield.export.statuses import Status
from crossfield.export.writing.nl_order import NlOrder
from crossfield.models.errors import InstanceError, SolutionError
from crossfield.models.formulations.problem import formulate

MILP = "milp-mccormick"


@pytest.fixture(scope="module")
def skew(tmp_path_factory):
    """A folder with the MILP of a sample in LP, MPS and as an AMPL model, its instance and manifest."""
    folder = tmp_path_factory.mktemp("skew")
    formats = ["--format", "lp", "--format", "mps", "--format", "mod"]
    weights = ["--stroke-weight", "0.17", "--skew-weight", "2.8e-8"]
    instance = str(folder / "skew.json")
    assert invoke(["instance", "skew", "--size", "4", *weights, "-o", instance]) == 0
    assert invoke(["export", instance, "-f", MILP, *formats, "-o", str(folder), "--quiet"]) == 0
    return folder


@pytest.fixture
def reading(skew, tmp_path, capsys):
    """Run `read` on a file: exit code, facts, complaint, and whether a field was written."""

    def run(solution, *options):
        output = tmp_path / "field.npz"
        output.unlink(missing_ok=True)
        manifest = skew / f"skew.{MILP}.manifest.json"
        arguments = ["read", str(solution), "--manifest", str(manifest), "-o", str(output), "--json"]
        code = invoke([*arguments, *options])
        out, err = capsys.readouterr()
        assert "internal error" not in err
        assert err.count("\n") <= 1
        return code, json.loads(out) if out else {}, err, output.exists()

    return run


def relaxed_by_highs(skew, path):
    model = highspy.Highs()
    model.setOptionValue("output_flag", False)
    model.readModel(str(skew / f"skew.{MILP}.mps"))
    model.setOptionValue("solve_relaxation", True)
    model.run()
    model.writeSolution(str(path), 0)
    return path


def by_names(problem, values):
    """A plain list of names and values."""
    from cases import names_of
    from crossfield.models.formulations.names import column_names

    pairs = zip(names_of(column_names(problem.instance, problem.blocks)), map(float, values), strict=True)
    return "".join(f"{name} {value!r}\n" for name, value in pairs)


@pytest.fixture(scope="module")
def milp():
    field = make_field(make_instance("full"))
    formulated = formulate(field.instance, MILP)
    return formulated, formulated.point(field)


# claims against the point


def test_the_answer_of_a_relaxation_is_not_passed_on(skew, reading, tmp_path):
    assert inspect.signature(read_command).parameters["tolerance"].default == TOLERANCE
    path = relaxed_by_highs(skew, tmp_path / "relaxed.sol")
    assert read_raw(path).status == "optimal-in-gap"
    code, facts, complaint, written = reading(path)
    assert (code, written) == (1, False)
    assert (facts["status"], facts["claimed"]) == ("unknown", "optimal-in-gap")
    assert facts["worst_violation"] > 0.3
    assert re.search(
        r"relaxed\.sol: claims optimal-in-gap, but its point breaks integrality by 0\.3", complaint
    )
    assert "--tolerance" not in complaint
    code, facts, complaint, written = reading(path, "--tolerance", "0.5")
    assert (code, written, complaint) == (0, True, "")
    assert (facts["status"], facts["contradictions"]) == ("feasible", [])
    assert facts["claims"] == "not kept (optimal-in-gap): the point is feasible only within 0.5"


@pytest.mark.needs("glpk")
def test_glpk_answers_relaxations_and_models_in_its_own_order(skew, reading, tmp_path):
    relaxed, whole = tmp_path / "relaxed.sol", tmp_path / "whole.sol"
    stem = f"skew.{MILP}"
    of_lp = ["--lp", f"{stem}.lp", "--nomip", "-w", relaxed]
    of_mod = ["-m", f"{stem}.mod", "-d", f"{stem}.dat", "-w", whole]
    for arguments in (of_lp, of_mod):
        subprocess.run(["glpsol", *map(str, arguments)], cwd=skew, check=True, capture_output=True)
    code, facts, _, written = reading(relaxed)
    assert (code, facts["status"], written) == (1, "unknown", False)
    code, facts, complaint, written = reading(whole)
    assert (code, complaint, written) == (0, "", True)
    assert (facts["status"], facts["claimed"]) == ("feasible", "optimal-global")
    assert facts["claims"].endswith("the file is of an unidentified problem")
    assert facts["worst_violation"] < 1e-9
    assert facts["objective_of_field"] == pytest.approx(facts["objective_recomputed"], abs=1e-8)
    assert facts["objective_recomputed"] == pytest.approx(facts["objective_reported"], abs=1e-9)


@pytest.mark.needs("glpk")
def test_the_columns_of_a_model_have_glpks_order_also_with_pixels_apart(tmp_path):
    """`parts` has a pixel without neighbours: without a stroke, its alpha is not a column of GLPK's."""
    for number, shape in enumerate(("parts", "hole", "pixel")):
        problem = formulate(make_instance(shape), MILP)
        write(problem, tmp_path / f"{number}.mod")
        command = ["glpsol", "-m", f"{number}.mod", "-d", f"{number}.dat", "-w", "answer"]
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
        solution = read_solution(tmp_path / "answer", problem, identified=True)
        assert (solution.status, solution.contradictions) == ("optimal-global", ())


def test_claims_fall_to_objective_bound_and_violation(milp):
    problem, point = milp
    objective = problem.objective_value(point)

    def of(claimed=Status.OPTIMAL_GLOBAL, at=point, **claims):
        facts = {"identified": True, **claims}
        return Solution(problem, at, claimed, "", "by hand", **facts)

    assert of(reported=objective, claimed_bound=objective).status == "optimal-global"
    near = of(reported=objective * (1 + 0.5 * AGREEMENT), claimed_bound=objective * (1 - 1e-4))
    assert (near.status, near.bound, near.caveat) == ("optimal-global", objective * (1 - 1e-4), "")
    stopped = of(reported=objective, claimed_bound=0.6 * objective)
    assert (stopped.status, stopped.bound) == ("limit-with-point", 0.6 * objective)
    assert stopped.gap == pytest.approx(0.4)
    assert "leaves a gap" in stopped.caveat
    (why,) = of(reported=objective + 0.01).contradictions
    assert why.startswith("it states the objective")
    contradicted = of(claimed_bound=objective + 0.01)
    (why,) = contradicted.contradictions
    assert why.startswith("the dual bound")
    assert (contradicted.bound, contradicted.gap) == (None, None)
    assert of(reported=np.inf).status == of(reported=np.nan).status == "unknown"
    off = point.copy()
    off[problem.blocks["beta"].offset] += 3e-4
    assert of(at=off).status == "unknown"
    loose = of(at=off, claimed_bound=0.0, tolerance=1e-3)
    assert (loose.status, loose.bound, loose.gap, loose.doubt) == ("feasible", None, None, "")
    assert loose.caveat.endswith("feasible only within 0.001")
    assert of(at=off, reported=objective + 0.01, tolerance=10.0).status == "unknown"
    assert of(at=off, tolerance=10.0, claimed_bound=problem.objective_value(off) + 1).status == "unknown"
    stranger = of(claimed_bound=0.0, identified=False)
    assert (stranger.status, stranger.bound, stranger.gap, stranger.doubt) == ("feasible", None, None, "")
    assert stranger.caveat.endswith("the file is of an unidentified problem")
    assert of(Status.INFEASIBLE).contradictions == ("its point is feasible",)
    assert of(Status.INFEASIBLE, at=off).status == "infeasible"
    assert of(Status.INFEASIBLE, at=None).status == of(Status.INFEASIBLE, at=off).status == "infeasible"
    assert of(Status.INFEASIBLE, at=None, identified=False).status == "unknown"
    assert of(Status.LIMIT_WITHOUT_POINT, at=None, identified=False).status == "no-point"
    for silent in (Status.ERROR, Status.LIMIT_WITHOUT_POINT, Status.NO_POINT):
        assert of(silent).status == of(silent, reported=objective).status == "feasible"
        assert of(silent, reported=objective + 0.01).status != "feasible"
        assert not of(silent, at=off).status.needs_point


def test_a_point_that_breaks_rows_a_little_has_the_objective_of_its_field_beside(milp):
    """Slacks lowered by a solver's tolerance save an objective that no field has."""
    problem, point = milp
    index, cost = problem.merged_objective(1)
    lowered = point.copy()
    lowered[index[cost > 0, 0]] -= 1e-6
    answer = Solution(problem, lowered, Status.OPTIMAL_GLOBAL, "", "by hand", identified=True)
    assert answer.status == "optimal-global"
    assert answer.objective < problem.objective_value(point) - 1e-5
    assert answer.objective_of_field == pytest.approx(problem.objective_value(point), rel=1e-12)
    printed = formulate(problem.instance, MILP, facet="printed")
    answer = Solution(printed, printed.point(answer.field), Status.FEASIBLE, "", "by hand", identified=True)
    assert answer.objective_of_field is None


@pytest.mark.parametrize(
    "code, status", [(200, "infeasible"), (300, "unbounded"), (470, "limit-without-point"), (500, "error")]
)
def test_values_of_an_ampl_file_without_a_claim_count_if_they_are_feasible(
    skew, reading, tmp_path, code, status
):
    instance = cf.read_instance(skew / "skew.instance.json")
    held = formulate(instance, MILP)
    point = held.point(cf.greedy_field(instance))
    bad = point.copy()
    bad[: len(instance.theta)] += 1
    for values in (point, bad):
        path = tmp_path / "x.sol"
        write_ampl_sol(path, "some words", values[NlOrder(held).order], held.n_rows, code, stamp=held.stamp)
        exit_code, facts, complaint, written = reading(path)
        if code in {470, 500} and values is point:
            assert (exit_code, written, facts["status"], facts["claimed"]) == (0, True, "feasible", status)
            continue
        assert (exit_code, written) == (1, False)
        assert facts["claimed"] == status
        wrong = {200: values is point and "its point is feasible", 300: "is bounded below"}.get(code)
        assert facts["status"] == ("unknown" if wrong else status)
        assert (wrong or "not a solution") in complaint


# values


def test_values_that_no_column_can_have_are_refused(skew, reading, tmp_path):
    instance = cf.read_instance(skew / "skew.instance.json")
    held = formulate(instance, MILP)
    point = held.point(cf.greedy_field(instance))
    for block, value in (("p2", 4294967296.0), ("p2", 1e308), ("alpha", 1e300), ("s", -1.1 * LARGEST)):
        wrong = point.copy()
        wrong[held.blocks[block].offset] = value
        (tmp_path / "x.sol").write_text(by_names(held, wrong))
        code, facts, complaint, written = reading(tmp_path / "x.sol", "--tolerance", "inf")
        assert (code, facts, written) == (1, {}, False)
        assert f"{block}_00_01" in complaint
        assert f"has the value {value:g}" in complaint
    wrong[held.blocks["s"].offset] = LARGEST
    (tmp_path / "x.sol").write_text(by_names(held, wrong))
    assert reading(tmp_path / "x.sol", "--tolerance", "inf")[0] == 0


def test_jumps_do_not_wrap_around(milp):
    problem, point = milp
    wrong = point.copy()
    wrong[problem.blocks["p2"].offset] = 4294967296.0
    with pytest.raises(InstanceError, match="32 bits"):
        problem.field(wrong)


# cut and damaged files


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """For each reader an answer that a real solver wrote, and its problem; also without zeros."""
    by_reader = {}
    for path in sorted(GOOD, key=lambda path: path.suffix == ".txt"):  # answers in other text come last
        reader, status = FILES[path.name]
        if status in WITH_POINT and problem_of(path) in {"milp", "qp", "quartic"}:
            by_reader.setdefault(reader, (path.read_bytes(), problem(problem_of(path))))
    data, milp = by_reader["cbc"]
    by_reader["cbc without zeros"] = (re.sub(rb"(?m)^ +\d+ \S+ +0 .*\n", b"", data), milp)
    by_reader["cplex without zeros"] = ((TINY / "cplex-22.2.0.1_milp_optimal_nonzero.sol").read_bytes(), milp)
    folder = tmp_path_factory.mktemp("answers")
    write(milp, folder / "m.mps")
    model = highspy.Highs()
    model.setOptionValue("output_flag", False)
    model.readModel(str(folder / "m.mps"))
    model.run()
    for style in (0, 4):
        model.writeSolution(str(folder / "x.sol"), style)
        by_reader[f"highs {style}"] = ((folder / "x.sol").read_bytes(), milp)
    point = read_solution(folder / "x.sol", milp).point[NlOrder(milp).order]
    path = write_ampl_sol(folder / "a.sol", "optimal solution found", point, milp.n_rows, 0)
    by_reader["ampl text"] = (path.read_bytes(), milp)
    by_reader["ampl binary"] = (binary_sol(b"optimal solution found", milp, point), milp)
    return by_reader


def binary_sol(message, of, point):
    """An AMPL solution file in binary form, as the AMPL Solver Library writes it."""
    options = b"Options" + struct.pack("<8i", 3, 1, 1, 0, of.n_rows, 0, of.n_columns, of.n_columns)
    records = (b"binary", message, b"", options, b"", point.astype("<f8").tobytes(), struct.pack("<2i", 0, 0))
    return b"".join(
        struct.pack("<i", len(record)) + record + struct.pack("<i", len(record)) for record in records
    )


def bears_out(solution):
    """Whether a point agrees with its status, by independent numbers."""
    if not solution.status.needs_point or solution.point is None:
        return True
    off = solution.violation
    return (
        off.rows <= 2 * np.pi * TOLERANCE
        and max(off.bounds, off.integrality) <= TOLERANCE
        and (
            solution.reported is None
            or abs(solution.reported - solution.objective) <= 1.1 * TOLERANCE * max(1, solution.objective)
        )
    )


def attempt(path, data, of):
    """The solution in damaged content; None where refused. Only the package's errors are refusals."""
    path.write_bytes(data)
    try:
        return read_solution(path, of)
    except SolutionError:
        return None


def damages(data):
    """Kinds of damage to a file: lines repeated, moved or longer, values replaced, marks."""
    lines = data.splitlines(keepends=True)
    for at in range(0, len(lines), max(1, len(lines) // 5)):
        yield b"".join([*lines[: at + 1], *lines[at:]])
        yield b"".join([*lines[:at], *lines[at + 1 :]])
        yield b"".join([*lines[at:], *lines[:at]])
        yield b"".join([*lines[:at], lines[at].rstrip() + b" 7\n", *lines[at + 1 :]])
        yield b"".join([*lines[:at], lines[at].replace(b".", b","), *lines[at + 1 :]])
    matches = list(re.finditer(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?", data))
    for place, value in zip(
        matches[:: max(1, len(matches) // 10)],
        [b"1e300", b"nan", b"-0", b"0x1p3", b"4294967296", b"1e999", b"-1e-300", b"1e5", b"", b"\xff\xfe"]
        * 10,
        strict=False,
    ):
        yield data[: place.start()] + value + data[place.end() :]


def test_damaged_answers_are_refused_or_told_as_they_are(answers, tmp_path):
    for name, (data, of) in answers.items():
        for number, damaged in enumerate(damages(data)):
            solution = attempt(tmp_path / "x", damaged, of)
            assert solution is None or bears_out(solution), (name, number)


def test_a_repeated_line_of_cbc_drops_no_columns(tmp_path):
    lines = (TINY / "cbc-2.10.8_milp_optimal.sol").read_bytes().splitlines(keepends=True)
    for at in range(1, len(lines)):
        path = tmp_path / "x.sol"
        path.write_bytes(b"".join([*lines[: at + 1], *lines[at:]]))
        with pytest.raises(
            SolutionError, match=r"x\.sol: the column \w+ stands before the numbers start again"
        ):
            read_solution(path, problem("milp"))


# marks, names and words


def test_a_byte_order_mark_changes_nothing(skew, tmp_path):
    for file in GOOD:
        data = file.read_bytes()
        plain = parse_raw(data)
        for marked in (codecs.BOM_UTF8 + data, codecs.BOM_UTF16_LE + data.decode().encode("utf-16-le")):
            raw = parse_raw(marked)
            assert (raw.reader, raw.status, raw.message) == (plain.reader, plain.status, plain.message)
            assert raw.values.tolist() == plain.values.tolist()
    with pytest.raises(SolutionError, match="UTF-16 is damaged or cut off"):
        parse_raw(codecs.BOM_UTF16_LE + b"x")
    for name in ("skew.instance.json", f"skew.{MILP}.manifest.json"):
        (tmp_path / name).write_bytes(codecs.BOM_UTF8 + (skew / name).read_bytes())
    again = cf.read_manifest(tmp_path / f"skew.{MILP}.manifest.json").problem()
    assert again.sha256 == cf.read_manifest(skew / f"skew.{MILP}.manifest.json").problem().sha256
