"""Formulations of orthogonal crosses: the basis of cycles, optima against all jumps, limits, and the file."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from bounded_least_squares import least_in_bounds
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import write
from crossfield.export.programs import highs
from crossfield.export.programs.comparison import algebra_difference
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import verify
from crossfield.models.errors import FormulationError
from crossfield.models.formulations.problem import formulate
from crossfield.models.formulations.residuals import limit_residuals
from crossfield.models.instance.angles import HALF
from crossfield.models.instance.terms import parity_sign
from exhaustive import every_jump, least_energy, random_instance, terms, windows
from loops import for_each
from meshes import box, flat_sheet, icosahedron, mesh_of, on_directions, on_edges, tetrahedron, torus
from scipy.optimize import milp


def on_grid(seed, shape, strokes=6):
    return replace(random_instance(seed, shape, strokes), orthogonal=True)


def with_hole():
    corners = [[x, y, 0] for x in range(4) for y in range(4)]
    squares = [(x, y) for x in range(3) for y in range(3) if (x, y) != (1, 1)]
    quads = [[4 * x + y, 4 * x + y + 4, 4 * x + y + 5, 4 * x + y + 1] for x, y in squares]
    return mesh_of(corners, [face for a, b, c, d in quads for face in ([a, b, c], [a, c, d])])


def part(mesh, faces, **more):
    """An instance with strokes along the first edge of some faces, turned by 0.3, 0.6, ... radians."""
    faces = np.array(faces, dtype=np.int32)
    turned = mesh.vectors(faces, 0.3 * (1 + np.arange(len(faces))))
    return on_directions(mesh, faces, turned, **more)


INSTANCES = {
    "tetrahedron": lambda: part(tetrahedron(), [0, 2]),
    "tetrahedron without strokes": lambda: part(tetrahedron(), []),
    "cube": lambda: on_edges(box(1)),
    "cube with weights": lambda: part(box(1), [0, 5], pair_weights=box(1).dual_weights),
    "icosahedron": lambda: part(icosahedron(), [3]),
    "torus": lambda: part(torus(5, 3), []),
    "torus with strokes": lambda: part(torus(5, 3), [0, 7, 20]),
    "sheet": lambda: on_edges(flat_sheet(3, 2)),
    "sheet with hole": lambda: part(with_hole(), [0, 9]),
    "grid": lambda: on_grid(3, (3, 3)),
    "grid with holes": lambda: on_grid(5, None),
}
NAMES = ("miqp-orthogonal", "milp-orthogonal", "miqp-cycle", "milp-cycle")
TINY = ("tetrahedron", "tetrahedron without strokes", "sheet")
"""Those with few enough independent jumps to try all."""


# the basis


def incidence(instance):
    """Cycles over pairs and strokes (c, m + s), and the ends of pairs and strokes (m + s, n + 1)."""
    domain, cycles, strokes = instance.domain, instance.cycles, instance.stroke_index
    pairs, ground = len(domain.first), domain.size
    steps = np.zeros((len(cycles.ends), pairs + len(strokes)), int)
    np.add.at(steps, (np.repeat(np.arange(len(steps)), np.diff(cycles.start)), cycles.pair), cycles.sign)
    for number, (start, end) in enumerate(cycles.ends):
        if start >= 0:
            steps[number, pairs + start] -= 1
            steps[number, pairs + end] += 1
    ends = np.zeros((pairs + len(strokes), ground + 1), int)
    ends[np.arange(pairs), domain.first] = 1
    ends[np.arange(pairs), domain.second] -= 1
    ends[pairs + np.arange(len(strokes)), strokes] = 1
    ends[pairs + np.arange(len(strokes)), ground] = -1
    return steps, ends


@for_each("name", INSTANCES)
def test_cycles_are_a_basis_whose_integers_are_free(name):
    """They are closed, as many as independent cycles, and a square part of them has determinant 1 or -1."""
    instance = INSTANCES[name]()
    steps, ends = incidence(instance)
    assert not (steps @ ends).any()
    assert len(steps) == len(ends) - np.linalg.matrix_rank(ends)
    chords = np.ones(len(instance.domain.first), bool)
    in_forest = instance.cycles.forest.pair
    chords[in_forest[in_forest >= 0]] = False
    assert abs(np.linalg.det(steps[:, : len(chords)][:, chords])) == pytest.approx(1)


def test_rings_come_first_and_ten_thousand_faces_are_no_matter():
    instance = part(torus(100, 50), [])
    rings, cycles = instance.domain.rings, instance.cycles
    assert len(cycles.ends) == 10_000 // 2 + 1
    steps = np.diff(cycles.start)
    assert (steps[:-2] == np.diff(rings.start)[1:]).all()  # one ring is the sum of the others
    assert sorted(steps[-2:].tolist()) == [100, 200]  # round the tube, and round the torus


# optima


def least_of_all_jumps(instance, norm):
    """The least energy over all jumps of the pairs outside a forest, by least squares or linear programs."""
    steps, _ = incidence(instance)
    pairs, strokes = instance.pair_terms, instance.stroke_terms
    weight = np.concatenate([pairs.weighted(np.full(len(pairs.first), 2.0)), strokes.weight])
    fixed = np.concatenate([np.broadcast_to(pairs.offset(0), len(pairs.first)), -strokes.goal])
    reach = np.floor(np.abs(steps).sum(axis=1) / 2 + np.abs(steps @ fixed) / HALF).astype(int)
    ranges = [range(-most, most + 1) for most in reach]
    right = np.stack([axis.ravel() for axis in np.meshgrid(*ranges, indexing="ij")], axis=1) * HALF
    right = right + steps @ fixed  # the sums of residuals along cycles
    if norm == 2:  # the least sum of w r^2 with C r = b is b' (C W^-1 C')^-1 b
        inverse = np.linalg.inv((steps / weight) @ steps.T)
        return float(np.einsum("ki,ij,kj->k", right, inverse, right).min())
    size = steps.shape[1]
    both, cost = np.hstack([steps, -steps, -HALF * np.eye(len(steps))]), np.r_[weight, weight, 0 * reach]
    ends = np.r_[np.zeros(2 * size), -reach], np.r_[np.full(2 * size, np.inf), reach]
    whole = np.r_[np.zeros(2 * size), np.ones(len(reach))]
    goal = steps @ fixed
    return milp(cost, constraints=(both, goal, goal), bounds=ends, integrality=whole).fun


@for_each("name", TINY)
def test_optima_of_both_formulations_are_the_least_of_all_jumps(name):
    instance = INSTANCES[name]()
    least = least_of_all_jumps(instance, 1)
    for formulation in ("milp-orthogonal", "milp-cycle"):
        solution = cf.solve(formulate(instance, formulation), "highs")
        assert solution.objective == pytest.approx(least, abs=1e-6)
        assert solution.field.energy(1).total == pytest.approx(least, abs=1e-6)


@pytest.mark.needs("gurobi")
@pytest.mark.parametrize("name", ["tetrahedron", "tetrahedron without strokes"])
def test_optima_stay_with_limits_and_are_the_least_of_all_jumps(name):
    instance = INSTANCES[name]()
    least = least_of_all_jumps(instance, 2)
    for formulation in ("miqp-orthogonal", "miqp-cycle"):
        for limits in (False, True):
            problem = formulate(instance, formulation, limits=limits)
            solution = cf.solve(problem, "gurobi", limits=cf.Limits(30.0, gap=1e-9))
            assert solution.field.energy().total == pytest.approx(least, abs=1e-6)
            assert solution.bound == pytest.approx(least, abs=1e-5)


@pytest.mark.needs("gurobi")
@pytest.mark.slow
@for_each("name", ["cube", "cube with weights", "sheet", "grid", "grid with holes"])
def test_the_optimum_is_that_of_the_windows(name):
    instance = INSTANCES[name]()
    optima = [
        cf.solve(formulate(instance, formulation, **options), "gurobi", limits=cf.Limits(60.0, gap=1e-9))
        for formulation, options in (
            ("miqp-exact", {}),
            ("miqp-orthogonal", {}),
            ("miqp-cycle", {}),
            ("miqp-cycle", {"limits": True}),
            ("miqp-orthogonal", {"limits": True}),
        )
    ]
    for solution in optima:
        assert solution.objective == pytest.approx(optima[0].objective, abs=1e-6)
        assert solution.field.energy().total == pytest.approx(optima[0].objective, abs=1e-6)


@for_each("name", INSTANCES)
def test_limits_are_where_a_changed_jump_gains_nothing(name):
    """A residual at its limit: the change of one jump and of all angles leaves the energy as it is."""
    instance = INSTANCES[name]()
    _, ends = incidence(instance)
    pairs, strokes = instance.pair_terms, instance.stroke_terms
    root = np.sqrt(np.concatenate([pairs.weighted(np.full(len(pairs.first), 2.0)), strokes.weight]))
    rows = root[:, None] * ends[:, :-1]
    for number, limit in enumerate(np.concatenate(limit_residuals(instance))):
        turn = np.zeros(len(root))
        turn[number] = HALF * root[number]
        gain = np.sum((turn - rows @ np.linalg.lstsq(rows, turn, rcond=None)[0]) ** 2)
        assert gain == pytest.approx(2 * root[number] ** 2 * HALF * limit, abs=1e-7 * root[number] ** 2)
    assert limit_residuals(instance)[0].max() < 0.75


def optimum_in_windows(instance):
    """The angles and jumps of least energy, by least squares in the windows for jumps that may be better."""
    jumps = np.concatenate(list(every_jump(instance)))
    free = np.concatenate([least_energy(instance, part) for part in every_jump(instance)])
    least, best = np.inf, None
    for number in np.argsort(free, kind="stable"):
        if free[number] >= least:
            return best
        x, energy = least_in_bounds(*terms(instance, jumps[number]), windows(instance))
        if energy < least:
            least, best = energy, (*np.split(x, 2), jumps[number])
    return best


@for_each("seed", range(12))
def test_limits_of_skewed_crosses_hold_in_the_optimum(seed):
    """2 pi |A| <= pi^2/2 (1 - r) + 8 (-1)^p beta_i beta_j, and |A| <= pi/2 (1 - r): docs/cycles.md."""
    instance = random_instance(seed, [(2, 2), (1, 4), (2, 3)][seed % 3], strokes=3)
    instance = replace(instance, stroke_coefficient=[0.1, 1.0, 20.0][seed % 3])
    alpha, beta, p = optimum_in_windows(instance)
    pairs = instance.pair_terms
    a = np.abs(pairs.residual_a(alpha, p))
    product = parity_sign(p) * beta[pairs.first] * beta[pairs.second]
    limit = limit_residuals(instance)[0]
    assert (2 * np.pi * a <= 2 * np.pi * limit + 8 * product + 1e-7).all()
    assert (a <= 2 * limit + 1e-7).all()


# refusals


def test_other_instances_are_refused_with_a_remedy(tmp_path):
    skewed = cf.sample("mouse", 4)
    for name in ("miqp-orthogonal", "cycle", "cycle1"):
        with pytest.raises(FormulationError, match="orthogonal crosses only; make the instance with orthogo"):
            formulate(skewed, name)
    in_box = replace(skewed, orthogonal=True, gauge="box")
    assert formulate(in_box, "miqp-orthogonal").n_columns
    for name, options in (("miqp-cycle", {}), ("milp-cycle", {}), ("miqp-orthogonal", {"limits": True})):
        with pytest.raises(FormulationError, match="the gauge box does not at strokes; choose the gauge str"):
            formulate(in_box, name, **options)
    with pytest.raises(FormulationError, match="milp-cycle has no option limits"):
        formulate(in_box, "milp-cycle", limits=True)
    written = [manifest.formulation for manifest in write_all(skewed, tmp_path, formats=["mps"])]
    assert not {name for name in written if "cycle" in name or "orthogonal" in name}
    right = replace(skewed, orthogonal=True)
    manifests = write_all(
        right, tmp_path / "right", formulations=NAMES, formats=["mps"], options={"limits": True}
    )
    limited = {manifest.formulation for manifest in manifests if "limited" in manifest.document}
    assert limited == {"miqp-orthogonal", "miqp-cycle"}
    problem = next(manifest for manifest in manifests if manifest.formulation == "miqp-cycle").problem()
    assert "the optimum stays" in problem.limited
    relaxed = formulate(right, "miqp-orthogonal", limits=True, relax=True)
    assert relaxed.limited.endswith("the relaxation may rise")


def test_an_export_names_what_it_leaves_out(tmp_path, capsys):
    assert invoke(["export", "mouse", "--size", "4", "--format", "mps", "-o", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.replace("\n", " ")
    assert "not written: miqp-orthogonal, milp-orthogonal, miqp-cycle, milp-cycle, which is for ort" in lines


# files


TETRAHEDRON = """Minimize
 obj_sha256_STAMP: + 0 ONE_STAMP
 + 0 d_00
 + 0 d_01
 + 0 d_02
 + 0 d_03
 + 0 d_04
 + 0 d_05
 + 0 q_00
 + 0 q_02
 + 0 k_00
 + 0 k_01
 + 0 k_02
 + 0 k_03
 + [
 + 4 d_00 ^2
 + 4 d_01 ^2
 + 4 d_02 ^2
 + 4 d_03 ^2
 + 4 d_04 ^2
 + 4 d_05 ^2
 + 40 q_00 ^2
 + 40 q_02 ^2
 ] / 2
