"""Pictures of instances, cross fields and surfaces as PNG or SVG: same input, same bytes.

Most kinds are panels with words round them; `layers` is the bare field in the coordinates of its drawing.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Final

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
from .layers import field_sheet
from .marks import PAPER, Area, Layer, Mark, Sheet, TextMark
from .mesh_view import AXES, draw_mesh
from .svg import encode_png, load_font, render_sheet, sheet_svg
from .underlay import Underlay, read_underlay

_WORDS: Final = 7.5  # points of text


@dataclass(frozen=True)
class PictureKind:
    """A kind of picture: panels with headings; no panels: the layers on the page of a drawing.

    size: points of the longer side of a panel. columns: panels in a row. bar: points to the right for a
    colour bar. legend: keys below. words: points of text.
    """

    panels: tuple[tuple[str, panels.DrawPanel], ...]
    size: float = 340.0
    columns: int = 1
    bar: float = 0.0
    legend: bool = False
    words: float = _WORDS


LAYERS: Final = "layers"

KINDS: Final = {
    "instance": PictureKind((("", panels.draw_instance),)),
    "crosses": PictureKind((("", panels.draw_crosses),), legend=True),
    "field": PictureKind((("", panels.draw_streamlines),), legend=True),
    "angle": PictureKind((("angle between the lines", panels.draw_angle),), bar=32.0),
    "overview": PictureKind(
        (
            ("instance", panels.draw_instance),
            ("crosses", panels.draw_crosses),
            ("streamlines", panels.draw_streamlines),
            ("angle map", panels.draw_angle),
        ),
        size=165.0,
        columns=2,
        bar=38.0,
        legend=True,
        words=10.0,
    ),
    LAYERS: PictureKind(()),
}
"""Kinds of pictures of instances and fields by name."""

SHADED: Final = PictureKind((("", panels.draw_surface),))
"""The picture of a surface; `crossfield shade` writes others."""

Subject = CrossField | Instance | Surface

SUFFIXES: Final = (".png", ".svg")
"""File suffixes."""

_DOTS: Final = 220 / 72  # dots per point of a PNG
_PREVIEW_DOTS: Final = 96 / 72
_LAYERS_SIDE: Final = 1222  # dots of the longer side of layers as PNG
_EDGE: Final = 9.0
_GAP: Final = 14.0
_LINE: Final = 1.6  # height of a line of text, in its size
CROSSES_UP_TO: Final = 12  # pixels of the longer side of a grid that has crosses on a page, not streamlines
_MESH_SIDE: Final = 400.0  # points of the side of a picture of a mesh
ON_MESHES: Final = ("instance", "crosses")  # kinds of pictures of instances and fields on meshes


def draw(
    subject: CrossField | Instance | Surface,
    path: str | Path,
    *,
    kind: str | None = None,
    underlay: str | Path | Underlay | None = None,
    up: str | None = None,
    force: bool = False,
) -> Path:
    """Draw an instance, a field or a surface into a file, and return its path.

    Parameters
    ----------
    subject
        An Instance, a CrossField or a Surface.
    path
        The file to write; its suffix, .png or .svg, decides the format.
    kind
        A name in KINDS; an Instance has only `instance`, and a Surface one picture without a name. By default
        `layers` for a field as SVG or with an underlay, `crosses` on a mesh, and `field` otherwise.
    underlay
        The drawing (SVG, bitmap, .scap) or sample from which the instance was read. Its strokes become the
        bottom of `layers`; nothing else of the file is copied.
    up
        Axis of a mesh that points upwards: `x`, `y` or `z`, by default `z`.
    force
        Whether to replace a file that crossfield has not written or that has changed since. The underlay is
        never replaced.

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
    if up is not None:
        check_choice("axis", up, AXES)
        if isinstance(subject, Surface) or not isinstance(_instance_of(subject).domain, Mesh):
            raise DomainError("a picture of pixels has no axis upwards; leave up out")
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
    sheet = _panels_sheet(subject, chosen, up or "z")
    return write_bytes(path, sheet_svg(sheet) if suffix == ".svg" else _to_png(sheet, _DOTS), force=force)


def preview(subject: CrossField | Instance | Surface) -> bytes:
    """A small picture for notebooks, as PNG."""
    kind = SHADED if isinstance(subject, Surface) else KINDS[_default_kind(subject, ".png", underlaid=False)]
    return _to_png(_panels_sheet(subject, kind), _PREVIEW_DOTS)


