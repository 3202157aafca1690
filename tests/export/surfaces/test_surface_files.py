"""Files of a surface: the mesh equals the surface, for another reader too; writes are repeatable."""

import json
import re
from collections import Counter

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.shading.raster import grid_box
from crossfield.export.surfaces.files import surface_facts, to_obj
from crossfield.models.surface.surface import Surface
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageDraw
from shapes import ball, ball_normals, corners_of, plane, surface_of


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


def mesh_of(surface):
    """The tables of the mesh of a surface, whose texture covers the grid."""
    return parsed(to_obj(surface, "any.mtl", grid_box(surface.instance)))


def check_mesh(surface):
    """Each quad is a pixel: its corners, heights and place on a picture; counter-clockwise, a manifold."""
    mesh, grid = mesh_of(surface), surface.instance.grid
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
    mesh = mesh_of(surface)
    place = (mesh["v"] - (16, 16, 0)) / 16
    off = np.degrees(np.arccos(np.clip(np.sum(place * mesh["vn"], axis=1), -1, 1)))
    assert off.mean() < 0.8
    assert off.max() < 6  # at the border only one side is known
    assert np.degrees(np.arccos(np.sum(ball_normals(surface) * surface.normals, axis=1))).max() < 1


def test_the_folder_has_heights_pictures_and_facts(tmp_path):
    surface = ball(12)
    folder = cf.write_surface(surface, tmp_path / "out")
    heights = np.load(folder / "heights.npy", allow_pickle=False)
    assert np.array_equal(heights, surface.heights, equal_nan=True)
    sizes = {path.name: size_of(path) for path in folder.glob("*.png")}
    assert sizes.pop("drawing.png") == (1020, 1020, "RGB")  # 85 pixels per pixel of the grid
    assert sizes == dict.fromkeys(("normals.png", "shaded.png", "overlay.png"), (1020, 1020, "RGBA"))
    assert (folder / "surface.mtl").read_text().split()[-2:] == ["map_Kd", "drawing.png"]
    facts = json.loads((folder / "surface.json").read_text())
    assert facts["interrupted"] is False
    assert facts["pictures"]["show"] == "the grid, as the page is unknown: give the drawing"
    assert (facts["pictures"]["page"], facts["pictures"]["width"]) == ([0, 0, 12, 12], 1020)
    assert facts["instance"]["sha256"] == surface.instance.sha256


def test_strokes_of_the_drawing_lie_over_the_surface(tmp_path):
    instance = cf.sample("mouse", 16)
    flat = surface_of(instance.mask, lambda x, _: 0 * x)
    field = cf.power_field(instance)
    surface = Surface(field, flat.heights, flat.confidence)
    drawn = cf.write_surface(surface, tmp_path / "drawn", drawing="mouse", side=400)
    pieces = cf.write_surface(surface, tmp_path / "pieces", side=400)
    plain, over, dashed = (
        on_white(path) for path in (drawn / "shaded.png", drawn / "overlay.png", pieces / "overlay.png")
    )
    ink = plain - over > 50
    assert 0.02 < ink.mean() < 0.3
    assert (over <= plain).mean() > 0.95
    assert 0.3 < (plain - dashed > 50).mean() / ink.mean() < 3
    assert ink.shape == (334, 400)  # the page of the sample
    middles = instance.origin + instance.pixel_size * (
        instance.stroke_pixels[instance.w > 0.9][:, ::-1] + 0.5
    )
    half = instance.pixel_size
    near = [ink[int(y - half) : int(y + half), int(x - half) : int(x + half)].any() for x, y in middles]
    assert np.mean(near) > 0.95


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
    assert facts["support"]["fitting"].startswith("on 0% of the pixels")
    assert exact["support"].keys() == {"drawn", "guessed", "fitting"}
    assert "farthest at (7.5, 5.5), 8.6 pixels" in exact["support"]["guessed"]


PAGE = 'viewBox="300 -100 400 250"'  # the drawing lies off the middle of a page that does not begin at 0
CENTRE, RADIUS = np.array([450.0, 40.0]), 90.0


def ball_on_a_page(tmp_path):
    """The drawing of a ball's outline, in an instance whose surface is that ball."""
    drawing = tmp_path / "ball.svg"
    circle = '<circle cx="450" cy="40" r="90" stroke="black"/>'
    drawing.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" {PAGE} fill="none">{circle}'
        f'<path d="M360 40H540M450 -50V130" stroke="red"/></svg>'
    )
    instance = cf.read_sketch(drawing, size=32)
    row, column = np.mgrid[: instance.grid.height + 1, : instance.grid.width + 1]
    steps = instance.origin + instance.pixel_size * np.stack([column, row], axis=-1) - CENTRE
    heights = np.sqrt(np.maximum(RADIUS**2 - (steps**2).sum(axis=-1), 0.0)) / instance.pixel_size
    heights[~corners_of(instance.mask)] = np.nan
    field = cf.power_field(instance)
    return drawing, Surface(field, heights, np.ones(instance.grid.size))


