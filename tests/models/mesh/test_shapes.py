"""The built-in meshes are oriented manifolds of the shapes that their names say, and hold indices so."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest

EULER = {
    "disc": 1, "star": 1, "plate": -1, "cube": 2, "bracket": 0, "stairs": 2, "pin": 2, "flange": 0, "gear": 2,
    "bump": 0, "half_torus": 0, "doughnut": 0, "three_parts": 2 + 0 + 1,
}  # fmt: skip
FLAT = ("disc", "star", "plate")


@pytest.mark.parametrize("name", EULER)
def test_built_in_meshes_have_the_topology_of_their_shape(name):
    mesh = cf.sample(name).mesh
    mesh.check()
    assert mesh.euler_characteristic == EULER[name]
    # Gauss and Bonnet: the defects inside and the turns of the boundary make 2 pi for each unit of it.
    boundary = mesh.on_boundary
    turns = mesh.defect[boundary] - np.pi
    assert mesh.defect[~boundary].sum() + turns.sum() == pytest.approx(2 * np.pi * EULER[name])
    assert mesh.parts == (3 if name == "three_parts" else 1)


@pytest.mark.parametrize("name", FLAT)
def test_flat_sheets_face_upwards(name):
    assert (cf.sample(name).mesh.normals[:, 2] > 0).all()


CLOSED = sorted(set(EULER) - {*FLAT, "bump", "half_torus", "three_parts"})


@pytest.mark.parametrize("name", CLOSED)
def test_closed_bodies_have_their_normals_outside(name):
    mesh = cf.sample(name).mesh
    first, second, third = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    assert (first * np.cross(second, third)).sum() / 6 > 0  # the volume


@pytest.mark.parametrize("name", CLOSED)
def test_indices_add_up_to_the_euler_characteristic(name):
    """For any angles and jumps, best ones and others."""
    instance = cf.sample(name)
    rng = np.random.default_rng(1)
    u = rng.uniform(0, np.pi, instance.mesh.size)
    best = cf.CrossField.from_lines(instance, u, u + np.pi / 2)
    index = replace(best, p=best.p + rng.integers(-1, 2, len(best.p))).singularities.index
    assert index.sum() == instance.mesh.euler_characteristic
    assert (4 * index == np.round(4 * index)).all()