def page_picture(field: CrossField) -> bytes:
    """A picture for a page: PNG of a mesh, SVG of pixels, with streamlines where they are many."""
    on_mesh = isinstance(field.instance.domain, Mesh)
    few = on_mesh or max(field.instance.mask.shape) <= CROSSES_UP_TO
    sheet = _panels_sheet(field, KINDS["crosses" if few else "field"])
    return _to_png(sheet, _PREVIEW_DOTS) if on_mesh else sheet_svg(sheet)


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
    sheet = field_sheet(field, underlay)
    paper = Layer("", (Area(PAPER, np.array([sheet.page]) + np.array([0, 0, *sheet.page[:2]])),))
    for path in paths:
        if path.suffix.lower() == ".svg":
            data = sheet_svg(sheet)
        else:
            data = _to_png(replace(sheet, layers=(paper, *sheet.layers)), _LAYERS_SIDE / max(sheet.page[2:]))
        write_bytes(path, data, force=force)


def _to_png(sheet: Sheet, dots: float) -> bytes:
    """A sheet as PNG. dots: per unit of the page."""
    return encode_png(render_sheet(sheet, *(max(1, round(dots * side)) for side in sheet.page[2:])))


def _find_kind(kind: str, subject: Subject) -> PictureKind:
    """The kind of that name. Raises InputError for an unknown one, and for one that needs a field."""
    check_choice("kind of picture", kind, KINDS)
    if kind != "instance" and isinstance(subject, Instance):
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


def _panels_sheet(subject: Subject, kind: PictureKind, up: str = "z") -> Sheet:
    """Panels with headings, legend and caption below; every length in points. A mesh has one panel.

    up: the axis of a mesh that points upwards.
    """
    instance = _instance_of(subject)
    field = subject if isinstance(subject, CrossField) else None
    on_mesh = isinstance(instance.domain, Mesh)
    shape = (1, 1) if on_mesh else instance.mask.shape
    size = (_MESH_SIDE if on_mesh else kind.size) / max(shape) * np.array(shape[::-1])
    line, above = _LINE * kind.words, _LINE * kind.words * any(heading for heading, _ in kind.panels)
    pitch = size + np.array([_GAP, _GAP + above])
    grid = np.array([kind.columns, -(-len(kind.panels) // kind.columns)])
    inside = grid * pitch - _GAP + np.array([kind.bar, 0.0])
    keys = panels.legend(field) if field and kind.legend and not on_mesh else []
    font = load_font(kind.words)
    lengths = [font.getlength(text) + _GAP for text, _ in keys]
    caption = _caption_lines(subject, full=len(kind.panels) > 1)
    wide = max(inside[0], sum(lengths), *map(font.getlength, caption))
    page = (
        0.0,
        0.0,
        float(wide + 2 * _EDGE),
        float(2 * _EDGE + inside[1] + line * (bool(keys) + len(caption))),
    )
    marks: list[Mark] = [Area(PAPER, np.array([page]))]
    for number, (heading, panel) in enumerate(kind.panels):
        row, column = divmod(number, kind.columns)
        x, y = (page[2] - inside[0]) / 2 + column * pitch[0], _EDGE + above + row * pitch[1]
        if heading:
            marks.append(TextMark(heading, (x + size[0] / 2, y - 0.4 * line), kind.words, "#000000"))
        if not isinstance(subject, Surface) and on_mesh:
            marks.append(draw_mesh(subject, _MESH_SIDE, up))
            continue
        surface = subject if isinstance(subject, Surface) else None
        marks += panel(panels.PanelContent(instance, field, kind.size, surface, (x, y), kind.words))
    x, y = (page[2] - sum(lengths) + _GAP) / 2, _EDGE + inside[1] + line
    for (text, colour), length in zip(keys, lengths, strict=True):
        marks.append(TextMark(text, (x, y), kind.words, colour, "start"))
        x += length
    y += line * bool(keys)
    marks += [TextMark(text, (page[2] / 2, y + k * line), kind.words) for k, text in enumerate(caption)]
    return Sheet(page, (Layer("", tuple(marks)),))


def _caption_lines(subject: Subject, *, full: bool) -> list[str]:
    """Size and contents; if full, energies and gauge too."""
    instance = _instance_of(subject)
    domain, plural = instance.domain, "" if len(instance.theta) == 1 else "s"
    size = f"{domain.size} faces" if isinstance(domain, Mesh) else f"{domain.width} × {domain.height} pixels"
    gauge = f"  ·  gauge {instance.gauge}" if full else ""
    lines = [f"{size}  ·  {len(instance.theta)} stroke {domain.kind}{plural}{gauge}"]
    if isinstance(subject, CrossField):
        lines.append(count_singularities(subject))
    if isinstance(subject, CrossField) and full:
        squared, absolute = (subject.energy(norm).total for norm in (2, 1))
        lines.append(f"energy {squared:.4g} (2-norm), {absolute:.4g} (1-norm)")
    return lines


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
