"""Pictures of instances, cross fields and surfaces as PNG, SVG or PDF: same input, same bytes.

Most kinds are panels with words round them; `layers` is the bare field in the coordinates of its drawing.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...models.arguments import check_choice
from ...models.errors import DomainError, InputError
from ...models.field.field import CrossField
from ...models.instance.instance import Instance
from ...models.instance.mesh import Mesh
from ...models.storage import require_suffix, write_bytes
from ...models.surface.surface import Surface
from ...models.written_files import check_targets
from . import panels
from .canvas import draw_sheet, set_coordinates
from .layers import field_sheet
from .mesh_view import draw_mesh
from .svg import sheet_svg
from .underlay import Underlay, read_underlay

_WORDS: Final = 7.5  # points of text
DrawPanel = Callable[[Any, panels.PanelContent], None]


@dataclass(frozen=True)
class PictureKind:
    """A kind of picture: description, panels with headings; no panels: the layers on the page of a drawing.

    size: points of the longer side of a panel. columns: panels in a row. bar: points to the right for a
    colour bar. legend: keys below. words: points of text.
    """

    description: str
    panels: tuple[tuple[str, DrawPanel], ...]
    size: float = 340.0
    columns: int = 1
    bar: float = 0.0
    legend: bool = False
    words: float = _WORDS
    needs_field: bool = True


LAYERS: Final = "layers"

KINDS: Final = {
    "instance": PictureKind(
        "mask and strokes of an instance", (("", panels.draw_instance),), needs_field=False
    ),
    "crosses": PictureKind(
        "crosses on the pixels, one in several on large grids", (("", panels.draw_crosses),), legend=True
    ),
    "field": PictureKind(
        "evenly spaced streamlines of both line families, with singularities",
        (("", panels.draw_streamlines),),
        legend=True,
    ),
    "angle": PictureKind("map of the angle between the two lines", (("", panels.draw_angle),), bar=52.0),
    "overview": PictureKind(
        "instance, crosses, streamlines and angle map, with counts and energies",
        (
            ("instance", panels.draw_instance),
            ("crosses", panels.draw_crosses),
            ("streamlines", panels.draw_streamlines),
            ("angle map", panels.draw_angle),
        ),
        size=165.0,
        columns=2,
        bar=62.0,
        legend=True,
        words=10.0,
    ),
    LAYERS: PictureKind("the field in the coordinates of its drawing, on top of it with --underlay", ()),
}
"""Kinds of pictures of instances and fields by name."""

SHADED: Final = PictureKind("surface in the light of a lamp", (("", panels.draw_surface),))
"""The picture of a surface; `crossfield shade` writes others."""

Subject = CrossField | Instance | Surface

SUFFIXES: Final = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""File suffixes, and the metadata that would name a clock or a version."""

_DOTS: Final = 220  # dots per inch of a PNG
_PREVIEW_DOTS: Final = 96
_POINTS: Final = 72.0
_EDGE: Final = 9.0
_GAP: Final = 14.0
_LINE: Final = 1.6  # height of a line of text, in its size
_CHARACTER: Final = 0.55  # width of a character, at most, in its size
_NARROWEST: Final = 52.0  # room for a heading
_SEPARATOR: Final = "  ·  "
_LONGEST: Final = 46  # characters of the longest part of a caption
_MESH_SIDE: Final = 400.0  # points of the side of a picture of a mesh
ON_MESHES: Final = ("instance", "crosses")  # kinds of pictures of instances and fields on meshes


def draw(
    subject: CrossField | Instance | Surface,
    path: str | Path,
    *,
    kind: str | None = None,
    underlay: str | Path | Underlay | None = None,
    force: bool = False,
) -> Path:
    """Draw an instance, a field or a surface into a file.

    Parameters
    ----------
    subject
        An Instance, a CrossField or a Surface.
    path
        The file to write; its suffix, .png, .svg or .pdf, decides the format.
    kind
        A name in KINDS; an Instance has only `instance`, and a Surface one picture without a name. By default
        `layers` for a field as SVG or with an underlay, `crosses` on a mesh, and `field` otherwise.
    underlay
        The drawing (SVG, bitmap, .scap) or sample from which the instance was read. Its strokes become the
        bottom of `layers`; nothing else of the file is copied.
    force
        Whether to replace a file that crossfield has not written or that has changed since. The underlay is
        never replaced.

    Returns
    -------
    Path
        The path of the picture.

    Raises
    ------
    InputError
        For an unknown kind or suffix, a kind that needs a field, and a drawing that cannot be read or has
        another position.
    OutputError
        When the file cannot be written, or if another one is in the way.

    """
    path = Path(path)
    suffix = path.suffix.lower()
    require_suffix(path, *SUFFIXES)
    reads = [underlay] if isinstance(underlay, str | Path) else []
    check_targets(path.parent, [path.name], reads=reads, force=force)
    if isinstance(subject, Surface):
        if kind is not None or underlay is not None:
            raise InputError("a surface has one picture, on no drawing; leave kind and underlay out")
        chosen = SHADED
    else:
        kind = kind or _default_kind(subject, suffix, underlaid=underlay is not None)
        chosen = _find_kind(kind, subject)
        if underlay is not None and isinstance(_instance_of(subject).domain, Mesh):
            raise DomainError("a mesh lies on no drawing; leave the underlay out")
        if kind == LAYERS and isinstance(subject, CrossField):
            draw_layers(subject, [path], underlay, force=force)
            return path
        if underlay is not None:
            raise InputError(f"a picture of kind {kind} lies on no drawing; use kind {LAYERS}")
    with fixed_settings({"font.size": chosen.words}):
        return write_bytes(path, _save_figure(_draw_panels(subject, chosen), suffix), force=force)


