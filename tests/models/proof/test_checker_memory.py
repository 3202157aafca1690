"""Memory that the checker of certificates takes: no more than the size of a file justifies."""

import json
import subprocess
import sys

import crossfield as cf
import numpy as np
import pytest
from archives import pack_arrays
from crossfield.models.proof.checkers import check_certificate, check_orthogonal
from exhaustive import optimum, random_instance, sketch
from orthogonal_certificates import certificate_at
from proofs_round_fields import prove_round

if not sys.platform.startswith("linux"):
    pytest.skip("needs /proc", allow_module_level=True)

TWO_GB = 2 << 30

MEASURED = f"""
import resource, sys
import {check_certificate.__name__} as base, {check_orthogonal.__name__} as orthogonal
def peak():
    return int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) * 1024
limit, checker, *given = sys.argv[1:]
before = peak()
if int(limit):
    now = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + int(limit), now + int(limit)))
code = base.main(given, {{"base": base, "orthogonal": orthogonal}}[checker].check_bytes)
print(code, peak() - before)
"""


def checked(path, limit=0, checker="base"):
    """Output and exit code of a checker in a process of its own, and the memory that it took.

    limit: of the address space, beyond what the process has before; 0 for none.
    """
    command = [sys.executable, "-c", MEASURED, str(limit), checker, str(path)]
    *text, last = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return "\n".join(text), *map(int, last.split())


@pytest.fixture(scope="module")
def arrays(tmp_path_factory):
    """The arrays of a certificate of two pixels and one level, by whether there is a pair."""
    folder, by_pair = tmp_path_factory.mktemp("certificates"), {}
    for pair in (False, True):
        instance = random_instance(0, (1, 2), 2) if pair else sketch(np.ones((1, 1), bool), np.ones((1, 1)))
        cf.write_certificate(prove_round(optimum(instance), levels=1), folder / "it.npz")
        by_pair[pair] = check_certificate.unpack_arrays((folder / "it.npz").read_bytes())
    return by_pair


