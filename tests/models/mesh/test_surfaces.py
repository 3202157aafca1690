"""Fields on surfaces: what does not depend on frames, and what the topology fixes."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.field.field import CrossField
from crossfield.models.instance.angles import HALF
from crossfield.models.mesh.shapes import MESHES

pytestmark = pytest.mark.numeric
CLOSED = [
    name for name in MESHES if name not in {"disc", "star", "plate", "bump", "half_torus", "three_parts"}
]


def random_jumps(instance, seed):
    """A field with random angles, and jumps that are best or one beside them."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(instance.alpha_lower, instance.alpha_upper)
    beta = np.zeros(len(alpha)) if instance.orthogonal else rng.uniform(-0.7, 0.7, len(alpha))
    best = CrossField(instance, alpha, beta, np.zeros(len(instance.domain.first), int)).with_best_jumps()
    return replace(best, p=best.p + rng.integers(-1, 2, len(best.p)))


@pytest.mark.parametrize("name", CLOSED)
def test_indices_add_up_to_the_euler_characteristic(name):
    instance = cf.sample(name)
    for seed in range(3):
        index = random_jumps(instance, seed).singularities.index
        assert index.sum() == instance.mesh.euler_characteristic
        assert (4 * index == np.round(4 * index)).all()


@pytest.mark.parametrize("name", ["cube", "plate", "half_torus"])
@pytest.mark.parametrize("orthogonal", [True, False])
def test_energies_do_not_depend_on_the_frames(name, orthogonal):
    """The first corner of each face is another one: angles turn with the frame, jumps and residuals stay."""
    instance = replace(cf.sample(name), orthogonal=orthogonal, skew_coefficient=0.5)
    mesh, field = instance.mesh, random_jumps(instance, 5)
    shift = np.random.default_rng(6).integers(0, 3, mesh.size)
    faces = np.take_along_axis(mesh.faces, (np.arange(3) + shift[:, None]) % 3, axis=1)
    other = replace(mesh, faces=faces)
    every = np.arange(mesh.size)
    turn = other.angle_in(every, mesh.frames[:, 0])  # of the old x axis in the new frame
    theta = instance.theta + turn[instance.stroke_index]
    moved = replace(instance, domain=other, theta=theta)
    # Pairs keep their order and orientation only up to the vertices of their edge.
    key = {tuple(ends): number for number, ends in enumerate(mesh.pair_vertices.tolist())}
    place = [key[tuple(ends)] for ends in other.pair_vertices.tolist()]
    old = mesh.kappa[place] + HALF * field.p[place]
    alpha = field.alpha + turn
    whole = (old - other.kappa - turn[other.first] + turn[other.second]) / HALF
    jumps = np.round(whole)
    assert whole == pytest.approx(jumps, abs=1e-8)
    same = CrossField(moved, alpha, field.beta, jumps.astype(int))
    assert np.sort(same.residual_a) == pytest.approx(np.sort(field.residual_a), abs=1e-8)
    assert same.energy().smooth == pytest.approx(field.energy().smooth)
    assert same.singularities.vertex.tolist() == field.singularities.vertex.tolist()
    assert same.singularities.index.tolist() == field.singularities.index.tolist()
    # A turn by a multiple of pi/2 exchanges the lines of a cross, so strokes count alike only modulo pi.
    assert np.sin(same.residual_r - field.residual_r) == pytest.approx(0, abs=1e-8)