def preview(subject: CrossField | Instance | Surface) -> bytes:
    """Draw a small picture for notebooks.

    Parameters
    ----------
    subject
        An instance, a field or a surface.

    Returns
    -------
    bytes
        A PNG.

    """
    kind = SHADED if isinstance(subject, Surface) else KINDS[_default_kind(subject, ".png", underlaid=False)]
    with fixed_settings():
        return _save_figure(_draw_panels(subject, kind), ".png", dots=_PREVIEW_DOTS)


def _default_kind(subject: CrossField | Instance, suffix: str, *, underlaid: bool) -> str:
    """The default kind of picture."""
    if isinstance(subject, Instance):
        return "instance"
    if isinstance(subject.instance.domain, Mesh):
        return "crosses"
    return LAYERS if suffix == ".svg" or underlaid else "field"


def draw_layers(
    field: CrossField,
    paths: Iterable[Path],
    underlay: str | Path | Underlay | None,
    *,
    force: bool = False,
) -> None:
    """Draw a field in the coordinates of its drawing into files, whose layers are computed once."""
    if isinstance(underlay, str | Path):
        underlay = read_underlay(underlay, on=field.instance)
    layers = field_sheet(field, underlay)
    for path in paths:
        suffix = path.suffix.lower()
        if suffix == ".svg":
            write_bytes(path, sheet_svg(layers), force=force)
        else:
            with fixed_settings():
                write_bytes(path, _save_figure(draw_sheet(layers), suffix), force=force)


@contextmanager
def fixed_settings(more: dict[Any, Any] | None = None) -> Iterator[None]:
    """Constant settings of matplotlib, whatever the user's are, and some more."""
    import matplotlib as mpl

    settings = {"svg.hashsalt": "crossfield", "pdf.fonttype": 42, "font.size": _WORDS, "path.simplify": False}
    defaults = {key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith("backend")}
    with mpl.rc_context(defaults | settings | (more or {})):
        yield


def _save_figure(figure: Any, suffix: str, *, dots: int = _DOTS) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format=suffix[1:], dpi=dots, metadata=SUFFIXES[suffix])
    return stream.getvalue()


def _find_kind(kind: str, subject: Subject) -> PictureKind:
    """The kind of that name. Raises InputError for an unknown one, and for one that needs a field."""
    check_choice("kind of picture", kind, KINDS)
    if KINDS[kind].needs_field and isinstance(subject, Instance):
        raise InputError(
            f"{subject.name} is an instance without a field, which kind {kind} needs; solve it first, "
            "or use kind instance"
        )
    if isinstance(_instance_of(subject).domain, Mesh) and kind not in ON_MESHES:
        raise DomainError(
            f"a picture of kind {kind} shows pixels, and {_instance_of(subject).name} is on a mesh; "
            f"choose one of {', '.join(ON_MESHES)}"
        )
    return KINDS[kind]


def _instance_of(subject: Subject) -> Instance:
    return subject if isinstance(subject, Instance) else subject.instance


def _draw_on_mesh(subject: CrossField | Instance) -> Any:
    """The figure of a mesh with a caption below."""
    from matplotlib.figure import Figure

    side, below = _MESH_SIDE / _POINTS, (2 * _EDGE + _LINE * _WORDS) / _POINTS
    figure = Figure(figsize=(side, side + below), facecolor="white")
    axes = figure.add_axes((0.0, below / (side + below), 1.0, side / (side + below)))
    draw_mesh(axes, subject)
    caption = _SEPARATOR.join(_caption_parts(subject, full=False))
    figure.text(0.5, _EDGE / _POINTS / (side + below), caption, ha="center", color="#444444")
    return figure


