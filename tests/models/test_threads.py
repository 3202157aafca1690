"""Methods on a grid of more than 10,000 unknowns, from where on BLAS takes several threads for a product of
two vectors: they let it take one, so that digits depend on no number of threads, and busy neighbours cost
nothing but their share.
"""

import json
import os
import subprocess
import sys

import pytest

PROGRAM = """
import hashlib, json, time
import crossfield as cf
from crossfield.models.search.angle_program import fit_absolute
from crossfield.models.search.box_qp import FreeField, fit_in_box
from crossfield.models.instance.sparse_systems import SimilarSystems
from crossfield.models.search.improvement import settle
from crossfield.models.search.starts import first_field

instance = cf.sample("ring", 108)
assert 2 * instance.grid.size > 10_000
power = cf.power_field(instance)

def settled():
    state = FreeField.of(power)
    settle(state, SimilarSystems())
    return state.fit_in_bounds()

methods = {
    "power": lambda: cf.power_field(instance), "polyvector": lambda: cf.polyvector_field(instance),
    "bend": lambda: cf.bend_field(power), "greedy": lambda: cf.greedy_field(instance),
    "improved": lambda: cf.improved_field(power), "fitted": lambda: fit_in_box(power), "settled": settled,
    "fitted_1norm": lambda: fit_absolute(power, 1)[0], "first": lambda: first_field(instance),
    "surface": lambda: cf.surface(power),
}
results = {}
for name, method in methods.items():
    whole, mine = time.process_time(), time.thread_time()
    found = method()
    others = (time.process_time() - whole) - (time.thread_time() - mine)
    arrays = [found.heights] if name == "surface" else [found.alpha, found.beta, found.p]
    digest = hashlib.sha256(b"".join(each.tobytes() for each in arrays)).hexdigest()
    results[name] = [digest, others, time.thread_time() - mine]
print(json.dumps(results))
"""


@pytest.mark.slow
def test_methods_run_in_one_thread_whatever_blas_may_take():
    results = {}
    for threads in ("1", "4"):
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads}
        command = [sys.executable, "-c", PROGRAM]
        output = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
        results[threads] = json.loads(output)
    assert len(results["1"]) == 10
    for name, (digest, others, mine) in results["4"].items():
        assert digest == results["1"][name][0], name
        assert others < 0.1 + 0.1 * mine, name  # seconds of CPU, not of a clock
