"""Memory that the checker of certificates takes: no more than the size of a file justifies."""

import subprocess
import sys

import numpy as np
import pytest
from crossfield.models.array_archive import pack_arrays
from crossfield.models.errors import InputError
from crossfield.models.proof import check_certificate
from crossfield.models.proof.certificate import read_certificate, write_certificate
from exhaustive import optimum, random_instance, sketch
from proofs_round_fields import prove_round

pytest.importorskip("resource")  # of POSIX

MEASURED = f"""
import resource, sys
import {check_certificate.__name__} as program
limit, *given = sys.argv[1:]
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
if int(limit):
    now = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + int(limit), now + int(limit)))
code = program.main(given)
print(code, (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024)
"""


def checked(path, limit=0):
    """Output and exit code of the checker in a process of its own, and the memory that it took.

    limit: of the address space, beyond what the process has before; 0 for none.
    """
    command = [sys.executable, "-c", MEASURED, str(limit), str(path)]
    *text, last = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return "\n".join(text), *map(int, last.split())


@pytest.fixture(scope="module")
def arrays(tmp_path_factory):
    """The arrays of a certificate of two pixels and one level, by whether there is a pair."""
    folder, by_pair = tmp_path_factory.mktemp("certificates"), {}
    for pair in (False, True):
        instance = random_instance(0, (1, 2), 2) if pair else sketch(np.ones((1, 1), bool), np.ones((1, 1)))
        write_certificate(prove_round(optimum(instance), levels=1), folder / "it.npz")
        by_pair[pair] = check_certificate.read_arrays(str(folder / "it.npz"))
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
        "alphas of a pair": with_labels(arrays[True], 4096, 2),
        "pixels": arrays[True] | {"instance_mask": mask},
        "tables": arrays[True] | {"level_0_table_steps": np.zeros(9_000_000, np.int32)},
        "steps": arrays[True] | {"level_0_share_steps": np.zeros(25_000_000, np.int32)},
    }.items():
        path.write_bytes(pack_arrays(forged))
        size = path.stat().st_size
        text, code, memory = checked(path)
        assert (code, size < 500_000) == (2, True), (name, text)
        assert "a file of its size may" in text, name
        assert memory <= check_certificate.ROOM + check_certificate.MORE_ROOM * size, name
        with pytest.raises(InputError, match=r"more than a file of its size may|larger arrays than"):
            read_certificate(path)


def test_too_little_memory_is_no_damage(arrays, tmp_path):
    path = tmp_path / "it.npz"
    path.write_bytes(pack_arrays(with_labels(arrays[True], 600, 400)))
    text, code, _ = checked(path, 20 << 20)
    assert (code, text) == (3, f"unchecked: {path} takes more memory than there is")
