"""Files of a surface: the mesh equals the surface, writes are repeatable and complete."""

import json
from collections import Counter

import crossfield as cf
import matplotlib as mpl
import numpy as np
import pytest
from crossfield.export.surfaces.files import FILES, surface_facts, to_obj, write_surface
from crossfield.models.errors import InputError, OutputError
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from shapes import ball, ball_normals, plane, surface_of


def parsed(obj):
    """Tables of an .obj by the first word of their lines; faces as (n, 4, 3) of 1-based numbers."""
    lines = [line.split() for line in obj.decode().splitlines()]
    tables = {
        key: np.array([line[1:] for line in lines if line[0] == key], float) for key in ("v", "vt", "vn")
    }
    faces = [[corner.split("/") for corner in line[1:]] for line in lines if line[0] == "f"]
    return tables | {"f": np.array(faces, dtype=int)}


def on_white(path):
    """A picture on white paper, grey (h, w)."""
    with Image.open(path) as opened:
        picture = opened.convert("RGBA")
    paper = Image.new("RGBA", picture.size, "white")
    return np.asarray(Image.alpha_composite(paper, picture).convert("L")).astype(int)


def size_of(path):
    """Width, height and mode of a picture."""
    with Image.open(path) as opened:
        return *opened.size, opened.mode


def check_mesh(surface):
    """Each quad is a pixel: its corners, heights and place on a picture; counter-clockwise, a manifold."""
    mesh, grid = parsed(to_obj(surface, "any.mtl")), surface.instance.grid
    height, width = surface.instance.mask.shape
    assert mesh["f"].shape == (grid.size, 4, 3)
    assert (np.ptp(mesh["f"], axis=2) == 0).all()
    corner = mesh["f"][..., 0] - 1
    assert sorted(set(corner.ravel())) == list(range(len(mesh["v"])))
    points = mesh["v"][corner]
    steps = np.array([[0, 1], [1, 1], [1, 0], [0, 0]])  # right and down: lower left, lower right, ...
    assert (points[..., 0] == grid.columns[:, None] + steps[:, 0]).all()
    assert (points[..., 1] == height - grid.rows[:, None] - steps[:, 1]).all()
    expected = surface.heights[grid.rows[:, None] + steps[:, 1], grid.columns[:, None] + steps[:, 0]]
    assert np.abs(points[..., 2] - expected).max() < 1e-6
    assert np.abs(mesh["vt"] - mesh["v"][:, :2] / (width, height)).max() < 1e-6
    assert np.abs(np.linalg.norm(mesh["vn"], axis=1) - 1).max() < 1e-5
    assert (mesh["vn"][:, 2] > 0).all()
    faces = corner.tolist()
    sides = Counter(side for face in faces for side in zip(face, face[1:] + face[:1], strict=True))
    assert max(sides.values()) == 1  # neighbours walk their common side in opposite directions
    around = Counter(vertex for face in faces for vertex in face)
    joined = Counter(a for a, b in sides if (b, a) in sides)
    joined.update(b for a, b in sides if (b, a) in sides)
    assert all(joined[vertex] >= 2 * (count - 1) for vertex, count in around.items())


@given(st.lists(st.lists(st.booleans(), min_size=4, max_size=4), min_size=3, max_size=3).filter(np.any))
def test_every_mask_becomes_a_manifold_of_its_pixels(mask):
    check_mesh(surface_of(mask, lambda x, y: x * y + 0.25 * x**2))


def test_a_ball_has_the_normals_of_a_ball():
    surface = ball(32, part=0.8)
    check_mesh(surface)
    mesh = parsed(to_obj(surface, "any.mtl"))
    place = (mesh["v"] - (16, 16, 0)) / 16
    off = np.degrees(np.arccos(np.clip(np.sum(place * mesh["vn"], axis=1), -1, 1)))
    assert off.mean() < 0.8
    assert off.max() < 6  # at the border only one side is known
    assert np.degrees(np.arccos(np.sum(ball_normals(surface) * surface.normals, axis=1))).max() < 1


