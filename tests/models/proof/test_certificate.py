"""Certificates: what is written is checked by a program that shares no code with a prover, and nothing false
passes it.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import crossfield as cf
import numpy as np
import places
import pytest
from archives import forged, of_numpy, pack_arrays
from certificate_arrays import allowed_of, with_allowed, with_head
from crossfield.models.field.jumps import free_jumps
from crossfield.models.processes.process_pool import parallel_map
from crossfield.models.proof.checkers import check_certificate, check_orthogonal
from crossfield.models.proof.descent.last_step import minimise_on_boxes
from crossfield.models.proof.tightening import remaining_windows
from exhaustive import optimum, random_instance, sketch
from proofs_round_fields import prove_round

CHECKERS = [Path(check_certificate.__file__), Path(check_orthogonal.__file__)]
WRONG = (check_certificate.NotProvenError, check_certificate.UnreadableError)


@cache
def proven(seed):
    return prove_round(optimum(random_instance(seed, (2, 2), 4)), levels=4)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The file and the arrays of a certificate, by seed."""
    folder = tmp_path_factory.mktemp("certificates")

    @cache
    def one(seed):
        path = folder / f"{seed}.npz"
        cf.write_certificate(proven(seed), path)
        return path, check_certificate.unpack_arrays(path.read_bytes())

    return one


def refusal(arrays):
    with pytest.raises(WRONG) as caught:
        check_certificate.check_arrays(arrays)
    return str(caught.value)


def test_a_check_reports_its_levels(written):
    path, _ = written(1)
    lines, count = [], len(proven(1).levels)
    certificate = cf.read_certificate(path, jobs=2, progress=lines.append)
    assert lines == [f"checked {number + 1} of {count} levels" for number in range(count)]
    assert certificate.bound <= certificate.proven.bound <= certificate.energy


def test_levels_that_two_processes_check_give_the_same(written):
    _, arrays = written(1)
    alone = check_certificate.pass_levels(arrays, has_pieces=True)
    with parallel_map(check_certificate.pass_level, 2) as check_in_processes:
        shared = check_certificate.pass_levels(
            arrays, lambda _, tasks: check_in_processes(tasks), has_pieces=True
        )
    assert shared.bounds == alone.bounds
    np.testing.assert_array_equal(shared.last.boxes, alone.last.boxes)


@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_a_part_without_strokes_has_no_cost_at_the_optimum(norm, tmp_path):
    """A field that has one there is not optimal, and the windows of that part stay whole."""
    theta = np.full((2, 5), np.nan)
    theta[0, 3], theta[1, 4] = 0.3, 1.2
    mask = np.ones((2, 5), bool)
    mask[:, 2] = False
    instance, path = sketch(mask, theta, 0.5), tmp_path / "it.npz"
    proof = cf.prove(instance, norm=norm, jobs=1)
    written = cf.write_certificate(proof, path)
    assert written.status == "optimal"
    windows, apart = remaining_windows(written), instance.grid.columns < 2
    assert (windows.alpha_lower[apart] == instance.alpha_lower[apart]).all()
    assert (windows.alpha_upper[apart] == instance.alpha_upper[apart]).all()
    assert (np.abs([windows.beta_lower[apart], windows.beta_upper[apart]]) == np.pi / 4).all()
    assert (windows.alpha_upper - windows.alpha_lower)[~apart].min() < 1.0
    beta = proof.field.beta + np.where(instance.grid.rows + instance.grid.columns == 0, 0.1, 0.0)
    worse = cf.CrossField(instance, proof.field.alpha, beta, proof.field.p)
    energy = worse.energy(norm).total
    less = replace(proof.with_levels(1, "gap"), field=worse, energy=energy)
    certificate = cf.write_certificate(less, path, force=True)
    assert (certificate.status, cf.read_certificate(path).status) == ("gap", "gap")
    assert certificate.bound <= written.energy


@pytest.mark.slow
def test_certificates_that_ship_hold():
    """Those of large instances are checked when a library is built."""
    folder = places.ROOT / "export" / "library" / "plan" / "known" / "points"
    small = [path for path in sorted(folder.glob("*.certificate.npz")) if path.stat().st_size < 500_000]
    assert {cf.read_certificate(path).status for path in small} == {"optimal"}