def read_layer(path):
    """Normals (h, w, 3), opacity (h, w) and places (h, w, 2) round the ball's centre, of a layer."""
    with Image.open(path) as picture:
        texels = np.asarray(picture) / 255
    height, width = texels.shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5
    place = np.stack([300 + 400 * x / width, -100 + 250 * y / height], axis=-1) - CENTRE
    return 2 * texels[..., :3] - 1, texels[..., 3], place


def test_a_normal_map_is_a_layer_of_the_drawing_to_its_outline(tmp_path):
    drawing, surface = ball_on_a_page(tmp_path)
    cf.write_surface(surface, tmp_path / "out", drawing=drawing)
    normals, opacity, place = read_layer(tmp_path / "out" / "normals.png")
    assert opacity.shape == (750, 1200)  # three pixels per unit
    away = np.hypot(*np.moveaxis(place, -1, 0))
    pixel = surface.instance.pixel_size
    assert opacity[away < RADIUS - 0.1 * pixel].min() == 1  # the mask ends a pixel before its outline
    assert opacity[away > RADIUS + 0.1 * pixel].max() == 0
    assert opacity.sum() / 9 == pytest.approx(np.pi * RADIUS**2, rel=2e-3)
    true = np.concatenate([place * (1, -1), np.sqrt(np.maximum(RADIUS**2 - away**2, 0))[..., None]], axis=-1)
    inner = away < 0.8 * RADIUS
    cosine = (normals * true).sum(axis=-1)[inner] / RADIUS / np.linalg.norm(normals[inner], axis=-1)
    assert np.degrees(np.arccos(np.minimum(cosine, 1))).max() < 3
    facts = json.loads((tmp_path / "out" / "surface.json").read_text())["pictures"]
    assert facts["page"] == [300, -100, 400, 250]
    assert facts["pixel_size"] == pytest.approx([1 / 3, 1 / 3])
    mesh = parsed((tmp_path / "out" / "surface.obj").read_bytes())
    drawn = surface.instance.origin + surface.instance.pixel_size * (
        mesh["v"][:, :2] * (1, -1) + (0, surface.instance.grid.height)
    )
    assert np.abs(mesh["vt"] * (400, -250) + (300, 150) - drawn).max() < 1e-3


def test_a_gap_in_the_outline_and_a_stroke_within_keep_the_rest(tmp_path):
    """A cell of both sides is divided by the mask, and a hole that the mask leaves out stays one."""
    _, surface = ball_on_a_page(tmp_path)
    closed = tmp_path / "ball.svg"
    text = closed.read_text()
    open_arc = '<path d="M466 -48.6A90 90 0 1 1 434 -48.6" stroke="black"/>'  # lacks 20 degrees at the top
    closed.write_text(re.sub("<circle[^>]*>", open_arc, text))
    cf.write_surface(surface, tmp_path / "open", drawing=closed, side=800)
    _, opacity, place = read_layer(tmp_path / "open" / "normals.png")
    away = np.hypot(*np.moveaxis(place, -1, 0))
    assert opacity[away < RADIUS - 2.5 * surface.instance.pixel_size].min() == 1
    assert opacity[away > RADIUS + surface.instance.pixel_size].max() == 0


def test_layers_have_the_size_of_a_picture_and_of_the_page_without_its_file(tmp_path):
    picture = Image.new("L", (301, 200), 255)
    ImageDraw.Draw(picture).ellipse((120, 40, 280, 180), outline=0, width=3)
    ImageDraw.Draw(picture).line((200, 40, 200, 180), fill=0, width=3)
    picture.save(tmp_path / "ink.png")
    instance = cf.read_sketch(tmp_path / "ink.png", size=24)
    flat = surface_of(instance.mask, lambda x, _: 0 * x)
    surface = Surface(cf.power_field(instance), flat.heights, flat.confidence)
    cf.write_surface(surface, tmp_path / "out", drawing=tmp_path / "ink.png")
    assert size_of(tmp_path / "out" / "normals.png") == (301, 200, "RGBA")
    with Image.open(tmp_path / "out" / "normals.png") as layer:
        opacity = np.asarray(layer)[..., 3] / 255
    y, x = np.mgrid[:200, :301] + 0.5
    within = np.hypot((x - 200.5) / 80, (y - 110.5) / 70)
    assert opacity[within < 0.95].min() == 1
    assert opacity[within > 1.03].max() == 0
    cf.write_surface(surface, tmp_path / "page", side=602)
    assert size_of(tmp_path / "page" / "normals.png") == (602, 400, "RGBA")


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
