"""Another program reads a surface: its places, faces and texture, and its orientation."""

import crossfield as cf
import numpy as np
import pytest
from shapes import ball


@pytest.mark.needs("trimesh")
def test_trimesh_reads_the_surface(tmp_path):
    import trimesh

    surface = ball(16)
    folder = cf.write_surface(surface, tmp_path / "ball", side=64)
    mesh = trimesh.load_mesh(folder / "surface.obj", process=False)
    height, width = surface.instance.mask.shape
    assert len(mesh.faces) == 2 * surface.instance.grid.size
    assert mesh.is_winding_consistent
    assert (mesh.face_normals[:, 2] > 0).all()
    assert mesh.area_faces.min() >= 0.5 - 1e-6  # half of a pixel, seen from the front
    assert np.abs(mesh.visual.uv * (width, height) - mesh.vertices[:, :2]).max() < 1e-4
    row, column = (height - mesh.vertices[:, 1]).astype(int), mesh.vertices[:, 0].astype(int)
    assert np.abs(surface.heights[row, column] - mesh.vertices[:, 2]).max() < 1e-6
    assert mesh.visual.material.image.size == (4 * width, 4 * height)
