"""The sheet of paper in a photograph: its corners, and the picture of the sheet seen from above.

Every region that a threshold separates is a candidate. A quadrilateral is laid round it, its sides are moved
to the strongest edges near them, and it counts only if the colours beyond all of its sides are not those of
the sheet. So a frame or a box of strokes does not count: the paper goes on behind it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..instance.domain import Bools, Floats

SEARCHED_SIDE: Final = 640  # most pixels on the longer side of a picture that is searched for a sheet
_SMALLEST: Final = 64  # pixels on the shorter side of a picture that may be a photograph
_LEAST: Final = 0.12  # of the picture: area of a sheet
_MOST: Final = 0.985
_SOLID: Final = 0.93  # least share of its quadrilateral that a sheet fills
_LEVELS: Final = np.linspace(0.05, 0.9, 12)  # quantiles that are thresholds
_SAMPLES: Final = 96  # places along a side where its edge is looked for
_REACHES: Final = (14, 5)  # pixels that a side is moved by at most, in turn
_WIDE: Final = 3  # pixels on both sides of an edge that are compared to find it
_NEAR: Final = 2  # pixels beyond a side from which on there must be something else than the sheet
_FAR: Final = 40  # pixels beyond a side up to which there must
_STEP: Final = 0.1  # least difference from the sheet, relative to its brightness
_SAME: Final = 0.02  # difference of colours that is noise
_EVEN: Final = 0.004  # one level: half of a photographed table differs by more from its usual colour
_GROUND: Final = 0.25  # of what surrounds a sheet: least part that is even light ground
_OTHERS: Final = 0.25  # of the ink of a sheet: more ink outside of it belongs to the drawing
_DARK: Final = 0.1  # brightness below which differences count less
_SUPPORT: Final = 0.75  # least share of a side, and of the places beyond it, with other colours
_BORDER: Final = 4.0  # pixels between a side and the border of a picture that cuts the sheet there
_RIM: Final = 0.006  # of a side, left out along each edge of a sheet
_FOCAL: Final = (0.6, 0.9, 4.0)  # least, usual and greatest focal length in longer sides of a picture


@dataclass(frozen=True, eq=False)
class PhotographedSheet:
    """A sheet of paper in a picture.

    corners: (4, 2), x and y in pixels of the picture, clockwise from the top left. picture: width and height
    of the picture. size: width and height of the sheet seen from above; None if the picture cuts it off, so
    that it cannot be straightened.
    """

    corners: Floats
    picture: tuple[int, int]
    size: tuple[int, int] | None

    @cached_property
    def _homography(self) -> Floats:
        """The matrix from points of the straightened sheet to points of the picture."""
        assert self.size is not None
        width, height = self.size
        flat = ((0, 0), (width, 0), (width, height), (0, height))
        rows = [
            row
            for (x, y), (u, v) in zip(flat, self.corners, strict=True)
            for row in ((x, y, 1, 0, 0, 0, -u * x, -u * y), (0, 0, 0, x, y, 1, -v * x, -v * y))
        ]
        values = np.linalg.solve(np.array(rows, dtype=np.float64), self.corners.ravel())
        return np.append(values, 1).reshape(3, 3)

    def cut_out(self, pixels: NDArray[np.uint8], reduction: int) -> NDArray[np.uint8]:
        """The straightened sheet or, if it cannot be straightened, the picture with paper round the sheet.

        Pictures are uint8 [h, w, channels] and reduced by a factor.
        """
        if self.size is not None:
            return self.straighten(pixels, reduction)
        on_sheet = _find_pixels_within(self.corners, pixels.shape, reduction)
        paper = np.median(pixels[on_sheet], axis=0).astype(np.uint8)
        return np.where(on_sheet[..., None], pixels, paper)

    def straighten(self, pixels: NDArray[np.uint8], reduction: int) -> NDArray[np.uint8]:
        """The sheet seen from above. Pixels and result, uint8 [h, w, channels], are reduced by a factor."""
        from PIL import Image

        assert self.size is not None
        scale = np.array([reduction, reduction, 1.0])
        matrix = self._homography * scale / scale[:, None]
        image = Image.fromarray(pixels if pixels.shape[-1] == 3 else pixels[..., 0])
        width, height = (-(-side // reduction) for side in self.size)
        flat = image.transform(
            (width, height),
            Image.Transform.PERSPECTIVE,
            (matrix / matrix[2, 2]).ravel()[:8].tolist(),
            Image.Resampling.BILINEAR,
        )
        return np.asarray(flat).reshape(height, width, pixels.shape[-1])

    def describe(self) -> str:
        """One line on the sheet for the reader of the drawing."""
        corners = ", ".join(f"({x:.0f}, {y:.0f})" for x, y in self.corners)
        if self.size is None:
            return (
                f"what surrounds the sheet in the photo was left out (corners at {corners}), but the sheet "
                "was not straightened, because the picture cuts it off; take a picture of the whole sheet"
            )
        return f"the sheet in the photo was straightened (corners at {corners}), and the rest left out"


def _find_pixels_within(corners: Floats, shape: tuple[int, ...], reduction: int) -> Bools:
    """Which pixels [h, w] of a picture of this shape, reduced by a factor, lie within corners (4, 2)."""
    y, x = ((np.arange(side) + 0.5) * reduction for side in shape[:2])
    within = np.ones(shape[:2], dtype=bool)
    for (left, top), (right, bottom) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        within &= (right - left) * (y[:, None] - top) >= (bottom - top) * (x - left)
    return within


def find_sheet(coarse: NDArray[np.uint8], factor: int, picture: tuple[int, int]) -> PhotographedSheet | None:
    """The sheet in a picture, of this width and height, that is reduced by a factor to [h, w, channels].

    None if nothing surrounds the paper, as in a scan.
    """
    from scipy import ndimage

    if min(coarse.shape[:2]) < _SMALLEST:
        return None
    colours = ndimage.gaussian_filter(coarse.astype(np.float32) / 255, (0.7, 0.7, 0))
    edge = np.concatenate([colours[0], colours[-1], colours[:, 0], colours[:, -1]])
    if np.quantile(np.abs(edge - np.median(colours, axis=(0, 1))).max(axis=-1), 0.95) < _SAME:
        return None  # paper to the border, as in most scans
    best, most = None, (False, 0.0)
    tried: list[Floats] = []
    for region in _list_regions(colours[::2, ::2]):
        corners = _surround(region)
        if corners is None or any(np.abs(corners - other).max() < 2 for other in tried):
            continue
        tried.append(corners)
        quad = _Quad(colours, 2 * corners)
        for reach in _REACHES:
            quad = quad.move_sides(reach)
        # A side on the border of the picture shows nothing that speaks for it.
        score = not quad.is_cut.any(), quad.rate()
        if score[1] > 0 and score > most:
            best, most = quad, score
    if best is None or _is_one_of_several(best):
        return None
    corners = factor * best.shrink()
    return PhotographedSheet(
        corners, picture, None if best.is_cut.any() else _estimate_size(corners, picture)
    )


def _is_one_of_several(quad: _Quad) -> bool:
    """Whether a quadrilateral lies on even ground, unlike in photos, and much of the ink outside of it."""
    inside, near = (
        _find_pixels_within(quad.offset_sides(np.full((4, 2), reach)), quad.colours.shape, 1)
        for reach in (2.0 * _WIDE, 4.0 * _WIDE)
    )
    beside = quad.colours[near & ~inside]
    if not len(beside):
        return False
    paper, ground = (np.median(part, axis=0) for part in (quad.colours[inside], beside))
    ink = np.abs(quad.colours[inside] - paper).max(axis=-1)
    outer = np.abs(quad.colours[~inside] - ground).max(axis=-1)
    # Other sheets may lie on most of a light ground.
    if (outer < _EVEN).mean() < (_GROUND if ground.mean() > paper.mean() / 2 else 0.5):
        return False
    return bool((outer > _STEP).sum() > _OTHERS * (ink > _STEP).sum())


def _list_regions(colours: Floats) -> Iterator[Bools]:
    """Regions [h, w] without holes that a threshold separates: by brightness, by hue, by smoothness."""
    from scipy import ndimage

    height, width, channels = colours.shape
    bright = colours.mean(axis=-1)
    measures = [bright, -bright]
    hue = colours / (bright[..., None] + _DARK)
    middle = hue[height // 4 : 3 * height // 4, width // 4 : 3 * width // 4].reshape(-1, channels)
    if channels > 1:
        measures.append(-np.linalg.norm(hue - np.median(middle, axis=0), axis=-1))
    measures.append(-np.hypot(*np.gradient(ndimage.gaussian_filter(np.log(bright + _DARK), 1.0))))
    for measure in measures:
        for level in np.unique(np.quantile(measure, _LEVELS)):
            label, _ = ndimage.label(ndimage.minimum_filter(measure, 3) > level)
            area = np.bincount(label.ravel())
            area[0] = 0
            for number in np.argsort(-area)[:2]:
                # The paper round a drawing may be a thin ring.
                if area[number] >= _LEAST / 4 * label.size:
                    filled = ndimage.binary_fill_holes(ndimage.maximum_filter(label == number, 3))
                    yield ndimage.maximum_filter(ndimage.minimum_filter(filled, 7), 7)


def _surround(region: Bools) -> Floats | None:
    """Corners (4, 2) of a quadrilateral that a region nearly fills; None for a region of another shape."""
    from scipy.spatial import ConvexHull

    area = int(region.sum())
    if not _LEAST * region.size <= area <= _MOST * region.size:
        return None
    row, start = np.nonzero(np.diff(region.astype(np.int8), axis=1, prepend=0, append=0))
    hull = ConvexHull(np.concatenate([np.stack([start, row + down], axis=1) for down in (0, 1)]))
    if area < _SOLID * hull.volume:
        return None
    corners = hull.points[hull.vertices]
    while len(corners) > 4:
        # The side goes whose neighbours, made longer until they meet, add the least area.
        before, after, last = (np.roll(corners, step, axis=0) for step in (1, -1, -2))
        with np.errstate(all="ignore"):
            part = _cross(after - corners, last - after) / _cross(corners - before, last - after)
            tip = corners + part[:, None] * (corners - before)
            added = np.abs(_cross(after - corners, tip - corners))
        added[~((part > 0) & np.isfinite(added))] = np.inf
        side = int(np.argmin(added))
        if not np.isfinite(added[side]):
            return None
        corners[side] = tip[side]
        corners = np.delete(corners, (side + 1) % len(corners), axis=0)
    if len(corners) < 4 or area < _SOLID * _area(corners):
        return None
    way = np.roll(corners, -1, axis=0) - corners  # clockwise, as the hull is counter-clockwise with y up
    return np.asarray(np.roll(corners, -int(np.argmax(way[:, 0] / np.hypot(*way.T))), axis=0))


def _cross(one: Floats, two: Floats) -> Floats:
    return np.asarray(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0])


def _area(corners: Floats) -> float:
    return float(_cross(corners, np.roll(corners, -1, axis=0)).sum() / 2)


class _Quad:
    """A quadrilateral in a picture [h, w, channels], and the colours on both sides of its sides."""

    def __init__(self, colours: Floats, corners: Floats) -> None:
        self.colours, self.corners = colours, corners
        way = np.roll(corners, -1, axis=0) - corners
        self.outward = np.stack([way[:, 1], -way[:, 0]], axis=1) / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
        self.shares = 0.04 + 0.92 * (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        self.places = corners[:, None] + self.shares[:, None] * way[:, None]
        room = np.minimum(self.places, np.array(colours.shape[1::-1]) - self.places).min(axis=-1)
        self.is_cut: Bools = np.median(room, axis=1) < _BORDER

    def colours_beyond(self, offsets: Floats) -> tuple[Floats, Bools]:
        """Colours (4, samples, offsets, channels) outward from the sides, and which are on the picture."""
        at = self.places[:, :, None] + offsets[:, None] * self.outward[:, None, None]
        x, y = np.moveaxis(np.floor(at).astype(int), -1, 0)
        height, width = self.colours.shape[:2]
        on = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        return self.colours[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)], on

    def move_sides(self, reach: int) -> _Quad:
        """The quadrilateral with its sides on the strongest edges that are at most so many pixels away."""
        colours, on = self.colours_beyond(np.arange(-reach - _WIDE, reach + _WIDE + 1.0))
        total = np.pad(np.cumsum(colours, axis=2), ((0, 0), (0, 0), (1, 0), (0, 0)))
        means = total[:, :, _WIDE:] - total[:, :, :-_WIDE]
        strength = np.abs(means[:, :, _WIDE + 1 :] - means[:, :, : -_WIDE - 1]).max(axis=-1)
        strength[~on[:, :, 2 * _WIDE :]] = 0
        offset = np.argmax(strength, axis=-1) - float(reach)
        best = strength.max(axis=-1)
        # A line through most edges: least absolute distances, by weighted least squares.
        basis = np.stack([1 - self.shares, self.shares], axis=1)
        ends = np.zeros((4, 2))
        for _ in range(12):
            weight = best / (np.abs(offset - ends @ basis.T) + 0.3)
            normal = np.einsum("ks,si,sj->kij", weight, basis, basis) + 1e-9 * np.eye(2)
            moment = np.einsum("ks,si,ks->ki", weight, basis, offset)
            ends = np.linalg.solve(normal, moment[..., None])[..., 0]
        ends[self.is_cut] = 0
        return _Quad(self.colours, self.offset_sides(ends))

    def offset_sides(self, ends: Floats) -> Floats:
        """Corners (4, 2) after the two ends (4, 2) of each side move outward."""
        begin = self.corners + ends[:, :1] * self.outward
        way = np.roll(self.corners, -1, axis=0) + ends[:, 1:] * self.outward - begin
        before, along = np.roll(begin, 1, axis=0), np.roll(way, 1, axis=0)
        turn = _cross(along, way)
        part = _cross(begin - before, way) / np.where(turn == 0, 1, turn)
        return np.asarray(before + part[:, None] * along)

    def rate(self) -> float:
        """Area times brightness of a sheet; 0 where something else than a sheet lies within the sides."""
        distances = np.arange(_NEAR, _FAR, 2.0)
        # Over so wide a band, strokes along the side do not count.
        inner = np.median(self.colours_beyond(-distances)[0], axis=2, keepdims=True)
        beyond, on = self.colours_beyond(distances)
        differs = np.abs(beyond - inner).max(axis=-1) > _STEP * (inner.mean(axis=-1) + _DARK)
        supported = (differs & on).sum(axis=-1) >= _SUPPORT * np.maximum(on.sum(axis=-1), 1)
        is_edge = supported.mean(axis=1) >= _SUPPORT
        if self.is_cut.sum() > 2 or not (is_edge | self.is_cut).all():
            return 0.0
        return _area(self.corners) * float(np.median(inner))

    def shrink(self) -> Floats:
        """Corners (4, 2) without the rim of the sheet."""
        rim = -_RIM * np.sqrt(_area(self.corners))
        return self.offset_sides(np.where(self.is_cut[:, None], 0, rim) * np.ones(2))


def _estimate_size(corners: Floats, picture: tuple[int, int]) -> tuple[int, int]:
    """Width and height of a rectangle whose picture has these corners, of the same area.

    The camera is assumed to look at the middle of the picture, as in Zhang and He, "Whiteboard scanning and
    image enhancement", Digital Signal Processing 17 (2007).
    """
    points = np.column_stack([(corners - np.array(picture) / 2) / max(picture), np.ones(4)])
    top_left, top_right, bottom_right, bottom_left = points
    diagonal = np.cross(top_left, bottom_right)
    right = diagonal @ bottom_left / (np.cross(top_right, bottom_right) @ bottom_left) * top_right - top_left
    down = diagonal @ top_right / (np.cross(bottom_left, bottom_right) @ top_right) * bottom_left - top_left
    least, usual, greatest = _FOCAL
    with np.errstate(all="ignore"):
        square = -(right[0] * down[0] + right[1] * down[1]) / (right[2] * down[2])
    focal = np.clip(np.sqrt(square), least, greatest) if 0 < square < np.inf else usual
    ratio = np.linalg.norm(right * (1, 1, focal)) / np.linalg.norm(down * (1, 1, focal))
    area = _area(corners)
    return max(1, round(np.sqrt(area * ratio))), max(1, round(np.sqrt(area / ratio)))
