"""Methods on a grid of more than 10,000 unknowns, from where on BLAS takes several threads for a product of
two vectors: they let it take one, so that digits depend on no number of threads.
"""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import hashlib, time
import crossfield as cf

instance = cf.sample("ring", 108)
assert 2 * instance.grid.size > 10_000
power = cf.power_field(instance)
methods = {
    "power": lambda: power, "polyvector": lambda: cf.polyvector_field(instance),
    "bend": lambda: cf.bend_field(power), "greedy": lambda: cf.greedy_field(instance),
    "improved": lambda: cf.improved_field(power), "surface": lambda: cf.surface(power),
}
whole, mine = time.process_time(), time.thread_time()
for name, method in methods.items():
    found = method()
    arrays = [found.heights] if name == "surface" else [found.alpha, found.beta, found.p]
    print(name, hashlib.sha256(b"".join(each.tobytes() for each in arrays)).hexdigest())
mine = time.thread_time() - mine
assert time.process_time() - whole - mine < 0.5 + 0.1 * mine  # CPU seconds of other threads
"""


@pytest.mark.slow
def test_methods_run_in_one_thread_whatever_blas_may_take():
    one, four = (
        subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env=os.environ | {"OPENBLAS_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in ("1", "4")
    )
    assert one.count("\n") == 6
    assert one == four
