"""Small drawings as bytes, and their instances."""

import io
from pathlib import Path

from crossfield.models.sketch.drawing_file import parse_drawing
from crossfield.models.sketch.labels import label_of
from crossfield.models.sketch.read import instance_of_drawing

BLACK = 'fill="none" stroke="black"'
RED = 'fill="none" stroke="#d1242f"'


def svg(body, head='viewBox="0 0 100 100"'):
    """An SVG drawing of these elements."""
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" {head}>{body}</svg>'
    ).encode()


def png(image, kind="PNG", **options):
    """The bytes of a picture."""
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


def read(data, size=24, source="a.svg", *, curvature=(), view=None, **options):
    """The instance of a drawing in the bytes of a file of this name."""
    labels = tuple(map(label_of, curvature))
    drawing = parse_drawing(data, Path(source).suffix, size, labels=labels, view=view)
    return instance_of_drawing(drawing, size, name="a", source=source, **options)
