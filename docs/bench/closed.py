"""Proofs on closed surfaces without strokes, for docs/notebooks/mesh.md: `python docs/bench closed`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from time import perf_counter

import crossfield as cf
import numpy as np
from crossfield.models.instance.domain import Floats
from crossfield.models.mesh.shapes import torus
from machine import machine_facts
from make import markdown, replace_between, write_rows
from scipy.spatial import ConvexHull


def hull(points: Floats) -> cf.Mesh:
    """The convex hull of points (n, 3), none of them inside, projected to the unit sphere."""
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    faces = ConvexHull(points).simplices
    turned = np.linalg.det(points[faces]) < 0
    return cf.Mesh(points, np.where(turned[:, None], faces[:, ::-1], faces))


def surfaces() -> Iterator[tuple[str, cf.Mesh]]:
    """Names and meshes."""
    corners = [(0, a, b * (1 + 5**0.5) / 2) for a in (1, -1) for b in (1, -1)]
    sphere = hull(np.concatenate([np.roll(corners, turn, axis=1) for turn in range(3)]))
    for times in range(3):
        middles = sphere.vertices[sphere.pair_vertices].mean(axis=1)
        sphere = hull(np.concatenate([sphere.vertices, middles]))
        if times:
            yield "icosphere", sphere
    points = sphere.vertices
    yield "ellipsoid, axes 1, 0.7, 0.5", cf.Mesh(points * (1, 0.7, 0.5), sphere.faces)
    waist = 1 - 0.6 * np.exp(-4 * points[:, 2:] ** 2)
    yield "peanut", cf.Mesh(points * np.hstack([waist, waist, np.ones_like(waist)]), sphere.faces)
    bumps = 1 + 0.2 * np.sin(4 * points).prod(axis=1, keepdims=True)
    yield "sphere with bumps", cf.Mesh(points * bumps, sphere.faces)
    yield "rounded cube", cf.Mesh(points / np.linalg.norm(points, 6, 1, keepdims=True), sphere.faces)
    corner = np.arange(512).reshape(32, 16)
    across, up = np.roll(corner, -1, 0), np.roll(corner, -1, 1)
    squares = np.stack([corner, across, np.roll(across, -1, 1), corner, np.roll(across, -1, 1), up], -1)
    alternating = torus(32, 16)
    yield "torus, parallel diagonals", cf.Mesh(alternating.vertices, squares.reshape(-1, 3))
    yield "torus, alternating diagonals", alternating
    rng = np.random.default_rng(0)
    random = hull(rng.normal(size=(350, 3)))
    yield "hull of 350 random points", random
    radius = rng.uniform(0.9, 1.1, (350, 1))
    yield "these points, at random distances", cf.Mesh(random.vertices * radius, random.faces)


def main(page: Path, _: Sequence[str]) -> None:
    """Prove all, and replace the table and its CSV file."""
    rows = []
    for name, mesh in surfaces():
        begin, none = perf_counter(), np.zeros(0)
        instance = cf.Instance.on_faces("closed", mesh, none.astype(np.int32), none, none)
        proof = cf.prove(instance, limits=cf.Limits(60.0), jobs=1)
        gap, seconds = 100 * (1 - proof.bound / proof.energy), perf_counter() - begin
        row = {"surface": name, "faces": f"{mesh.size:,}", "energy": f"{proof.energy:.3f}"}
        rows.append(row | {"bound": f"{proof.bound:.3f}", "gap": f"{gap:.2f} %", "s": f"{seconds:.0f}"})
    table, facts = markdown(tuple(rows[0])[:-1], [list(row.values())[:-1] for row in rows]), machine_facts()
    where = f"{facts['processor']}, Python {facts['python']}, load average {facts['load']:.1f}"
    write_rows("meshes/closed.csv", rows)
    replace_between(page.with_name("notebooks") / "mesh.md", "closed", f"{table}\n\nOne thread; {where}.")
