"""Small random instances of orthogonal crosses, and their optima by trying all integers."""

from __future__ import annotations

import itertools
import math

import crossfield as cf
import numpy as np
from crossfield.models.orthogonal.energy import OrthogonalEnergy
from crossfield.models.processes.deadline import Deadline, never, silent
from crossfield.models.proof.certificate import check_proof
from crossfield.models.proof.checkers import check_orthogonal as checker
from crossfield.models.proof.descent.descent import Termination
from crossfield.models.proof.descent.orthogonal import _Prover
from scipy.spatial import ConvexHull, Delaunay


def random_mesh(rng, vertices):
    """A triangulated sheet over random points, bent in space."""
    flat = rng.uniform(-1, 1, (vertices, 2))
    faces = Delaunay(flat).simplices
    corner = flat[faces]
    one, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    turned = one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0]
    faces[turned] = faces[turned][:, ::-1]
    faces = np.array([np.roll(face, rng.integers(3)) for face in faces])
    return cf.Mesh(np.c_[flat, rng.uniform(-1, 1, vertices)], faces.astype(np.int32))


def random_instance(seed, *, grid=False):
    """An instance on 3 to 12 points, with any strokes and weights; on pixels or on a sheet."""
    rng = np.random.default_rng(seed)
    more = {"stroke_coefficient": float(rng.choice([0.3, 1, 20])), "orthogonal": True}
    if grid:
        mask = rng.random((3, 3)) < 0.85
        mask[1, 1] = True
        points = np.argwhere(mask)
    else:
        mesh = random_mesh(rng, int(rng.integers(5, 8)))
        points = np.arange(mesh.size)
        if rng.random() < 0.5:
            more["pair_weights"] = rng.uniform(0.2, 3, len(mesh.first))
    count = int(rng.integers(1 if grid else 0, 4))
    chosen = np.sort(rng.choice(len(points), min(count, len(points)), replace=False))
    strokes = rng.uniform(0, np.pi, len(chosen)), rng.uniform(0.2, 1, len(chosen))
    if grid:
        return cf.Instance.on_pixels("small", mask, points[chosen], *strokes, **more)
    return cf.Instance.on_faces("small", mesh, chosen, *strokes, **more)


def fan(faces=5, bend=0.4):
    """Faces around a vertex, two of them with strokes that no field follows exactly."""
    around = np.arange(faces) * 2 * np.pi / faces
    rim = np.c_[np.cos(around), np.sin(around), bend * np.cos(2 * around)]
    rolled = [np.roll([0, 1 + k, 1 + (k + 1) % faces], k) for k in range(faces)]
    mesh = cf.Mesh(np.vstack([np.zeros(3), rim]), np.array(rolled, np.int32))
    return cf.Instance.on_faces(
        "fan", mesh, np.array([0, 2]), np.array([0.3, 1.2]), np.ones(2), orthogonal=True
    )


def strokeless(mesh, **more):
    """An instance on a mesh without strokes."""
    none = np.zeros(0)
    return cf.Instance.on_faces("strokeless", mesh, none.astype(int), none, none, orthogonal=True, **more)


def random_hull(seed, points=6, stretch=(1, 1, 1)):
    """The hull of random points round the origin, with any first corners of faces."""
    rng = np.random.default_rng(seed)
    at = rng.normal(size=(points, 3))
    at *= np.array(stretch) / np.linalg.norm(at, axis=1, keepdims=True)
    faces = ConvexHull(at).simplices
    inwards = np.linalg.det(at[faces] - at.mean(axis=0)) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    faces = np.array([np.roll(face, rng.integers(3)) for face in faces])
    return cf.Mesh(at, faces.astype(np.int32))


def torus_of_seven(genus=1):
    """Moebius' torus with seven vertices, which may lie anywhere; or two, joined at a face of each."""
    faces = [[i, (i + one) % 7, (i + other) % 7] for i in range(7) for one, other in ((1, 3), (3, 2))]
    if genus == 2:
        number = np.array([1, 0, 7, 3, 8, 9, 10])
        faces = np.append(faces[1:], number[faces[1:]], axis=0)
    at = np.random.default_rng(genus).normal(size=(np.max(faces) + 1, 3))
    return cf.Mesh(at, np.array(faces, np.int32))


def form_of_charges(mesh):
    """The energy of charges as a quadratic form, the turns of vertices, and the sum of charges.

    From angles of corners and vertices alone.
    """
    faces, count = mesh.faces, len(mesh.vertices)
    laplacian, defect = np.zeros((count, count)), np.full(count, 2 * np.pi)
    for a, b, c in [np.roll(face, k) for face in faces for k in range(3)]:
        sides = mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]
        cosine = sides[0] @ sides[1] / np.prod(np.linalg.norm(sides, axis=1))
        defect[a] -= np.arccos(np.clip(cosine, -1, 1))
        laplacian[a, b] -= 1
        laplacian[a, a] += 1
    return np.pi**2 / 2 * np.linalg.pinv(laplacian), 2 * defect / np.pi, 4 * count - 2 * len(faces)


