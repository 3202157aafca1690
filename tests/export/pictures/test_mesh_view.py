"""Pictures of fields on meshes, drawn without a display."""

import numpy as np
import pytest
from crossfield.export.pictures.draw import draw
from crossfield.models.errors import DomainError
from crossfield.models.field.field import CrossField
from crossfield.models.instance.instance import Instance
from crossfield.models.mesh.shapes import MESHES
from PIL import Image
from scipy import ndimage


def along_the_edges(name):
    """The field of a body of cubes whose lines are parallel to its edges: corners are its singularities."""
    mesh = MESHES[name][1]()
    upright = np.abs(mesh.normals[:, 2]) > 0.5
    direction = np.where(upright[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    every = np.arange(mesh.size)
    theta = mesh.angle_in(every, direction)
    instance = Instance.on_faces(name, mesh, every, theta, np.ones(mesh.size))
    return CrossField.from_lines(instance, theta, theta + np.pi / 2)


def dots(path, colour):
    """Number of separate spots of a colour in a picture."""
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    return ndimage.label(np.abs(pixels - colour).sum(axis=2) < 30)[1]


def test_a_cube_shows_seven_of_its_eight_corners(tmp_path):
    field = along_the_edges("cube")
    assert sorted(field.singularities.index.tolist()) == [0.25] * 8
    path = draw(field, tmp_path / "cube.png")
    assert dots(path, (0xD1, 0x24, 0x2F)) == 7
    assert dots(path, (0x30, 0x56, 0xD3)) == 0
    assert path.read_bytes() == draw(field, tmp_path / "again.png").read_bytes()


def test_corners_behind_a_wall_are_hidden(tmp_path):
    field = along_the_edges("bracket")
    turns = field.singularities.index
    path = draw(field, tmp_path / "bracket.png")
    assert 0 < dots(path, (0x30, 0x56, 0xD3)) < (turns < 0).sum()


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_an_instance_and_a_field_are_drawn_in_every_format(suffix, tmp_path):
    field = along_the_edges("stairs")
    for what in (field, field.instance):
        assert draw(what, tmp_path / f"picture.{suffix}").stat().st_size > 10_000


def test_kinds_that_show_pixels_are_refused_with_the_others_named(tmp_path):
    field = along_the_edges("cube")
    with pytest.raises(DomainError, match="choose one of instance, crosses"):
        draw(field, tmp_path / "angle.png", kind="angle")
    with pytest.raises(DomainError, match="leave the underlay out"):
        draw(field, tmp_path / "field.svg", underlay="mouse")
    assert not list(tmp_path.iterdir())
