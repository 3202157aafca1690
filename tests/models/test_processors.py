"""The same instances on every kind of processor: other kernels of OpenBLAS, NumPy without its faster loops,
a C library without FMA.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from crossfield.models.instance.angles import arctangent, cosine, sine
from processors import PROCESSORS

HASHES = """
import json, sys
import crossfield as cf
from crossfield.models.sketch.samples import SAMPLES
names = [name for name in SAMPLES if name not in {"skew", "saddle", "singular"}]
hashes = {name: cf.sample(name, 10).sha256 for name in names}
part = cf.read_mesh(sys.argv[1], sharp=20, weights="dual")
print(json.dumps(hashes | {"part": [part.sha256, part.mesh.kappa.tolist(), part.mesh.dihedral.tolist()]}))
"""
PART = """
v 0 0 0
v 1.1 0.3 0.2
v 0.2 0.9 -0.4
v 0.3 0.2 1.7
v 1.3 1.2 1.6
f 1 3 2
f 1 2 4
f 3 1 4
f 2 3 5
f 4 2 5
f 3 4 5
"""


def hashes_on(processor, mesh):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", HASHES, str(mesh)],
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | processor,
        stdout=subprocess.PIPE,
        check=True,
    )
    return json.loads(done.stdout)


@pytest.mark.slow
def test_samples_and_meshes_are_the_same_on_every_processor(tmp_path):
    (tmp_path / "part.obj").write_text(PART)
    first, *others = (hashes_on(processor, tmp_path / "part.obj") for processor in PROCESSORS)
    assert len(first) == 12
    for processor, other in zip(PROCESSORS[1:], others, strict=True):
        assert other == first, processor


def test_elementary_functions_are_right():
    rng = np.random.default_rng(0)
    angle = np.concatenate(
        [rng.uniform(-7, 7, 10_000), rng.uniform(-1e6, 1e6, 10_000), np.arange(-8, 9) * np.pi / 4]
    )
    assert sine(angle) == pytest.approx(np.sin(angle), rel=0, abs=1e-15)
    assert cosine(angle) == pytest.approx(np.cos(angle), rel=0, abs=1e-15)
    y, x = rng.normal(size=(2, 10_000)) * 10.0 ** rng.integers(-9, 10, (2, 10_000))
    y, x = np.concatenate([y, [0, 0, 0, 1, -1, 1]]), np.concatenate([x, [0, 1, -1, 0, 0, 1]])
    assert arctangent(y, x) == pytest.approx(np.arctan2(y, x), rel=1e-15, abs=1e-15)