def least_of_charges(mesh):
    """The least energy of all charges near those of smooth fields."""
    form, turns, total = form_of_charges(mesh)
    charges = np.array([*itertools.product(*(np.arange(np.ceil(turn - 1.5), turn + 1.5) for turn in turns))])
    charges = (charges - turns)[charges.sum(axis=1) == total]
    return np.einsum("kv,vw,kw->k", charges, form, charges, optimize=True).min()


def try_all_integers(instance, span=2):
    """The least energy of all integers, and integers that have it.

    Integers on a spanning forest of pairs and strokes can be 0 without loss; the others are tried from -span
    to span around their best values at the angles of the forest.
    """
    energy = OrthogonalEnergy.of(instance)
    free = beyond_forest(energy)
    inverse = np.linalg.pinv(energy.weighted_matrix(energy.weight).toarray())
    rows = energy.matrix.toarray()
    form = np.diag(energy.weight) - (energy.weight[:, None] * rows) @ inverse @ (rows.T * energy.weight)
    begin = energy.nearest(_forest_angles(energy, free))
    steps = np.array([*itertools.product(range(-span, span + 1), repeat=len(free))], int)
    z = np.repeat(begin[None], len(steps), axis=0)
    z[:, free] += steps
    offsets = energy.constant + np.pi / 2 * z
    totals = np.einsum("kr,rq,kq->k", offsets, form, offsets, optimize=True)
    if energy.sums is not None:
        totals[(energy.sums @ z.T != energy.turns_along[:, None]).any(axis=0)] = np.inf
    best = int(totals.argmin())
    assert not len(free) or (np.abs(steps[best]) < span).all()
    return float(totals[best]), z[best]


def beyond_forest(energy):
    root = list(range(energy.size + 1))

    def find(i):
        while root[i] != i:
            i = root[i]
        return i

    free = []
    for row, (i, j) in enumerate(zip(energy.first.tolist(), energy.second.tolist(), strict=True)):
        a, b = find(i), find(j)
        root[a] = b
        if a == b:
            free.append(row)
    return np.array(free, dtype=int)


def _forest_angles(energy, free):
    tree = np.ones(len(energy.first))
    tree[free] = 0
    rows = energy.matrix.toarray()
    return np.linalg.lstsq(rows[tree > 0], -energy.constant[tree > 0], rcond=None)[0]


def prove_from(instance, z, *, levels=4):
    """A checked proof round the field of integers z, without a search for a better one."""
    ends = Termination(Deadline(), never, gap=0.0, work=math.inf)
    prover = _Prover(instance, OrthogonalEnergy.of(instance), [z], ends, silent)
    next_factor, count = prover._next_factor, itertools.count(1)
    prover._find_better_field = prover._search = lambda _: False
    prover._next_factor = lambda *args, **more: next(count) < levels and next_factor(*args, **more)
    return check_proof(prover.proof(prover.run(), 0.0))


def worse_integers(instance, z, seed):
    """Integers near z: some with a few other ones, and some of these after descent."""
    rng, energy = np.random.default_rng(seed), OrthogonalEnergy.of(instance)
    for _ in range(2):
        worse = z.copy()
        for _ in range(rng.integers(1, 4)):
            worse[rng.integers(len(z))] += rng.choice([-1, 1])
        yield worse
        yield energy.descend(worse)


def keeps_optimum(instance, best, proof):
    """Whether all levels of a proof keep the cells and squares that hold an optimal field's crosses.

    best: integers of an optimal field, all of whose points are joined to strokes.
    """
    energy, arrays = OrthogonalEnergy.of(instance), proof.certificate()
    rows = checker.CentredRows(arrays)
    turn = np.append(energy.fit_angles(best), 0.0) - rows.centre
    divisions = arrays["divisions"].tolist()
    level, squares = checker.first_level(rows, divisions[0]), []
    for number, count in enumerate(divisions):
        if number:
            level = checker.next_level(level, squares, count // level.divisions)
        squares, table = level.allowed.copy(), level.squares
        stored = np.unpackbits(arrays[f"level_{number}_squares"], count=table.begin[rows.pairs])
        squares[: len(stored)] &= stored.astype(bool)
        steps = (turn / (np.pi / 2 / count) - rows.half / 2)[level.owner] - level.cells
        within = np.abs((steps - 0.5 + count / 2) % count - count / 2) <= 0.5 + 1e-9
        if len(np.unique(level.owner[table.have_partners(squares) & within])) <= rows.size:
            return False
        if len(np.unique(table.row[squares & np.logical_and(*table.at_ends(within))])) < len(rows.ends):
            return False
    return True
