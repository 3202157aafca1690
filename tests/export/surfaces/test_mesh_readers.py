"""External programs read a surface: its places, quads and texture, and its orientation."""

import json
import subprocess
import sys

import crossfield as cf
import numpy as np
import pytest
from shapes import ball

IN_BLENDER = """
import bpy, json, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=sys.argv[1])
thing = bpy.context.selected_objects[0]
mesh = thing.data
picture = next(node.image for node in mesh.materials[0].node_tree.nodes if node.type == "TEX_IMAGE")
points = [thing.matrix_world @ vertex.co for vertex in mesh.vertices]
texture = [list(each.uv) for each in mesh.uv_layers[0].data]
facts = {
    "points": [list(each) for each in points], "faces": [list(each.vertices) for each in mesh.polygons],
    "texture": texture, "mended": mesh.validate(), "picture": list(picture.size),
    "outward": [list(thing.matrix_world.to_3x3() @ each.normal) for each in mesh.polygons],
}
print("facts " + json.dumps(facts))
"""


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    surface = ball(16)
    return surface, cf.write_surface(surface, tmp_path_factory.mktemp("ball"), side=64)


@pytest.mark.needs("trimesh")
def test_trimesh_reads_the_surface(written):
    import trimesh

    surface, folder = written
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


@pytest.mark.needs("bpy")
def test_blender_reads_the_surface(written):
    surface, folder = written
    command = [sys.executable, "-c", IN_BLENDER, folder / "surface.obj"]
    output = subprocess.run(command, capture_output=True, text=True, check=True, timeout=200).stdout
    facts = json.loads(next(line for line in output.splitlines() if line.startswith("facts "))[5:])
    height, width = surface.instance.mask.shape
    assert not facts["mended"]
    assert facts["picture"] == [4 * width, 4 * height]
    faces = np.array(facts["faces"])
    assert faces.shape == (surface.instance.grid.size, 4)
    x, depth, up = np.array(facts["points"]).T  # Blender's front view: x to the right, z up, y away
    row, column = np.rint(height - up).astype(int), np.rint(x).astype(int)
    assert np.abs(surface.heights[row, column] + depth).max() < 1e-4
    assert (np.array(facts["outward"])[:, 1] < 0).all()
    texture = np.array(facts["texture"]) * (width, height)
    assert np.abs(texture - np.column_stack([x, up])[faces.ravel()]).max() < 1e-4
