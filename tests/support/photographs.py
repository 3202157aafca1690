"""Photographs of drawings by construction: a sheet with known strokes, on a table, before a camera."""

from functools import cache

import numpy as np
from angles import line_difference
from crossfield.models.sketch.curves import flatten
from crossfield.models.sketch.drawing_file import parse_drawing
from PIL import Image, ImageDraw
from scipy import ndimage
from small_drawings import png, read, sample_svg

BLACK, RED, WHITE = (30, 30, 34), (200, 38, 45), (250, 249, 245)
PAPERS = {"white": (236, 234, 228), "kraft": (176, 138, 98), "blue": (38, 74, 140), "black": (34, 36, 38)}
TABLES = {"dark": (58, 50, 46), "cloth": (96, 40, 52), "grey": (128, 130, 134), "wood": (146, 98, 58)}
ROUGH = {"dark": 6, "cloth": 26, "grey": 8, "wood": 20}


def draw_sheet(sample, *, paper="white", ink=BLACK, red=RED, side=900, widths=(4, 4)):
    """A drawn sample on a sheet, float [h, w, 3]. widths: of black and of red strokes in pixels."""
    curves = parse_drawing(sample_svg(sample).encode(), ".svg", 24)
    left, top, right, bottom = curves.box
    scale = 0.72 * side / max(right - left, bottom - top)
    size = [round(scale * extent + 0.28 * side) for extent in (right - left, bottom - top)]
    segments, owner = flatten(curves.points, 0.1 / scale)
    segments = 2 * (scale * (segments - (left, top)) + 0.14 * side)
    image = Image.new("RGB", (2 * size[0], 2 * size[1]), PAPERS[paper])
    pen = ImageDraw.Draw(image)
    for ends, is_red in sorted(zip(segments, curves.red[owner], strict=True), key=lambda pair: pair[1]):
        colour, width = (red, widths[1]) if is_red else (ink, widths[0])
        pen.line(ends.ravel().tolist(), colour, round(2 * width))
        for x, y in ends:
            pen.ellipse((x - width, y - width, x + width, y + width), colour)
    return np.asarray(image.reduce(2)).astype(float)


def draw_table(kind, height, width, rng):
    """The top of a table, float [h, w, 3]."""
    if kind == "mat":
        table = np.tile((28.0, 84.0, 62.0), (height, width, 1))
        table[::40] = table[:, ::40] = (120, 150, 130)
        return table
    grain = ndimage.gaussian_filter(rng.normal(size=(height, width)), (2, 40) if kind == "wood" else 2)
    return TABLES[kind] + ROUGH[kind] * (grain / grain.std())[..., None]


def photograph(sheet, table, *, turn=0, pitch=0, yaw=0, light="even", shift=(0, 0), fill=0.9, seed=0):
    """A photograph of a sheet on a table, float [750, 1000, 3]. turn, pitch, yaw: degrees.

    shift: of the sheet, as a share of the picture.
    """
    rng = np.random.default_rng(seed)
    width, height = size = np.array([1000, 750])
    high, wide = sheet.shape[:2]
    corners = project_corners(wide, high, *np.radians([turn, pitch, yaw]))
    corners = corners * fill / 2 * (size / np.abs(corners).max(axis=0)).min() + size * (0.5 + np.array(shift))
    place = solve_homography(2 * corners, np.array([(0, 0), (wide, 0), (wide, high), (0, high)], float))
    # Twice as fine and then averaged, as a lens and its sensor do.
    seen = Image.fromarray(np.dstack([sheet, np.full((high, wide), 255.0)]).astype(np.uint8)).transform(
        (2 * width, 2 * height), Image.Transform.PERSPECTIVE, place.ravel()[:8], Image.Resampling.BILINEAR
    )
    seen = np.asarray(seen.reduce(2)).astype(float)
    part = seen[..., 3:] / 255
    shade = 1 - 0.45 * ndimage.gaussian_filter(np.roll(part, (6, 4), (0, 1)), (5, 5, 0))
    pixels = seen[..., :3] * part + draw_table(table, height, width, rng) * shade * (1 - part)
    pixels = ndimage.gaussian_filter(pixels, (0.5, 0.5, 0)) * light_on(light, height, width)
    return pixels + rng.normal(0, 3, pixels.shape)


def light_on(kind, height, width):
    """The light, float [h, w, 1]: even, gradient, lamp or shadow."""
    y, x = np.mgrid[0:height, 0:width] / max(height, width)
    light = {
        "even": 1 + 0 * x,
        "gradient": 1 - 0.5 * (x + y) / (x + y).max(),
        "lamp": 0.45 + 0.55 * np.exp(-((x - 0.3) ** 2 + (y - 0.35) ** 2) / 0.18),
        "shadow": 1 - 0.4 / (1 + np.exp(-(x + 0.5 * y - 0.75) * 60)),
    }
    return light[kind][..., None]


def project_corners(width, height, turn, pitch, yaw):
    """Corners of a rectangle before a camera at a distance of 1.3 of its diagonal."""
    about_z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    about_y = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    at = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * (width / 2, height / 2, 0)
    x, y, z = about_y @ about_x @ about_z @ at.T
    return np.stack([x, y], axis=1) / (1.3 * np.hypot(width, height) + z)[:, None]


def solve_homography(source, target):
    """The 3 x 3 matrix that takes four points to four others."""
    rows = [
        row
        for (x, y), (u, v) in zip(source, target, strict=True)
        for row in ((x, y, 1, 0, 0, 0, -u * x, -u * y), (0, 0, 0, x, y, 1, -v * x, -v * y))
    ]
    return np.append(np.linalg.solve(np.array(rows), target.ravel()), 1).reshape(3, 3)


def encode(pixels, kind="JPEG", **options):
    """The bytes of a picture."""
    return png(Image.fromarray(np.clip(pixels, 0, 255).astype(np.uint8)), kind, **options)


@cache
def read_clean(sample, size=40, *, one_colour=False, **options):
    """The instance of a sample drawn in pure colours on white paper."""
    red = (0, 0, 0) if one_colour else (220, 30, 40)
    sheet = draw_sheet(sample, ink=(0, 0, 0), red=red, **options)
    sheet[(sheet == PAPERS["white"]).all(axis=-1)] = 255
    return read(encode(sheet, "PNG"), size, "a.png")


def assert_same_drawing(instance, truth):
    """Masks and stroke pixels agree up to some pixels at the border, and directions up to some degrees."""
    places = [
        np.clip(np.arange(side) + (other - side) // 2, 0, other - 1)
        for side, other in zip(truth.mask.shape, instance.mask.shape, strict=True)
    ]
    maps = []
    for part in (instance, truth):
        theta = np.full(part.mask.shape, np.nan)
        theta[tuple(part.stroke_pixels.T)] = part.theta
        maps.append(theta)
    theta, mask = maps[0][np.ix_(*places)], instance.mask[np.ix_(*places)]
    assert (mask & truth.mask).sum() > 0.9 * (mask | truth.mask).sum()
    has, should = ~np.isnan(theta), ~np.isnan(maps[1])
    distance, near = ndimage.distance_transform_edt(~has, return_indices=True)
    assert (distance[should] < 1.5).mean() > 0.9
    assert (ndimage.distance_transform_edt(~should)[has] < 1.5).mean() > 0.9
    pairs = should & (distance < 1.5)
    angle = np.degrees(np.abs(line_difference(theta[tuple(near[:, pairs])], maps[1][pairs])))
    assert np.median(angle) < 3
    assert np.percentile(angle, 90) < 12