def test_a_field_that_is_not_optimal_is_never_certified(tmp_path):
    rng = np.random.default_rng(5)
    for seed in (1, 3, 4, 7):
        good = optimum(random_instance(seed, (2, 2), 4))
        for size in (1e-3, 1e-1):
            beta = np.clip(good.beta + rng.normal(0, size, 4), -np.pi / 4, np.pi / 4)
            worse = cf.CrossField(good.instance, good.alpha, beta, good.p)
            assert worse.energy().total > good.energy().total + 1e-7
            certificate = cf.write_certificate(prove_round(worse, levels=4), tmp_path / "it.npz", force=True)
            assert certificate.status == "gap"
            assert certificate.proven.bound <= good.energy().total
            arrays = check_certificate.unpack_arrays((tmp_path / "it.npz").read_bytes())
            assert "status is claimed as optimal" in refusal(with_head(arrays, status="optimal"))


def test_a_changed_byte_of_the_file_is_told_or_changes_nothing(written, tmp_path):
    rng = np.random.default_rng(3)
    path, _ = written(3)
    data, claim = path.read_bytes(), check_certificate.check_bytes(path.read_bytes())
    other, refused_forgeries = tmp_path / "other.npz", 0
    for at in rng.integers(0, len(data), 50):
        other.write_bytes(data[:at] + bytes([data[at] ^ (1 << rng.integers(8))]) + data[at + 1 :])
        try:
            verdict = check_certificate.check_bytes(other.read_bytes())
        except WRONG:
            refused_forgeries += 1
            continue
        assert (verdict.status, verdict.energy, verdict.bound) == (claim.status, claim.energy, claim.bound)
    assert refused_forgeries > 35


def test_levels_that_do_not_follow_are_not_written(written, tmp_path):
    """A prover that drops cells of a better field is detected, and the old file stays."""
    proof, (_, arrays) = proven(1), written(1)
    path = tmp_path / "it.npz"
    path.write_bytes(b"kept")
    label = 2  # any that has to be there
    allowed = allowed_of(arrays, 1)
    allowed[label] = False
    fewer = with_allowed(arrays, 1, allowed)
    less = proof.arrays | {name: fewer[name] for name in proof.arrays if name.startswith("level_1_")}
    with pytest.raises(
        cf.InputError, match=r"it\.npz: would hold a proof that is not valid: level 1, pixel 0"
    ):
        cf.write_certificate(replace(proof, arrays=less), path, force=True)
    assert path.read_bytes() == b"kept"


def test_a_forged_archive_is_refused_or_has_the_arrays_that_numpy_loads(written, tmp_path, capsys, subtests):
    path, arrays = written(1)
    other, accepted = tmp_path / "other.npz", set()
    ways = {save.__name__: partial(of_numpy, save=save) for save in (np.savez, np.savez_compressed)}
    for forgery, forge in (forged("alpha") | ways).items():
        with subtests.test(forgery):
            other.write_bytes(forge(path.read_bytes()))
            try:
                unpacked = check_certificate.unpack_arrays(other.read_bytes())
                check_certificate.check_arrays(unpacked)
            except WRONG:
                assert check_certificate.main([str(other)]) == 2
                assert capsys.readouterr().out.startswith("unreadable: ")
                with pytest.raises(cf.InputError, match=r"other\.npz: is not a certificate: "):
                    cf.read_certificate(other)
                continue
            accepted.add(forgery)
            with np.load(other, allow_pickle=False) as loaded:
                assert set(loaded) == set(unpacked) == set(arrays)
                for name in loaded:
                    np.testing.assert_array_equal(loaded[name], unpacked[name])
    assert {*ways} <= accepted <= {*ways, "a larger member than there is", "a header with a key twice"}


def test_an_instance_that_would_be_rounded_has_no_certificate(written, tmp_path):
    """The certificate would be of directions that the instance no longer has once it is read."""
    _, arrays = written(1)
    path = tmp_path / "it.npz"
    for name, change in (
        ("instance_theta", lambda theta: theta + 3e-14),
        ("instance_origin", lambda origin: origin + 1 / 3),
    ):
        path.write_bytes(pack_arrays(arrays | {name: change(arrays[name])}))
        with pytest.raises(cf.InstanceError, match=f"it.npz: array '{name}' is not as crossfield writes it"):
            cf.read_certificate(path)


