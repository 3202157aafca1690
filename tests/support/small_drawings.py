"""Small drawings as bytes, and their instances."""

import io
import tempfile
from pathlib import Path

import crossfield as cf

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


def read(data, size=24, source="a.svg", **options):
    """The instance of a drawing in the bytes of a file of this name."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, source)
        path.write_bytes(data)
        return cf.read_sketch(path, size=size, name="a", **options)
