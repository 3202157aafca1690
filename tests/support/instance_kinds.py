"""Kinds of instance: one table, and a strategy that draws more. Every ability is crossed with all of them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cache
from typing import Any, Final

import crossfield as cf
import numpy as np
import pytest
from hypothesis import strategies as st
from meshes import box, flat_sheet, mesh_of, tetrahedron, torus

QUARTER: Final = np.pi / 4


def grid(picture: str, theta: Any = None, w: Any = 1.0, *, seed: int = 0, **more: Any) -> cf.Instance:
    """An instance on a picture whose rows are words: `.` is outside, `/` has a stroke.

    theta, w: of the strokes, row by row and repeated as needed; random angles by default.
    """
    rows = np.array([[*row] for row in picture.split()])
    at = np.argwhere(rows == "/")
    return cf.Instance.on_pixels(
        "kind", rows != ".", at, *_strokes(len(at), theta, w, seed), **WEIGHTS | more
    )


def surface(
    mesh: cf.Mesh, at: Any = (), theta: Any = None, w: Any = 1.0, *, seed: int = 0, **more: Any
) -> cf.Instance:
    """An instance on the faces of a mesh, with strokes on the faces `at`; theta, w as in `grid`."""
    at = np.array(at, dtype=np.int32)
    return cf.Instance.on_faces("kind", mesh, at, *_strokes(len(at), theta, w, seed), **WEIGHTS | more)


WEIGHTS: Final = {"stroke_coefficient": 1.5, "skew_coefficient": 1e-3}


def _strokes(count: int, theta: Any, w: Any, seed: int) -> tuple[Any, Any]:
    theta = np.random.default_rng(seed).uniform(0, np.pi, count) if theta is None else theta
    return np.resize(theta, count), np.resize(w, count)


def weighted(make: Any, *arguments: Any, ends: Any = (1e-9, 1e3), draw: int = 0, **more: Any) -> cf.Instance:
    """The instance that `make` returns, with weights of pairs between two ends, even in their logarithms."""
    count = len(make(*arguments, **more).domain.first)
    drawn = np.random.default_rng(draw).uniform(*np.log(ends), count)
    return make(*arguments, **more, pair_weights=np.exp(drawn))


def fan(count: int) -> cf.Mesh:
    """Triangles around an apex over the ground, closed, so that the apex is inside."""
    turn = 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1)
    return mesh_of([[0, 0, 0.7], *rim], [[0, 1 + k, 1 + (k + 1) % count] for k in range(count)])


def sheet(columns: int, rows: int, height: float = 0.3) -> cf.Mesh:
    """A wavy sheet of squares, each cut into two triangles."""
    flat = flat_sheet(columns, rows)
    x, y, _ = flat.vertices.T
    return cf.Mesh(np.stack([x, y, height * np.sin(1.3 * x + 0.4 * y)], axis=1), flat.faces)


def apart(*meshes: cf.Mesh) -> cf.Mesh:
    """Meshes as parts of one."""
    vertices = [mesh.vertices + np.array([5.0 * k, 0, 0]) for k, mesh in enumerate(meshes)]
    before = np.cumsum([0, *map(len, vertices)])[:-1]
    faces = [mesh.faces + count for mesh, count in zip(meshes, before, strict=True)]
    return mesh_of(np.concatenate(vertices), np.concatenate(faces))


TRIANGLE: Final = mesh_of([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
TWO: Final = mesh_of([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1.3, 0]], [[0, 1, 2], [0, 2, 3]])

KINDS: Final[dict[str, Callable[[], cf.Instance]]] = {
    # No pairs, or few
    "pixel": lambda: grid("/"),
    "pixel-box": lambda: grid("/", [2 * np.pi / 3], gauge="box"),
    "pixel-orthogonal-weightless": lambda: grid("/", stroke_coefficient=0, orthogonal=True),
    "pixels-apart": lambda: grid("/.# .#. /./"),
    "two-pixels": lambda: grid("//"),
    # Shapes
    "row": lambda: grid("/###/"),
    "column-orthogonal": lambda: grid("/ # # / #", orthogonal=True),
    "square": lambda: grid("/# #/"),
    "square-orthogonal": lambda: grid("/# //", orthogonal=True),
    "hole": lambda: grid("/## #.# ##/"),
    "parts": lambda: grid("//.# /..# ..#."),
    "part-strokeless-box": lambda: grid("/#.## #/.##", gauge="box"),
    "far": lambda: grid("." * 98 + "/##", pixel_size=0.25, origin=(3, -7)),
    "full": lambda: grid("/### ##/# #//#"),
    "full-box": lambda: grid("/### ##/# #//#", gauge="box"),
    "full-orthogonal": lambda: grid("/### ##/# #//#", orthogonal=True),
    "full-orthogonal-box": lambda: grid("/### ##/# #//#", orthogonal=True, gauge="box"),
    "parts-orthogonal": lambda: grid("/#.##./ ##.##.#", orthogonal=True),
    "indices": lambda: grid("/##/ #### /###", orthogonal=True, indices=[(7, 1)]),
    # Strokes
    "contradicting": lambda: grid("/// /// ///", QUARTER * np.array([0, 1, 2, 3, 1e-9, 4 - 1e-9])),
    "contradicting-orthogonal": lambda: grid("/// ///", [0, QUARTER], orthogonal=True),
    "parallel": lambda: grid("//# ### ##/", [1.0]),
    "two-families": lambda: grid("/#/ ### /#/", [0.3, 1.2]),
    # Weights
    "reliabilities": lambda: grid("/#/ ##/", w=[1e-9, 1e-3, 1]),
    "strokes-weightless": lambda: grid("/# #/", stroke_coefficient=0),
    "skew-weightless": lambda: grid("/## #/#", skew_coefficient=0),
    "heavy": lambda: grid("/## #/#", stroke_coefficient=1e3, skew_coefficient=1e3),
    "light": lambda: grid("/## #/#", stroke_coefficient=1e-9, skew_coefficient=1e-9),
    "pairs-weighted": lambda: weighted(grid, "/## #/# ##/"),
    "pairs-weighted-orthogonal": lambda: weighted(grid, "/## #/# ##/", orthogonal=True),
    # Many pixels
    "441-pixels": lambda: grid(("/######" * 3 + " ") * 21),
    "651-pixels-part-strokeless": lambda: grid(("/######." + "#" * 24 + " ") * 21),
    "441-pixels-weighted": lambda: weighted(grid, ("/######" * 3 + " ") * 21, ends=(0.1, 10)),
    "441-pixels-orthogonal": lambda: grid(("/######" * 3 + " ") * 21, orthogonal=True),
    "1155-pixels": lambda: grid(("/######" * 5 + " ") * 33),
    "1155-pixels-weighted": lambda: weighted(grid, ("/######" * 5 + " ") * 33, ends=(0.1, 10)),
    # Meshes
    "triangle": lambda: surface(TRIANGLE),
    "triangle-stroke": lambda: surface(TRIANGLE, [0]),
    "triangles-apart": lambda: surface(apart(TRIANGLE, TRIANGLE)),
    "two-triangles": lambda: surface(TWO, [0, 1]),
    "two-triangles-skewed": lambda: surface(TWO, [0], orthogonal=False),
    "fan": lambda: surface(fan(5), [0, 2, 3]),
    "fan-box": lambda: surface(fan(4), [0, 2], gauge="box"),
    "tetrahedron-strokeless": lambda: surface(tetrahedron()),
    "tetrahedron-skewed": lambda: surface(tetrahedron(), [0, 2], orthogonal=False),
    "sheet-strokes-weightless": lambda: surface(sheet(2, 2), [4, 7], stroke_coefficient=0),
    "cube": lambda: surface(box(), range(12), [0], stroke_coefficient=20),
    "cube-skewed-box": lambda: surface(box(), [1, 4, 6, 11], orthogonal=False, gauge="box"),
    "cube-indices": lambda: surface(box(), indices=[(2, 1)]),
    "fan-indices": lambda: surface(fan(5), [0, 2, 3], indices=[(0, 1)]),
    "torus-strokeless": lambda: surface(torus(6, 4)),
    "torus-skewed": lambda: surface(torus(5, 4), [0, 17], orthogonal=False),
    "sheet-weighted": lambda: weighted(surface, sheet(3, 3), [0, 7, 17], draw=7),
    "sheet-weighted-skewed": lambda: weighted(surface, sheet(2, 2), [0, 7], ends=(0.2, 5), orthogonal=False),
    "mesh-parts": lambda: surface(apart(tetrahedron(), fan(4), TRIANGLE), [1, 4]),
    "mesh-tiny-unit": lambda: surface(cf.Mesh(fan(5).vertices * 1e-12, fan(5).faces), [1, 4]),
    "sheet-1012-faces": lambda: surface(sheet(23, 22), range(0, 1012, 9)),
}
"""Every kind by name, and the function that makes it."""


def on_mesh(instance: cf.Instance) -> bool:
    """Whether an instance is on the faces of a mesh."""
    return instance.domain.kind == "face"


def is_provable(instance: cf.Instance) -> bool:
    """Whether proofs take an instance."""
    return instance.orthogonal or (not on_mesh(instance) and instance.pair_weights is None)


@cache
def kind(name: str) -> cf.Instance:
    """The instance of a kind, the same object every time."""
    return KINDS[name]()


def first_field(instance: cf.Instance) -> cf.CrossField:
    """The greedy field, or where indices are prescribed, one that a search finds."""
    if instance.indices is None:
        return cf.greedy_field(instance)
    return cf.search(instance, rounds=0, jobs=1).field


MANY: Final = [name for name in KINDS if kind(name).domain.size > 400]
"""Kinds of many points."""
SMALL: Final = [name for name in KINDS if kind(name).domain.size <= 50]
"""Kinds of few points."""
TINY: Final = [name for name in KINDS if kind(name).domain.size <= 9]
"""Kinds of so few points that optima are known."""


def crossed(*columns: Any, every: int, slow: Any = ()) -> list[Any]:
    """Parameters of combinations: those whose places add up to a multiple of twice `every`, and as many more
    that are slow. Kinds of more than 400 points, and `slow` ones, are never quick.
    """
    parameters = []
    for cells in itertools.product(*map(enumerate, columns)):
        places, values = zip(*cells, strict=True)
        turn, rest = divmod(sum(places), every)
        if rest == 0:
            is_slow = turn % 2 or not {*values}.isdisjoint([*MANY, *slow])
            parameters.append(pytest.param(*values, marks=pytest.mark.slow if is_slow else ()))
    return parameters


@st.composite
def instances(draw: st.DrawFn) -> cf.Instance:
    """Instances on some pixels or triangles, in any combination of what the kinds have."""
    chance = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    magnitudes = st.sampled_from([0.0, 1e-9, 1e-3, 1.0, 20.0, 1e3])
    more = {
        "gauge": draw(st.sampled_from(["strokes", "box"])),
        "orthogonal": draw(st.booleans()),
        "stroke_coefficient": draw(magnitudes),
        "skew_coefficient": draw(magnitudes),
    }
    if draw(st.booleans()):
        rows = draw(st.lists(st.text("#/.", min_size=3, max_size=3), min_size=1, max_size=3))
        make, given = grid, [" ".join(["/" + rows[0][1:], *rows[1:]])]
    else:
        whole = sheet(draw(st.integers(1, 3)), draw(st.integers(1, 2)), chance.uniform(0, 2))
        some = cf.Mesh(whole.vertices, whole.faces[np.sort(chance.permutation(whole.size)[:6])])
        mesh = some if _is_allowed(some) else whole
        make, given = surface, [mesh, np.nonzero(chance.random(mesh.size) < 0.4)[0]]
    theta = chance.choice([*chance.uniform(0, np.pi, 3), 0, QUARTER, 2 * QUARTER], 9)
    given += [theta, 10.0 ** -chance.choice([0, 0, 3, 9], 9)]
    return weighted(make, *given, **more) if draw(st.booleans()) else make(*given, **more)


def _is_allowed(mesh: cf.Mesh) -> bool:
    """Whether an instance can be on a mesh."""
    try:
        surface(mesh)
    except cf.InstanceError:
        return False
    return True