@pytest.mark.parametrize("orthogonal", [False, True])
def test_a_checker_runs_on_numpy_and_the_standard_library_alone(orthogonal, tmp_path):
    path, wrong, other = (tmp_path / f"{name}.npz" for name in ("it", "wrong", "other"))
    for crosses, file in ((orthogonal, path), (not orthogonal, other)):
        instance = replace(random_instance(1, (2, 2), 4), orthogonal=crosses)
        cf.write_certificate(cf.prove(instance, jobs=1), file)
    arrays = check_certificate.unpack_archive(path.read_bytes())
    wrong.write_bytes(pack_arrays(with_head(arrays, bound=1.0)))
    imported = set()
    for checker in CHECKERS:
        program = tmp_path / checker.name
        program.write_bytes(checker.read_bytes())
        for node in ast.walk(ast.parse(program.read_text())):
            if isinstance(node, ast.Import):
                imported |= {name.name.split(".")[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                imported.add(str(node.module).split(".")[0])
    assert imported - {"numpy", "check_certificate"} <= sys.stdlib_module_names
    # -S: nothing that a .pth file leads to can be imported; nor crossfield where it lies beside numpy.
    start = (
        "import runpy, sys; sys.path += [sys.argv.pop(1), sys.argv.pop(1)]; sys.argv.pop(0); "
        "sys.modules['crossfield'] = None; runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    here, elsewhere = (CHECKERS[kind].name for kind in (orthogonal, not orthogonal))
    for file, code, line in (
        (path, 0, "optimal: no field has less"),
        (wrong, 1, "refused: bound is claimed"),
        (CHECKERS[0], 2, "unreadable: "),
        (tmp_path / "absent.npz", 2, "unreadable: "),
        (other, 2, f"; run {elsewhere}"),
    ):
        folders = [str(Path(np.__file__).parents[1]), str(tmp_path)]
        command = [sys.executable, "-I", "-S", "-c", start, *folders, str(tmp_path / here), str(file)]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (code, "")
        assert line in done.stdout


@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 7, 5), (5, 3, 9), (4, 4, 1), (6, 9, 4), (70, 40, 90)])
def test_products_are_the_least_sums(shape):
    rows, terms, columns = shape
    rng = np.random.default_rng(4)
    left, right = rng.normal(size=(rows, terms)), rng.normal(size=(columns, terms)).T
    left[:, 1:][rng.random((rows, terms - 1)) < 0.3] = np.inf
    expected = (left[:, :, None] + right).min(axis=1)
    np.testing.assert_array_equal(check_certificate.min_plus_product(left, right), expected)


def free_energy(instance, alpha, beta, norm=2):
    """F: the best jump at every pair, the nearer line at every stroke; of angles (n,), or of many (n, k)."""
    pair_size, size = (np.abs if norm != 2 else np.square), (np.abs if norm == 1 else np.square)
    i, j = instance.grid.first, instance.grid.second
    pairs = np.min(
        [
            2 * pair_size(alpha[i] - alpha[j] + np.pi / 2 * p) + 2 * pair_size((-1) ** p * beta[i] - beta[j])
            for p in range(-6, 7)
        ],
        axis=0,
    )
    at = instance.stroke_index
    lines = np.stack([alpha + beta, alpha + np.pi / 2 - beta])[:, at].T - instance.target[:, None]
    away = np.min(np.abs(lines - np.pi * np.round(lines / np.pi)), axis=-1)
    return (
        pairs.sum(axis=0)
        + instance.stroke_coefficient * (size(away) @ instance.w)
        + instance.skew_coefficient * size(beta).sum(axis=0)
    )


