"""Pictures of fields on meshes, drawn without a display."""

import crossfield as cf
import numpy as np
import pytest
from meshes import flat_sheet
from PIL import Image
from scipy import ndimage

POSITIVE, NEGATIVE = (0xD1, 0x24, 0x2F), (0x30, 0x56, 0xD3)


def along_the_edges(name):
    """The field of a body of cubes whose lines are parallel to its edges: corners are its singularities."""
    mesh = cf.sample(name).mesh
    upright = np.abs(mesh.normals[:, 2]) > 0.5
    direction = np.where(upright[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    every = np.arange(mesh.size)
    theta = mesh.angle_in(every, direction)
    instance = cf.Instance.on_faces(name, mesh, every, theta, np.ones(mesh.size))
    return cf.CrossField.from_lines(instance, theta, theta + np.pi / 2)


def dots(path, colour):
    """Number of separate spots of a colour in a picture."""
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    return ndimage.label(np.abs(pixels - colour).sum(axis=2) < 30)[1]


def test_a_cube_shows_seven_of_its_eight_corners_and_no_underlay(tmp_path):
    field = along_the_edges("cube")
    assert sorted(field.singularities.index.tolist()) == [0.25] * 8
    path = cf.draw(field, tmp_path / "cube.png")
    assert (dots(path, POSITIVE), dots(path, NEGATIVE)) == (7, 0)
    with pytest.raises(cf.InstanceError, match="leave the underlay out"):
        cf.draw(field, tmp_path / "field.svg", underlay="mouse")


def test_the_axis_upwards_only_names_the_axes_anew(tmp_path):
    """A bracket whose y or x axis takes the place of z gives the picture of the upright one."""
    bracket = cf.sample("bracket").mesh
    pictures = []
    for turns, up in enumerate(("z", "x", "y")):
        mesh = cf.Mesh(np.roll(bracket.vertices, turns, axis=1), bracket.faces)
        instance = cf.Instance.on_faces("bracket", mesh, [0], [0.3], [1.0])
        pictures.append(cf.draw(instance, tmp_path / f"{up}.png", up=up).read_bytes())
    assert pictures[0] == pictures[1] == pictures[2]
    for subject, axis, message in (
        (instance, "w", "choose one of z, x, y"),
        (cf.sample("mouse", 8), "y", "leave up"),
    ):
        with pytest.raises(cf.CrossfieldError, match=message):
            cf.draw(subject, tmp_path / "a.png", up=axis)


def test_crosses_are_as_dense_where_faces_are_small(tmp_path):
    coarse, fine = flat_sheet(10, 10), flat_sheet(40, 40)
    vertices = np.concatenate([coarse.vertices, fine.vertices / 4 + (10, 0, 0)])
    mesh = cf.Mesh(vertices, np.concatenate([coarse.faces, fine.faces + len(coarse.vertices)]))
    instance = cf.Instance.on_faces("both", mesh, [], [], [])
    along = mesh.angle_in(np.arange(mesh.size), np.tile([1.0, 0, 0], (mesh.size, 1)))
    path = cf.draw(cf.CrossField.from_lines(instance, along, along + np.pi / 2), tmp_path / "a.png")
    ink = np.ptp(np.asarray(Image.open(path).convert("RGB")).astype(int), axis=2)  # all else is grey
    halves = [half.sum() for half in np.array_split(ink, 2, axis=1)]
    assert 0.3 < halves[0] / halves[1] < 3


def test_corners_behind_a_wall_are_hidden(tmp_path):
    field = along_the_edges("bracket")
    path = cf.draw(field, tmp_path / "bracket.png")
    assert 0 < dots(path, NEGATIVE) < (field.singularities.index < 0).sum()