def test_the_folder_has_every_file_the_same_twice_whatever_the_users_settings(tmp_path):
    surface = ball(12)
    first = write_surface(surface, tmp_path / "first")
    with mpl.rc_context({"lines.linewidth": 9.0, "figure.dpi": 30, "savefig.facecolor": "red"}):
        second = cf.write_surface(surface, tmp_path / "second")
    assert sorted(path.name for path in first.iterdir()) == sorted(FILES)
    for name in FILES:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
    heights = np.load(first / "heights.npy", allow_pickle=False)
    assert np.array_equal(heights, surface.heights, equal_nan=True)
    sizes = {name: size_of(first / name) for name in FILES if name.endswith(".png")}
    assert sizes.pop("normals.png") == (12, 12, "RGBA")
    assert sizes.pop("drawing.png") == (996, 996, "RGB")
    assert set(sizes.values()) == {(996, 996, "RGBA")}
    assert (first / "surface.mtl").read_text().split()[-2:] == ["map_Kd", "drawing.png"]
    facts = json.loads((first / "surface.json").read_text())
    assert facts["doubts"] == []
    assert "trusted" not in facts  # no check shows that a surface is right
    assert facts["instance"]["sha256"] == surface.instance.sha256
    assert not any("second" in key for key in facts)


def test_strokes_of_the_drawing_lie_over_the_surface(tmp_path):
    instance = cf.sample("mouse", 16)
    flat = surface_of(instance.mask, lambda x, _: 0 * x)
    field = cf.power_field(instance)
    surface = type(flat)(field, flat.heights, flat.confidence)
    drawn = write_surface(surface, tmp_path / "drawn", drawing="mouse", scale=10)
    pieces = write_surface(surface, tmp_path / "pieces", scale=10)
    plain, over, dashed = (
        on_white(path) for path in (drawn / "shaded.png", drawn / "overlay.png", pieces / "overlay.png")
    )
    ink = plain - over > 50
    assert 0.02 < ink.mean() < 0.3
    assert (over <= plain).mean() > 0.95
    assert 0.3 < (plain - dashed > 50).mean() / ink.mean() < 3
    row, column = instance.stroke_pixels[instance.w > 0.9].T
    near = [
        ink[10 * r - 5 : 10 * r + 15, 10 * c - 5 : 10 * c + 15].any()
        for r, c in zip(row, column, strict=True)
    ]
    assert np.mean(near) > 0.95
    with pytest.raises(InputError, match="lies elsewhere"):
        write_surface(ball(8), tmp_path / "none", drawing="bottle")


def test_what_fails_leaves_no_report_of_an_earlier_surface(tmp_path):
    write_surface(ball(8), tmp_path / "there", scale=2)
    with pytest.raises(InputError, match="choose another scale"):
        write_surface(ball(8), tmp_path / "there", scale=0)
    assert (tmp_path / "there" / "surface.json").exists()  # nothing was begun
    (tmp_path / "there" / "heights.npy").unlink()
    (tmp_path / "there" / "heights.npy").mkdir()
    with pytest.raises(OutputError, match="heights"):
        write_surface(ball(8), tmp_path / "there", scale=2)
    assert not (tmp_path / "there" / "surface.json").exists()
    assert not list((tmp_path / "there").glob("*.part"))


def test_facts_are_those_of_a_plane():
    slope = np.array([0.6, 0.8])
    u, v = (1.0, 0.0), (-0.48, 1.36)  # u . v + (u . g)(v . g) = 0
    assert u[0] * v[0] + (u[0] * slope[0]) * np.dot(v, slope) == pytest.approx(0)
    exact = surface_facts(plane(6, *slope, u=0.0, v=np.arctan2(v[1], v[0])))
    assert exact["right_angle_error_90_percent_degrees"] == pytest.approx(0, abs=1e-4)
    facts = surface_facts(plane(6, *slope))
    error = np.degrees(np.arcsin(0.48 / np.sqrt(1.36 * 1.64)))
    assert facts["right_angle_error_mean_degrees"] == pytest.approx(error, abs=1e-3)
    assert facts["slant_mean_degrees"] == pytest.approx(45.0)
    assert facts["height_range_pixels"] == pytest.approx(0.6 * 8 + 0.8 * 6)