def test_whatever_the_messages_are_what_a_level_says_of_every_pixel_is_true(written):
    """The theorem itself, at random crosses: the mean of the numbers at the four vertices of a pixel's cell,
    by the weights of rounding, is at most the energy.
    """
    rng = np.random.default_rng(2)
    closest = np.full(3, np.inf)
    for seed, size, steep in (
        (1, 0.0, 0.0),
        (1, 0.01, 0.0),
        (3, 0.1, 0.05),
        (4, 0.5, 0.0),
        (7, 0.02, -0.05),
        (7, 0.0, 0.5),
    ):
        _, arrays = written(seed)
        instance, (terms, _) = proven(seed).field.instance, check_certificate.terms_of(arrays)
        level = check_certificate.level_of(arrays, 0, terms)
        level.shares = [
            level.shares[e]
            + rng.normal(0, size, level.shares[e].shape)
            + steep * np.arange(len(level.shares[e]))
            for e in range(len(terms.first))
        ]
        passed = check_certificate.ForwardPass(level, terms)
        tests = [passed.bounds_of_pass(), *(passed.bounds_of_combs(upper=upper) for upper in (True, False))]
        angles = [level.angles(i) for i in range(instance.grid.size)]
        for near in (1.0, 0.3, 0.05, 0.01) * 40:
            at = [near * rng.uniform(-1, 1, 2) * np.pi / 4 for _ in angles]
            x = [
                np.clip(level.alpha[i] + a, alpha[0], alpha[-1]) for i, ((a, _), (alpha, _)) in enumerate(
                    zip(at, angles, strict=True))
            ]  # fmt: skip
            y = [np.clip(level.beta[i] + b, -np.pi / 4, np.pi / 4) for i, (_, b) in enumerate(at)]
            energy = free_energy(instance, np.array(x), np.array(y))
            assert passed.bound <= energy
            for number, bounds in enumerate(tests):
                for i, (alpha, beta) in enumerate(angles):
                    mean = hat(x[i], alpha) @ bounds[i].reshape(len(alpha), -1) @ hat(y[i], beta)
                    closest[number] = min(closest[number], energy - mean)
                    assert mean <= energy + 1e-12
    assert (closest < 0.02).all()


def test_no_cell_that_holds_a_cross_of_low_energy_is_excluded(written):
    """Random crosses of less energy than asked for stay in cells, though combs leave fewer than a pass."""
    rng, remaining = np.random.default_rng(3), np.zeros(2, int)
    for seed in (1, 3, 4, 7):
        _, arrays = written(seed)
        instance, (terms, _) = proven(seed).field.instance, check_certificate.terms_of(arrays)
        level = check_certificate.level_of(arrays, 0, terms)
        passed = check_certificate.ForwardPass(level, terms)
        near = np.repeat(level.h * 2.0 ** np.arange(-3, 2), 400)[:, None, None]
        crosses = np.stack([level.alpha, level.beta], axis=1) + near * rng.uniform(-1, 1, (2000, 4, 2))
        crosses[..., 1] = np.clip(crosses[..., 1], -np.pi / 4, np.pi / 4)
        energies = free_energy(instance, *crosses.T)
        for most in np.quantile(energies, [0.01, 0.1, 0.4]):
            by_pass, cells = (passed.remaining_cells(most, combs=combs) for combs in (False, True))
            remaining += [sum(left.sum() for left in kind) for kind in (by_pass, cells)]
            low = crosses[energies <= most]
            for i, left in enumerate(cells):
                alpha, beta = level.angles(i)
                k, l = (  # noqa: E741
                    np.floor((low[:, i, axis] - side[0]) / level.h).astype(int)
                    for axis, side in enumerate((alpha, beta))
                )
                assert left[k, l].all()
    assert remaining[1] < 0.95 * remaining[0]


def hat(value, places):
    """The weights with which a number is rounded to its two neighbours, so that the mean is right."""
    return np.maximum(0, 1 - np.abs(value - places) / (places[1] - places[0]))


def test_boxes_hold_the_crosses_of_all_cells(written):
    rng = np.random.default_rng(6)
    _, arrays = written(1)
    level = check_certificate.level_of(arrays, 0, check_certificate.terms_of(arrays)[0])
    cells = [rng.random(np.array(allowed.shape) - 1) < 0.05 for allowed in level.allowed]
    for i, box in enumerate(check_certificate.boxes_of(level, cells, 1e-9)):
        alpha, beta = level.angles(i)
        k, l = np.nonzero(cells[i])  # noqa: E741
        x = alpha[k] + rng.random(len(k)) * level.h
        y = np.clip(beta[l] + rng.random(len(l)) * level.h, -np.pi / 4, np.pi / 4)
        assert ((x >= box[0]) & (x <= box[1]) & (y >= box[2]) & (y <= box[3])).all()


def least_bound(terms, step, pieces):
    """The least bound of all pieces of a last step."""
    return min(bound for _, bound in check_certificate.bound_pieces(terms, step, pieces))


