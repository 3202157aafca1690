"""Certificates: what is written is checked by a program that shares no code with a prover, and nothing false
passes it.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import zipfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import places
import pytest
from allowed_labels import allowed_of, with_allowed
from archives import forged, members_of, npy, of_numpy, packed
from crossfield.export.cli.app import invoke
from crossfield.models.array_archive import pack_arrays
from crossfield.models.errors import InputError, InstanceError
from crossfield.models.field.field import CrossField
from crossfield.models.field.jumps import free_jumps
from crossfield.models.processes.process_pool import parallel_map
from crossfield.models.proof.certificate import read_certificate, write_certificate
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.proof.descent.last_step import minimise_on_boxes
from crossfield.models.proof.prove import prove
from crossfield.models.proof.tightening import remaining_windows
from exhaustive import optimum, random_instance, sketch
from proofs_round_fields import prove_round

PROGRAM = Path(check_certificate.__file__)
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
        write_certificate(proven(seed), path)
        return path, check_certificate.read_arrays(str(path))

    return one


def with_head(arrays, **changes):
    head = json.loads(arrays["head"].tobytes()) | changes
    return arrays | {"head": np.frombuffer(json.dumps(head).encode(), np.uint8)}


def refusal(arrays):
    with pytest.raises(WRONG) as caught:
        check_certificate.check_arrays(arrays)
    return str(caught.value)


def test_what_was_written_is_read_back_and_holds(written):
    path, _ = written(1)
    lines = []
    certificate, proof = read_certificate(path, jobs=2, progress=lines.append), proven(1)
    count = len(proof.levels)
    assert lines == [f"checked {number + 1} of {count} levels" for number in range(count)]
    assert certificate.field.instance.sha256 == proof.field.instance.sha256
    for name in ("alpha", "beta", "p"):
        np.testing.assert_array_equal(getattr(certificate.field, name), getattr(proof.field, name))
    assert certificate.status == certificate.proven.status == "optimal"
    assert certificate.bound <= certificate.proven.bound <= certificate.energy
    assert certificate.energy == pytest.approx(proof.energy, abs=1e-12)


def test_the_same_proof_gives_the_same_bytes(tmp_path):
    for name in ("one.npz", "other.npz"):
        write_certificate(proven(1), tmp_path / name)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "other.npz").read_bytes()


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
    proof = prove(instance, norm=norm, jobs=1)
    written = write_certificate(proof, path)
    assert written.status == "optimal"
    windows, apart = remaining_windows(written), instance.grid.columns < 2
    assert (windows.alpha_lower[apart] == instance.alpha_lower[apart]).all()
    assert (windows.alpha_upper[apart] == instance.alpha_upper[apart]).all()
    assert (np.abs([windows.beta_lower[apart], windows.beta_upper[apart]]) == np.pi / 4).all()
    assert (windows.alpha_upper - windows.alpha_lower)[~apart].min() < 1.0
    beta = proof.field.beta + np.where(instance.grid.rows + instance.grid.columns == 0, 0.1, 0.0)
    worse = CrossField(instance, proof.field.alpha, beta, proof.field.p)
    energy = worse.energy(norm).total
    less = replace(proof.with_levels(1, "gap"), field=worse, energy=energy)
    certificate = write_certificate(less, path, force=True)
    assert (certificate.status, read_certificate(path).status) == ("gap", "gap")
    assert certificate.bound <= written.energy


@pytest.mark.slow
def test_all_certificates_that_ship_hold():
    paths = sorted(
        (places.ROOT / "export" / "library" / "plan" / "known" / "points").glob("*.certificate.npz")
    )
    assert {read_certificate(path).status for path in paths} == {"optimal"}


def test_a_field_that_is_not_optimal_is_never_certified(tmp_path):
    rng = np.random.default_rng(5)
    for seed in (1, 3, 4, 7):
        good = optimum(random_instance(seed, (2, 2), 4))
        for size in (1e-3, 1e-1):
            beta = np.clip(good.beta + rng.normal(0, size, 4), -np.pi / 4, np.pi / 4)
            worse = CrossField(good.instance, good.alpha, beta, good.p)
            assert worse.energy().total > good.energy().total + 1e-7
            certificate = write_certificate(prove_round(worse, levels=4), tmp_path / "it.npz", force=True)
            assert certificate.status == "gap"
            assert certificate.proven.bound <= good.energy().total
            arrays = check_certificate.read_arrays(str(tmp_path / "it.npz"))
            assert "status is claimed as optimal" in refusal(with_head(arrays, status="optimal"))


def test_an_instance_with_two_strokes_at_one_pixel_is_refused(written):
    _, arrays = written(1)
    assert "instance_crossings" in refusal(arrays | {"instance_crossings": np.zeros(1, np.int32)})


def test_a_changed_byte_of_the_file_is_told_or_changes_nothing(written, tmp_path):
    rng = np.random.default_rng(3)
    path, _ = written(3)
    data, claim = path.read_bytes(), check_certificate.check_arrays(check_certificate.read_arrays(str(path)))
    other, refused_forgeries = tmp_path / "other.npz", 0
    for at in rng.integers(0, len(data), 100):
        other.write_bytes(data[:at] + bytes([data[at] ^ (1 << rng.integers(8))]) + data[at + 1 :])
        try:
            verdict = check_certificate.check_arrays(check_certificate.read_arrays(str(other)))
        except WRONG:
            refused_forgeries += 1
            continue
        assert (verdict.status, verdict.energy, verdict.bound) == (claim.status, claim.energy, claim.bound)
    assert refused_forgeries > 70


def test_certificates_of_other_versions_are_refused(written):
    _, arrays = written(1)
    for version in (0, 1, 2, 3, 5, True, "4", 4.0):
        assert "is no crossfield-certificate of version 4" in refusal(with_head(arrays, version=version))


def test_what_is_refused_says_where(written):
    _, arrays = written(1)
    last = max(name for name in arrays if name.endswith("_allowed"))
    level = last.removesuffix("_allowed")
    second = arrays["level_1_ranges"].copy()
    second[2, 0] += 1
    without_first = np.unpackbits(arrays["level_0_allowed"])
    without_first[0] = 0
    first = {name: arrays[name] for name in arrays if name[:6] != "level_" or name[:8] == "level_0_"}
    cases = {
        "level 1, pixel 0": arrays | {"level_0_share_unit": arrays["level_0_share_unit"] * 0.5},
        "is claimed as optimal": with_head(
            first | {name: arrays[name][:0] for name in ("cuts", "multipliers")}, levels=1, bound=0.0
        ),
        "energy is claimed": with_head(arrays, energy=0.01),
        "bound is claimed": with_head(arrays, bound=1.0),
        "status is neither": with_head(arrays, status="best"),
        "levels is not in": with_head(arrays, levels=0),
        "level 1, pixel 2": arrays | {"level_1_ranges": second},
        f"{level}_allowed of pixel[0]": arrays | {last: np.zeros_like(arrays[last])},
        "level_0_share_steps has another": arrays | {"level_0_allowed": np.packbits(without_first)},
        "level_0_allowed of pixel 0": with_allowed(arrays, 0, without_first),
        "alpha[1] is outside": arrays | {"alpha": arrays["alpha"] + [0, 2, 0, 0]},
        "beta[3] is beyond": arrays | {"beta": arrays["beta"] + [0, 0, 0, 1]},
        "level_0_h holds something": arrays | {"level_0_h": np.array([np.nan])},
        "has no array level_1_h": {name: arrays[name] for name in arrays if name != "level_1_h"},
        "instance_w[0] is not in": arrays | {"instance_w": arrays["instance_w"] * 3},
    }
    for place, bad in cases.items():
        text = refusal(bad)
        assert place in text
        assert "\n" not in text


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
    with pytest.raises(InputError, match=r"it\.npz: would hold a proof that is not valid: level 1, pixel 0"):
        write_certificate(replace(proof, arrays=less), path, force=True)
    assert path.read_bytes() == b"kept"


def test_unreadable_and_unsafe_files_are_refused(tmp_path, written):
    path = tmp_path / "it.npz"
    _, arrays = written(1)
    pickled = tmp_path / "pickled.npz"
    np.savez(pickled, head=np.array([{}], dtype=object))
    with zipfile.ZipFile(tmp_path / "long.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("head.npy", b"\x93NUMPY\x01\x00" + bytes(1 << 20))
    path.write_bytes(pack_arrays(arrays)[:-30])
    for bad in (path, pickled, tmp_path / "long.npz", tmp_path / "absent.npz"):
        assert check_certificate.main([str(bad)]) == 2
    with pytest.raises(InputError, match=r"it\.npz: is not a certificate: is no \.npz that can be read"):
        read_certificate(path)


def test_what_numpy_writes_is_a_certificate_too(written, tmp_path):
    path, _ = written(1)
    other = tmp_path / "other.npz"
    for save in (np.savez, np.savez_compressed):
        other.write_bytes(of_numpy(path.read_bytes(), save))
        assert read_certificate(other).bound == read_certificate(path).bound


def test_a_forged_archive_is_refused_or_has_the_arrays_that_numpy_loads(written, tmp_path, capsys, subtests):
    path, arrays = written(1)
    other, accepted = tmp_path / "other.npz", set()
    for forgery, forge in forged("alpha").items():
        with subtests.test(forgery):
            other.write_bytes(forge(path.read_bytes()))
            try:
                unpacked = check_certificate.read_arrays(str(other))
                check_certificate.check_arrays(unpacked)
            except WRONG:
                assert check_certificate.main([str(other)]) == 2
                assert capsys.readouterr().out.startswith("unreadable: ")
                with pytest.raises(InputError, match=r"other\.npz: is not a certificate: "):
                    read_certificate(other)
                continue
            accepted.add(forgery)
            with np.load(other, allow_pickle=False) as loaded:
                assert set(loaded) == set(unpacked) == set(arrays)
                for name in loaded:
                    np.testing.assert_array_equal(loaded[name], unpacked[name])
    assert accepted <= {"a larger member than there is", "a header with a key twice"}


@pytest.mark.parametrize("second", ["head.NPY", "HEAD.npy", "head.bin", "head.npy"])
def test_a_second_head_cannot_claim_twice_the_energy(second, written, tmp_path, capsys):
    """One reader opens `head.npy`; another may take the last member, or cut the suffixes of names."""
    path, arrays = written(1)
    twice = 2 * read_certificate(path).energy
    claims = members_of(pack_arrays(with_head(arrays, energy=twice, bound=twice, status="optimal")))
    honest = members_of(path.read_bytes())["head.npy"]
    spare = "x" * len(second)
    data = packed([*claims.items(), (spare, honest)]).replace(spare.encode(), second.encode())
    other = tmp_path / "other.npz"
    other.write_bytes(data)
    assert check_certificate.main([str(other)]) == 2
    assert invoke(["prove", "--check", str(other)]) == 1
    assert "is not a certificate" in capsys.readouterr().err


@pytest.mark.parametrize("second", ["instance_head.NPY", "instance_head.bin"])
def test_a_proof_for_another_instance_is_refused(second, written, tmp_path):
    """The instance shown would be the other one, and the instance checked the one that was proven."""
    path, arrays = written(1)
    shown = json.loads(arrays["instance_head"].tobytes()) | {"w_beta": 0.5}
    instance = replace(proven(1).field.instance, skew_coefficient=0.5)
    members = members_of(path.read_bytes())
    text = np.frombuffer(json.dumps(shown).encode(), np.uint8)
    other = tmp_path / "other.npz"
    other.write_bytes(packed([*(members | {"instance_head.npy": npy(text)}).items(),
                              (second, members["instance_head.npy"])]))  # fmt: skip
    with pytest.raises(InputError, match="is not a certificate"):
        read_certificate(other, on=instance)
    with pytest.raises(InputError, match="is a certificate of another instance"):
        read_certificate(path, on=instance)


def test_an_instance_that_would_be_rounded_has_no_certificate(written, tmp_path):
    """The certificate would be of directions that the instance no longer has once it is read."""
    _, arrays = written(1)
    path = tmp_path / "it.npz"
    for name, change in (
        ("instance_theta", lambda theta: theta + 3e-14),
        ("instance_origin", lambda origin: origin + 1 / 3),
    ):
        path.write_bytes(pack_arrays(arrays | {name: change(arrays[name])}))
        with pytest.raises(InstanceError, match=f"it.npz: array '{name}' is not as crossfield writes it"):
            read_certificate(path)


def test_the_text_of_a_certificate_has_each_key_once(written):
    _, arrays = written(1)
    text = arrays["head"].tobytes().replace(b"{", b'{"bound": 1.0, ', 1)
    assert "a repeated key" in refusal(arrays | {"head": np.frombuffer(text, np.uint8)})
    assert "levels is no whole number" in refusal(with_head(arrays, levels=1.5))


def test_more_levels_than_claimed_are_refused(written, tmp_path):
    _, arrays = written(1)
    path = tmp_path / "it.npz"
    path.write_bytes(pack_arrays(with_head(arrays, levels=1, status="gap", bound=0.0)))
    with pytest.raises(
        InputError, match=r"has an array level_1_\w+ too many for a certificate with 1 levels"
    ):
        read_certificate(path)


def test_the_checker_is_one_file_on_numpy_and_the_standard_library(written, tmp_path):
    imported = set()
    for node in ast.walk(ast.parse(PROGRAM.read_text())):
        if isinstance(node, ast.Import):
            imported |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            imported.add(str(node.module).split(".")[0])
    assert imported - {"numpy"} <= sys.stdlib_module_names
    alone = tmp_path / "alone.py"
    alone.write_bytes(PROGRAM.read_bytes())
    path, arrays = written(1)
    # -S: nothing that a .pth file leads to can be imported; nor crossfield where it lies beside numpy.
    start = (
        "import runpy, sys; sys.path.append(sys.argv.pop(1)); sys.argv.pop(0); "
        "sys.modules['crossfield'] = None; "
        "runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(pack_arrays(with_head(arrays, bound=1.0)))
    for file, code, line in (
        (path, 0, "optimal: "),
        (wrong, 1, "refused: bound"),
        (alone, 2, "unreadable: "),
    ):
        site = Path(np.__file__).parents[1]
        command = [sys.executable, "-I", "-S", "-c", start, str(site), str(alone), str(file)]
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
    """F: the best jump at every pair, the nearer line at every stroke."""
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
    lines = np.stack([alpha + beta, alpha + np.pi / 2 - beta])[:, at] - instance.target
    away = np.min(np.abs(lines - np.pi * np.round(lines / np.pi)), axis=0)
    return (
        pairs.sum()
        + instance.stroke_coefficient * (instance.w @ size(away))
        + instance.skew_coefficient * size(beta).sum()
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
        energies = np.array([free_energy(instance, *cross.T) for cross in crosses])
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
    terms, _ = check_certificate.terms_of(arrays)
    level = check_certificate.level_of(arrays, 0, terms)
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


@pytest.mark.slow
@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_boxes_over_the_edges_of_windows_are_cut_and_bounded(norm, written):
    """At random crosses in boxes over edges or beyond, no energy is below the bound, and one is close."""
    rng, cut = np.random.default_rng(4), 0
    for seed in (1, 3, 4, 7):
        _, arrays = written(seed)
        (terms, _), proof = check_certificate.terms_of(arrays), proven(seed)
        terms.norm = norm
        for away in (0.0, 0.0, 0.0, 0.0, 0.15, 0.3):
            edge = terms.theta[0] + rng.choice([-1, 1]) * (np.pi / 4 + away)
            alpha = edge + rng.normal(0, 0.02, 4)
            beta = rng.choice([-1, 1]) * rng.uniform(0.3, 0.75, 4)
            sides = rng.uniform(0.01, 0.1, (2, 4))
            high = np.minimum(beta + sides[1], np.pi / 4)
            boxes = np.stack([alpha - sides[0], alpha + sides[0], beta - sides[1], high], axis=1)
            p = np.zeros(len(terms.first), int)
            step = check_certificate.last_step(terms, boxes, alpha, p)
            best, _, pieces = minimise_on_boxes(proof.field.instance, terms, step, 1e6)
            low, size = boxes[:, ::2], boxes[:, 1::2] - boxes[:, ::2]
            points = low + rng.random((400, 4, 2)) ** rng.choice([0.1, 1, 10], (400, 1, 1)) * size
            points = [*points, np.stack([best.alpha, best.beta], axis=1)]
            energies = [free_energy(proof.field.instance, *point.T, norm) for point in points]
            for noise in (0.0, 0.1):
                shaken = pieces["multipliers"] + rng.normal(0, noise, pieces["multipliers"].shape)
                parts = pieces | {"multipliers": shaken}
                bound = least_bound(terms, step, parts)
                assert bound <= min(energies) + 1e-9
                assert noise or bound > min(energies) - 0.5
            cut += len(pieces["cuts"]) > 1
    assert cut > 5


@pytest.mark.parametrize("norm", [2, 1, "mixed"])
def test_boxes_with_open_jumps_are_divided_and_bounded(norm, written):
    """In boxes so wide that several jumps are open, no energy is below the bound, and one is close."""
    rng, divided = np.random.default_rng(5), 0
    for seed in (1, 3, 4):
        _, arrays = written(seed)
        (terms, _), instance = check_certificate.terms_of(arrays), proven(seed).field.instance
        terms.norm, n = norm, len(terms.white)
        for _ in range(4):
            middle, sides = rng.uniform(-0.5, 0.5, (2, n)), rng.uniform(0.1, 0.6, (2, n))
            high = np.clip(middle[1] + sides[1], -np.pi / 4, np.pi / 4)
            low = np.clip(middle[1] - sides[1], -np.pi / 4, np.pi / 4)
            boxes = np.stack([middle[0] - sides[0], middle[0] + sides[0], low, high], axis=1)
            step = check_certificate.last_step(terms, boxes, middle[0], np.zeros(len(terms.first), int))
            points = boxes[:, ::2] + rng.random((2000, n, 2)) * (boxes[:, 1::2] - boxes[:, ::2])
            least = min(free_energy(instance, *point.T, norm) for point in points)
            best, bound, pieces = minimise_on_boxes(instance, terms, step, least)
            assert least_bound(terms, step, pieces) == bound <= least
            if (step.whole_piece.weights(terms, step.theta)[2] == terms.weight).all():
                close = free_energy(instance, best.alpha, best.beta, norm)
                assert bound >= min(least, close) - 1e-6
            jumps = np.flatnonzero(pieces["cuts"] >= n)
            for at in jumps[:1]:
                assert pieces["cuts"][at + 1] < pieces["cuts"][at + 2]
                fewer = pieces["cuts"].copy()
                fewer[at + 2] -= 1
                with pytest.raises(check_certificate.NotProvenError, match="leaves out jumps"):
                    least_bound(terms, step, pieces | {"cuts": fewer})
            divided += len(jumps) > 0
    assert divided > 5


def test_a_forced_jump_is_that_of_the_certified_field(written):
    """Where the field has another jump than all better ones, none is forced: it would be fixed wrongly."""
    rng, forced, other = np.random.default_rng(8), 0, 0
    for seed in (1, 3, 4):
        _, arrays = written(seed)
        (terms, _), instance = check_certificate.terms_of(arrays), proven(seed).field.instance
        n, m, alpha = len(terms.white), len(terms.first), arrays["alpha"]
        for _ in range(4):
            sides = rng.uniform(0.1, 0.6, (2, n))
            boxes = np.stack([alpha - sides[0], alpha + sides[0], -sides[1], sides[1]], axis=1)
            p = rng.integers(-1, 2, m).astype(np.int32)
            step = check_certificate.last_step(terms, boxes, alpha, p.astype(int))
            points = boxes[:, ::2] + rng.random((2000, n, 2)) * (boxes[:, 1::2] - boxes[:, ::2])
            energies = np.array([free_energy(instance, *point.T) for point in points])
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
    assert forced > 5
    assert other > 5