def _draw_panels(subject: Subject, kind: PictureKind) -> Any:
    """The figure: panels with headings, legend and caption below; every length in points."""
    from matplotlib.figure import Figure

    instance = _instance_of(subject)
    if not isinstance(subject, Surface) and isinstance(instance.domain, Mesh):
        return _draw_on_mesh(subject)
    field = subject if isinstance(subject, CrossField) else None
    picture = panels.PanelContent(
        instance, field, kind.size, subject if isinstance(subject, Surface) else None
    )
    size = np.array([picture.unit * side for side in picture.instance.mask.shape[::-1]])
    line, character = _LINE * kind.words, _CHARACTER * kind.words
    above = line * any(heading for heading, _ in kind.panels)
    pitch = np.array([max(size[0], _NARROWEST), size[1] + above]) + _GAP
    grid = np.array([kind.columns, -(-len(kind.panels) // kind.columns)])
    inside = grid * pitch - _GAP + np.array([kind.bar, 0.0])
    keys = panels.legend_keys(picture) if kind.legend else []
    legend = character * sum(len(key.get_label()) + 6 for key in keys)
    wide = max(inside[0], legend, character * _LONGEST)
    caption = _wrap(_caption_parts(subject, full=len(kind.panels) > 1), int(wide / character))
    below = _EDGE + line * (len(caption) + bool(keys))
    page = np.array([wide + 2 * _EDGE, _EDGE + inside[1] + below])
    figure = Figure(figsize=tuple(page / _POINTS), facecolor="white")
    for number, (heading, panel) in enumerate(kind.panels):
        row, column = divmod(number, kind.columns)
        left = (page[0] - inside[0]) / 2 + column * pitch[0] + (pitch[0] - _GAP - size[0]) / 2
        corner = np.array([left, page[1] - _EDGE - row * pitch[1] - above - size[1]])
        axes = figure.add_axes((*(corner / page), *(size / page)))
        set_coordinates(axes, 0.0, 0.0, *size)
        axes.set_title(heading, fontsize=kind.words, pad=4)
        panel(axes, picture)
    for number, words in enumerate(reversed(caption)):
        figure.text(0.5, (_EDGE + number * line) / page[1], words, ha="center", va="bottom", color="#444444")
    if keys:
        place = (0.5, (_EDGE + line * len(caption) - 3) / page[1])
        spaces = {"borderaxespad": 0, "borderpad": 0.2, "handlelength": 1.4, "columnspacing": 1.4}
        style = {"bbox_to_anchor": place, "ncols": len(keys), "frameon": False}
        figure.legend(handles=keys, loc="lower center", **style, **spaces)
    return figure


def _wrap(parts: list[str], most: int) -> list[str]:
    """Parts of a caption in lines of so many characters, or of one part."""
    lines = parts[:1]
    for part in parts[1:]:
        longer = lines[-1] + _SEPARATOR + part
        lines = [*lines[:-1], longer] if len(longer) <= most else [*lines, part]
    return lines


def _caption_parts(subject: Subject, *, full: bool) -> list[str]:
    """Size and contents; if full, energies and gauge too."""
    instance = _instance_of(subject)
    domain, plural = instance.domain, "" if len(instance.theta) == 1 else "s"
    size = f"{domain.size} faces" if isinstance(domain, Mesh) else f"{domain.width} × {domain.height} pixels"
    parts = [size, f"{len(instance.theta)} stroke {domain.kind}{plural}"]
    if isinstance(subject, CrossField):
        parts.append(count_singularities(subject))
    if isinstance(subject, CrossField) and full:
        squared, absolute = (subject.energy(norm).total for norm in (2, 1))
        parts.append(f"energy {squared:.4g} (2-norm), {absolute:.4g} (1-norm)")
    return [*parts, f"gauge {instance.gauge}"] if full else parts


def count_singularities(field: CrossField) -> str:
    """The number of singularities by index, as 3 singularities (2 of +1/4, 1 of −1/2)."""
    values, counts = np.unique(np.round(4 * field.singularities.index).astype(int), return_counts=True)
    if not len(values):
        return "no singularity"
    parts = [
        f"{count} of {'−' if value < 0 else '+'}{Fraction(abs(value), 4)}"
        for value, count in zip(values[::-1].tolist(), counts[::-1].tolist(), strict=True)
    ]
    total = int(counts.sum())
    return f"{total} singularit{'y' if total == 1 else 'ies'} ({', '.join(parts)})"