Subject To
 cyc3_00: - 1 d_04 - 1 d_03 + 1 d_02 - 1.5707963267948966 k_00 = 3.141592653591
 cyc3_01: + 1 d_00 - 1 d_05 + 1 d_04 - 1.5707963267948966 k_01 = -3.141592653589586
 cyc3_02: + 1 d_01 + 1 d_03 + 1 d_05 - 1.5707963267948966 k_02 = 3.141592653589586
 path1_03: + 1 d_02 - 1 q_02 + 1 q_00 - 1.5707963267948966 k_03 = 1.347197551197
Bounds
 1 <= ONE_STAMP <= 1
LIMITS -3 <= k_00 <= -1
 1 <= k_01 <= 3
 -3 <= k_02 <= -1
 -2 <= k_03 <= 0
Generals
 k_00
 k_01
 k_02
 k_03
End
"""
"""Three of four rings, whose kappa are 60, -60 and 180 degrees, and a path of one step between two strokes.

Strokes are at 0.3 and 0.6; from face 2 to face 0 a direction turns by 60 degrees, so 0.6 - 0.3 + pi/3 remain.
"""
LIMITS = "".join(
    f" -0.7853981633974483 <= {name} <= 0.7853981633974483\n"
    for name in ("d_00", "d_01", "d_02", "d_03", "d_04", "d_05", "q_00", "q_02")
)


def test_the_file_of_a_tetrahedron_is_as_by_hand(tmp_path):
    problem = formulate(INSTANCES["tetrahedron"](), "miqp-cycle")
    write(problem, tmp_path / "it.lp")
    lines = (tmp_path / "it.lp").read_text().splitlines(keepends=True)
    text = "".join(line for line in lines if not line.startswith("\\"))
    expected = TETRAHEDRON.replace("STAMP", problem.stamp.removeprefix("sha256_")).replace("LIMITS", LIMITS)
    assert text == expected


@pytest.mark.parametrize("suffix", ["lp", "mps"])
def test_highs_reads_rows_of_many_steps(suffix, tmp_path):
    problem = formulate(part(torus(40, 3), []), "milp-cycle")
    assert max(family.family.steps for family in problem.rows) == 80
    write(problem, tmp_path / f"it.{suffix}")
    points = np.random.default_rng(0).normal(size=(2, problem.n_columns))
    assert algebra_difference(highs.read(tmp_path / f"it.{suffix}"), problem, 0.0, points) == ""


@pytest.mark.oracles
@pytest.mark.slow
@pytest.mark.parametrize("name", ["cube with weights", "torus with strokes", "sheet with hole", "grid"])
def test_every_program_reads_every_format(name, tmp_path):
    formats = ["lp", "mps", "nl", "mod", "osil", "qplib", "bar", "gms"]
    write_all(INSTANCES[name](), tmp_path, formulations=NAMES, formats=formats, options={"limits": True})
    checks = verify(tmp_path).checks
    assert {check.verdict for check in checks} <= {Verdict.AGREES, Verdict.REFUSED, Verdict.NOT_TRIED}