def with_labels(arrays, alphas, betas):
    """The arrays with so many allowed labels at each pixel, and shares of 0."""
    n, pairs = len(arrays["alpha"]), len(arrays["p"])
    first = [-(alphas // 2), alphas, -(betas // 2), betas]
    return arrays | {
        "level_0_h": np.array([np.pi / 2 / 1024]),
        "level_0_ranges": np.tile(np.array(first, np.int32), (n, 1)),
        "level_0_allowed": np.packbits(np.ones(n * alphas * betas, bool)),
        "level_0_share_steps": np.zeros(pairs * alphas * betas, np.int32),
    }


def test_a_small_file_cannot_ask_for_much_memory(arrays, tmp_path):
    path = tmp_path / "it.npz"
    mask = np.ones((4000, 4000), bool)
    for name, forged in {
        "labels of a pixel": with_labels(arrays[False], 4095, 4095),
        "labels": with_labels(arrays[True], 3000, 2000),
        "pixels": arrays[True] | {"instance_mask": mask},
        "tables": arrays[True] | {"level_0_table_steps": np.zeros(9_000_000, np.int32)},
    }.items():
        path.write_bytes(pack_arrays(forged))
        size = path.stat().st_size
        text, code, memory = checked(path, TWO_GB)
        assert (code, size < 500_000) == (2, True), (name, text)
        assert "a file of its size may" in text, name
        assert memory <= check_certificate.ROOM + check_certificate.MORE_ROOM * size, name
        with pytest.raises(cf.InputError, match="a file of its size may"):
            cf.read_certificate(path)


def test_a_level_takes_no_more_memory_than_is_allowed(arrays, tmp_path):
    path, most = tmp_path / "it.npz", 1400
    for name, forged in {
        "one pixel": with_labels(arrays[False], most, most // 2),
        "both": with_labels(arrays[True], 500, 500),
    }.items():
        counts = forged["level_0_ranges"][:, 1::2]
        spacing = {"level_0_h": np.array([np.pi / 2 / (counts.min() - 8)])}
        path.write_bytes(pack_arrays(forged | spacing))
        text, code, memory = checked(path, TWO_GB)
        allowed = check_certificate.level_memory(counts, forged["level_0_share_steps"].size, 0)
        assert code == 0, (name, text)
        assert memory <= allowed + (20 << 20), name


def test_a_level_that_covers_too_little_is_refused_before_its_pass(arrays, tmp_path, monkeypatch):
    coarse, fine = arrays[True], with_labels(arrays[True], 300, 300)
    head = json.loads(coarse["head"].tobytes()) | {"levels": 2}
    forged = {name.replace("level_0", "level_1"): array for name, array in fine.items()} | coarse
    forged |= {"head": np.frombuffer(json.dumps(head).encode(), np.uint8)}
    passes, complete = [], check_certificate.pass_level
    monkeypatch.setattr(check_certificate, "pass_level", lambda task: passes.append(task) or complete(task))
    with pytest.raises(check_certificate.NotProvenError, match="level_1_h"):
        check_certificate.check_arrays(forged)
    assert len(passes) == 1


def orthogonal_pixels(count, divisions):
    """Arrays of a certificate of some pixels in a row, with a level of so many cells and shares of 0."""
    mask, at = np.ones((1, count), bool), np.zeros((1, 2), int)
    instance = cf.Instance.on_pixels("row", mask, at, np.array([0.3]), np.ones(1), orthogonal=True)
    arrays, pairs = certificate_at(instance, np.zeros(count, int), 3), count - 1
    return arrays | {
        "divisions": np.array([divisions], np.int32),
        "level_0_shares": np.zeros(pairs * (divisions + 1), np.int32),
        "level_0_squares": np.zeros(0, np.uint8),  # not read of the last level
    }


@pytest.mark.parametrize("count, divisions", [(2, 10_000), (200_000, 3)])
def test_a_small_orthogonal_certificate_cannot_ask_for_much_memory(count, divisions, tmp_path):
    path = tmp_path / "it.npz"
    arrays = orthogonal_pixels(2, divisions) if count == 2 else orthogonal_pixels(2, 3)
    if count > 2:
        arrays |= {"instance_mask": np.ones((count // 100, 100), bool)}
    path.write_bytes(pack_arrays(arrays))
    size = path.stat().st_size
    text, code, memory = checked(path, TWO_GB, "orthogonal")
    assert (code, size < 50_000) == (2, True), text
    assert memory <= check_certificate.memory_for(size, check_orthogonal.MORE_ROOM)
    with pytest.raises(cf.InputError, match="a file of its size may"):
        cf.read_certificate(path)


def test_many_large_levels_in_a_small_file_are_refused():
    levels, arrays = 20, orthogonal_pixels(2, 300)
    of_level = {name.removeprefix("level_0_"): arrays[name] for name in arrays if name.startswith("level_0_")}
    of_level["squares"] = np.packbits(np.ones(300 * 300, bool))
    arrays |= {"divisions": np.full(levels, 300, np.int32)}
    arrays |= {f"level_{k}_{name}": array for k in range(levels) for name, array in of_level.items()}
    rows = check_orthogonal.CentredRows(arrays)
    of_one = check_orthogonal.level_memory(rows, np.array([300, 300, 1]))
    assert len(check_orthogonal.check_arrays(arrays, memory=3 * of_one).levels) == levels
    with pytest.raises(check_certificate.UnreadableError, match="larger levels than a file of its size may"):
        check_orthogonal.check_arrays(arrays, memory=2 * of_one)


@pytest.mark.parametrize("count, divisions", [(2, 1200), pytest.param(1500, 15, marks=pytest.mark.slow)])
def test_an_orthogonal_level_takes_no_more_memory_than_is_allowed(count, divisions, tmp_path):
    path = tmp_path / "it.npz"
    arrays = orthogonal_pixels(count, divisions)
    path.write_bytes(pack_arrays(arrays))
    text, code, memory = checked(path, TWO_GB, "orthogonal")
    counts = np.append(np.full(count, divisions), 1)
    allowed = check_orthogonal.level_memory(check_orthogonal.CentredRows(arrays), counts)
    assert code == 0, text
    assert memory <= allowed + (20 << 20)


def test_too_little_memory_is_no_damage(tmp_path):
    """The certificate is valid: with more memory, the test above accepts it."""
    path = tmp_path / "it.npz"
    path.write_bytes(pack_arrays(orthogonal_pixels(2, 1200)))
    text, code, _ = checked(path, 60 << 20, "orthogonal")  # OpenBLAS alone takes up to half of that
    assert (code, text) == (3, f"unchecked: {path} takes more memory than there is")