@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_boxes_are_cut_and_bounded(norm, written):
    """At random crosses in boxes over edges of windows, or so wide that several jumps are open, no energy is
    below the bound, and one is close.
    """
    rng, cut_windows, cut_jumps = np.random.default_rng(4), 0, 0
    for seed in (1, 3, 4):
        (terms, _), instance = check_certificate.terms_of(written(seed)[1]), proven(seed).field.instance
        terms.norm, n, jumps = norm, len(terms.white), np.zeros(len(terms.first), int)
        for wide in (False, True):
            if wide:
                (alpha, beta), sides = rng.uniform(-0.5, 0.5, (2, n)), rng.uniform(0.1, 0.6, (2, n))
            else:
                edge = rng.choice([-1, 1]) * (np.pi / 4 + rng.choice([0.0, 0.0, 0.0, 0.15, 0.3]))
                alpha = terms.theta[0] + edge + rng.normal(0, 0.02, n)
                beta, sides = rng.choice([-1, 1]) * rng.uniform(0.3, 0.75, n), rng.uniform(0.01, 0.1, (2, n))
            low, high = (np.stack([alpha, beta], axis=1) + way * sides.T for way in (-1, 1))
            boxes = np.stack([low, high], axis=2).reshape(n, 4)
            boxes[:, 2:] = np.clip(boxes[:, 2:], -np.pi / 4, np.pi / 4)
            step = check_certificate.last_step(terms, boxes, alpha, jumps)
            shares = rng.random((500, n, 2)) ** rng.choice([0.1, 1, 10], (500, 1, 1))
            points = boxes[:, ::2] + shares * (boxes[:, 1::2] - boxes[:, ::2])
            least = free_energy(instance, *points.T, norm).min()
            best, bound, pieces = minimise_on_boxes(instance, terms, step, least if wide else 1e6)
            least = min(least, free_energy(instance, best.alpha, best.beta, norm))
            assert least_bound(terms, step, pieces) == bound <= least + 1e-9
            counts = (step.whole_piece.weights(terms, step.theta)[2] == terms.weight).all()
            assert bound >= least - (0.5 if not wide else 1e-6 if counts else np.inf)
            noise = rng.normal(0, 0.1, pieces["multipliers"].shape)
            shaken = pieces | {"multipliers": pieces["multipliers"] + noise}
            assert least_bound(terms, step, shaken) <= least + 1e-9
            of_jumps = np.flatnonzero(pieces["cuts"] >= n)
            for at in of_jumps[:1]:
                fewer = pieces["cuts"].copy()
                fewer[at + 2] -= 1
                with pytest.raises(check_certificate.NotProvenError, match="leaves out jumps"):
                    least_bound(terms, step, pieces | {"cuts": fewer})
            cut_windows += not wide and len(pieces["cuts"]) > 1
            cut_jumps += len(of_jumps) > 0
    assert cut_windows
    assert cut_jumps


def test_a_forced_jump_is_that_of_the_certified_field(written):
    """Where the field has another jump than all better ones, none is forced: it would be fixed wrongly."""
    rng, forced, other = np.random.default_rng(8), 0, 0
    for seed in (1, 3, 4):
        _, arrays = written(seed)
        (terms, _), instance = check_certificate.terms_of(arrays), proven(seed).field.instance
        n, m, alpha = len(terms.white), len(terms.first), arrays["alpha"]
        for _ in range(2):
            sides = rng.uniform(0.1, 0.6, (2, n))
            boxes = np.stack([alpha - sides[0], alpha + sides[0], -sides[1], sides[1]], axis=1)
            p = rng.integers(-1, 2, m).astype(np.int32)
            step = check_certificate.last_step(terms, boxes, alpha, p.astype(int))
            points = boxes[:, ::2] + rng.random((2000, n, 2)) * (boxes[:, 1::2] - boxes[:, ::2])
            energies = free_energy(instance, *points.T)
            most = float(np.sort(energies)[20])
            pieces = minimise_on_boxes(instance, terms, step, most).pieces
            passed = check_certificate.PassedLevels(
                terms, terms, np.arange(n), np.arange(m), most, 0.0, 0.0, [0.0], step
            )
            claim = with_head(arrays | pieces | {"p": p}, energy=most, bound=0.0, status="gap")
            at = check_certificate.check_last_step(claim, passed).forced_pairs
            best = np.array([free_jumps(instance, *point.T)[0] for point in points[energies <= most]])
            assert (best == p)[:, at].all()
            forced += at.sum()
            other += (best != p).all(axis=0).sum()
    assert forced > 3
    assert other > 3
