"""Malicious and damaged inputs: each is read or refused in time and memory in proportion to its size."""

import io
import json
import os
import re
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from archives import pack_arrays
from crossfield.models import input_limits
from crossfield.models.instance.file import instance_arrays
from crossfield.models.sketch.svg import read_svg
from instance_kinds import kind
from PIL import Image

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40">{}</svg>'
STROKES = '<path d="M5 5 L55 35 M5 35 L55 5" stroke="black"/>'


def styled(text):
    return SVG.format(f"<style>{text}</style>{STROKES}").encode()


def drawn(shape, count=1):
    return SVG.format(shape * count).encode()


ZIGZAG = "".join(f"L{k % 60} {k % 40}" for k in range(200))
COSTLY_SVG = {
    **{
        f"style of {text!r}": styled(text * 60_000)
        for text in ("a", "@", "{", "/*", " ", "(", "a;", "@a{", "@layer{", "a{", "\\", '"')
    },
    "a selector of many": styled(",".join(f".c{k}" for k in range(20_000)) + "{stroke:red}"),
    "uses of one path": drawn(f'<path id="p" stroke="black" d="M0 0{ZIGZAG}"/>' + '<use href="#p"/>' * 200),
    "rules and paths": SVG.format(
        "<style>" + "".join(f".c{k}{{stroke:red}}" for k in range(2000)) + "</style>"
        + "".join(f'<path class="c{k}" d="M5 5 L{k % 55} 35"/>' for k in range(2000))
    ).encode(),
    "rules of one class": SVG.format(
        "<style>" + "".join(f".d{k}.c{{stroke:red}}" for k in range(5000)) + "</style>"
        + "".join(f'<path class="c e{k}" d="M5 5 L{k % 55} 35"/>' for k in range(5000))
    ).encode(),
    "closed subpaths": drawn('<path stroke="black" d="M5 5' + "L3 4z" * 10_000 + '"/>'),
    "a point list without blanks": drawn('<polyline stroke="black" points="' + "1" * 100_000 + '"/>'),
    "a colour of digits": drawn('<path stroke="rgb(' + "1" * 50_000 + '" d="M5 5L9 9"/>'),
    "a transform that never closes": drawn(
        '<path stroke="black" transform="' + "translate(" * 40_000 + '" d="M5 5L9 9"/>'
    ),
    "opacities of pages": drawn(f'<g opacity=".5">{STROKES}</g>', 20_000),
    "masks of many": drawn(
        '<mask id="m">' + '<rect width="60" height="40" fill="white"/>' * 200 + "</mask>"
        + f'<g mask="url(#m)">{STROKES}</g>' * 900
    ),
    "masks of uses of uses": drawn(
        f'<mask id="m"><g id="a0">{STROKES}</g>'
        + "".join(f'<g id="a{k + 1}"><use href="#a{k}"/><use href="#a{k}"/></g>' for k in range(40))
        + f'</mask><g mask="url(#m)">{STROKES}</g>'
    ),
    "a mask of itself": drawn(
        f'<mask id="m"><g mask="url(#m)">{STROKES}</g></mask>{STROKES}<g mask="url(#m)">{STROKES}</g>'
    ),
    "selectors of many ancestors": SVG.format(
        "<style>" + "".join(f"g g g g g path.c{k % 7}{{stroke:red}}" for k in range(2000)) + "</style>"
        + "<g>" * 40 + '<path class="c0 c1 c2" d="M5 5 L50 35"/>' * 2000 + "</g>" * 40
    ).encode(),
    "selectors of alternatives": SVG.format(
        "<style>:is(q * * * *, r) * * *{stroke:red}</style>"
        + "<g>" * 40 + '<path d="M5 5 L50 35"/>' * 20 + "</g>" * 40
    ).encode(),
    "variables of variables": styled(
        "svg{" + "".join(f"--a{k + 1}:var(--a{k})var(--a{k});" for k in range(40)) + "--a0:red}"
        + "path{stroke:var(--a40)}"
    ),
    "uses of uses": SVG.format(
        f'<g id="a0">{STROKES}</g>'
        + "".join(f'<g id="a{k + 1}"><use href="#a{k}"/></g>' for k in range(9000))
    ).encode(),
}  # fmt: skip


def archive_with(name, shape, descr, length):
    """An instance in which one array consists of so many zero bytes."""
    arrays = {key: array for key, array in instance_arrays(kind("square")).items() if key != name}
    data = io.BytesIO(pack_arrays(arrays))
    entry = zipfile.ZipInfo(f"{name}.npy")
    entry.compress_type = zipfile.ZIP_DEFLATED
    with zipfile.ZipFile(data, "a") as archive, archive.open(entry, "w") as stream:
        np.lib.format.write_array_header_1_0(stream, {"descr": descr, "fortran_order": False, "shape": shape})
        for _ in range(length >> 20):
            stream.write(bytes(1 << 20))
    return data.getvalue()


def png(side):
    """White picture with a thick black line, 3 bytes per pixel, a few hundred times smaller as a file."""
    values = np.full((side, side, 3), 255, dtype=np.uint8)
    values[side // 2 : side // 2 + 60] = 0
    stream = io.BytesIO()
    Image.fromarray(values).save(stream, "PNG")
    return stream.getvalue()


def repeated_strokes(tmp_path):
    cf.write_instance(kind("square"), tmp_path / "a.json")
    document = json.loads((tmp_path / "a.json").read_text())
    document["strokes"] = document["strokes"][:1] * 300_000
    return json.dumps(document).encode()


READER = """
import json, resource, sys
from pathlib import Path
import crossfield as cf

def peak():
    # Linux counts in ru_maxrss what the parent had before the program was loaded.
    status = Path("/proc/self/status")
    if status.exists():
        return int(status.read_text().split("VmHWM:")[1].split()[0]) // 1024
    unit = 1 << 20 if sys.platform == "darwin" else 1 << 10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // unit

resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
for path in sys.argv[1:]:
    try:
        (cf.read_instance if path.endswith(("npz", "json")) else lambda p: cf.read_sketch(p, size=24))(path)
        message = ""
    except cf.CrossfieldError as error:
        message = str(error)
    print(json.dumps([path, message, peak()]), flush=True)
"""


def read_by_child(*paths):
    """Error message and memory in MB per file, from one process with 60 s of processor time for all files."""
    done = subprocess.run(
        [sys.executable, "-c", READER, *map(str, paths)], check=False, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    results = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(results) == len(paths)
    return {Path(path).name: (message, memory) for path, message, memory in results}


@pytest.mark.slow
def test_costly_drawings_are_read_or_refused_in_little_time(tmp_path):
    """Without the limits most of them take minutes."""
    paths = [tmp_path / f"{number}.svg" for number in range(len(COSTLY_SVG))]
    for path, data in zip(paths, COSTLY_SVG.values(), strict=True):
        path.write_bytes(data)
    messages = [message for message, _ in read_by_child(*paths).values()]
    refused = {name: message for name, message in zip(COSTLY_SVG, messages, strict=True) if message}
    assert set(refused) == {
        "rules of one class", "a point list without blanks", "a colour of digits",
        "a transform that never closes", "uses of uses", "opacities of pages", "masks of many",
        "masks of uses of uses", "selectors of many ancestors", "selectors of alternatives",
    }  # fmt: skip
    assert f"more than {input_limits.MAX_LAYERS} clips" in refused["opacities of pages"]
    assert f"more than {input_limits.MAX_ELEMENTS} elements" in refused["masks of uses of uses"]
    assert f"nested more than {input_limits.MAX_DEPTH} deep" in refused["uses of uses"]
    assert f"more than {input_limits.MAX_RULE_CHECKS} comparisons" in refused["rules of one class"]
    assert f"more than {input_limits.MAX_TRANSFORM} characters" in refused["a transform that never closes"]


@pytest.mark.slow
def test_small_files_do_not_take_much_memory(tmp_path):
    """The picture comes last, because the memory is measured for the whole process."""
    files = {
        "extra.npz": archive_with("extra", (1 << 27,), "|u1", 1 << 27),
        "mask.npz": archive_with("mask", (20_000, 10_000), "|b1", 200 << 20),
        "strokes.json": repeated_strokes(tmp_path),
        "many.scap": b"#60\t40\n@1\n{\n#1\t1\n" + b"1\t2\t1\n3\t4\t1\n" * 1_000_000 + b"}\n",
        "big.png": png(8900),
    }
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    results = read_by_child(*(tmp_path / name for name in files))
    messages = {name: words for name, (words, _) in results.items()}
    assert messages["big.png"] == ""
    assert "holds an array 'extra' that does not belong in it" in messages["extra.npz"]
    assert (
        "array 'mask' has shape (20000, 10000); expected 2 dimensions of at most 9999" in messages["mask.npz"]
    )
    assert "lists 300000 stroke pixels, but its mask has 4 pixels" in messages["strokes.json"]
    assert f"more than {input_limits.MAX_LINES} lines" in messages["many.scap"]
    assert results["many.scap"][1] < 350
    assert results["big.png"][1] < 450


STRANGE_SVG = {
    **{
        f"{data} without a move": (f'<path stroke="black" d="{data}"/>', "not with a move (M)")
        for data in ("C 1 1 2 2 3 3", "T 1 1", "Q 1 1 2 2", "S 1 1 2 2", "A 1 1 0 0 0 2 2", "L 1 1 2 2")
    },
    "a length in em": ('<line stroke="black" x1="1em" x2="32" y1="4" y2="4"/>', [16, 4, 32, 4]),
    "data that ends in em": ('<path stroke="black" d="M1 1 L5em"/>', "its path data is faulty near 'M1 1"),
    "a number and em": ('<path stroke="black" d="M1 1 L5 5em"/>', [1, 1, 5, 5]),
    "an unknown unit": ('<circle stroke="black" r="1vw"/>', "its r '1vw' cannot be read"),
    "a negative radius": ('<circle stroke="black" r="-3"/>', "its r is -3"),
    "half a point": ('<polyline stroke="black" points="1,1 5,5 9"/>', [1, 1, 5, 5]),
    "points with a word": ('<polyline stroke="black" points="1,1 5,5 x 9,9"/>', [1, 1, 5, 5]),
    "data to a word": ('<path stroke="black" d="M1 1L5 5 9 9L foo"/>', [1, 1, 9, 9]),
    "data to a flag of 2": ('<path stroke="black" d="M1 1L5 5A3 3 0 2 0 9 9L7 7"/>', [1, 1, 5, 5]),
    "digits in a style": (
        f'<path style="stroke-width:{"1" * 5000}" stroke="black" d="M1 1 L5 5"/>', [1, 1, 5, 5]
    ),
    "a smooth curve after another kind": (
        '<path stroke="black" d="M0 0Q2 2 4 0S6 3 9 0" />',
        [0, 0, 9, 0],
    ),
}  # fmt: skip


def test_strange_shapes_are_read_as_browsers_do_or_refused_where_nothing_is_left():
    for shape, expected in STRANGE_SVG.values():
        drawing = SVG.format(shape).encode()
        if isinstance(expected, str):
            with pytest.raises(cf.InputError, match=re.escape(expected)):
                read_svg(drawing)
        else:
            points = read_svg(drawing).points
            assert [*points[0, 0], *points[-1, -1]] == pytest.approx(expected)


FAULTY = {
    '<circle id="wheel" stroke="black" r="-3"/>': '<circle id="wheel">: its r is -3; export',
    '<path stroke="black" d="M1e999 1L5 5"/>': "<path>: a coordinate is not a finite number below 1e+09",
}


def test_a_faulty_shape_is_noted_by_its_name_and_the_others_are_read():
    whole = '<path stroke="black" d="M1 1L5 5"/>'
    for shape, fault in FAULTY.items():
        curves = read_svg(SVG.format(whole + shape).encode())
        assert len(curves.points) == 1
        assert f"1 shape is faulty and left out from the fault on, first {fault}" in curves.notes[0]
    curves = read_svg(SVG.format(whole + "".join(FAULTY)).encode())
    assert curves.notes[0].startswith(
        '2 shapes are faulty and left out from the fault on, first <circle id="'
    )


def test_pages_without_extent_and_floating_point_pictures_are_refused(tmp_path):
    (tmp_path / "a.scap").write_text("#1e-320\t1\n{\n1\t2\t1\n3\t4\t1\n}\n")
    (tmp_path / "a.svg").write_text(SVG.replace("60 40", "1e-320 40").format(STROKES))
    Image.fromarray(np.ones((40, 60), dtype=np.float32)).save(tmp_path / "a.tiff")
    for suffix, words in (
        ("scap", "1e-320"),
        ("svg", "1e-320"),
        ("tiff", "floating point; save it with 8 or"),
    ):
        with pytest.raises(cf.InputError, match=words):
            cf.read_sketch(tmp_path / f"a.{suffix}")


def test_damaged_tiffs_are_refused(tmp_path):
    values = np.full((40, 60), 255, dtype=np.uint8)
    values[20:23] = 0
    refused = 0
    for packing in ("tiff_lzw", "tiff_deflate", "packbits"):
        Image.fromarray(values).save(tmp_path / "a.tiff", compression=packing)
        whole = bytearray((tmp_path / "a.tiff").read_bytes())
        for at in range(8, len(whole), 40):
            damaged = whole.copy()
            damaged[at : at + 4] = b"\xff\x00\x07\x80"
            (tmp_path / "a.tiff").write_bytes(damaged[: len(damaged)])
            try:
                cf.read_sketch(tmp_path / "a.tiff", size=6)
            except cf.CrossfieldError:
                refused += 1
    assert refused


def test_compressed_tiffs_read_as_uncompressed_ones_do(tmp_path):
    values = np.full((40, 60, 3), 255, dtype=np.uint8)
    values[20:23] = 0
    for mode, packing in (("1", "group4"), ("P", "tiff_lzw"), ("RGBA", "tiff_deflate"), ("CMYK", "packbits")):
        orientation = Image.Exif()
        orientation[0x112] = 6
        for name, compression in (("plain", "raw"), ("packed", packing)):
            image = Image.fromarray(values).convert(mode)
            image.save(tmp_path / f"{name}.tiff", compression=compression, exif=orientation)
        plain, packed = (cf.read_sketch(tmp_path / f"{name}.tiff", size=12) for name in ("plain", "packed"))
        assert (packed.mask.shape, packed.theta.tolist()) == (plain.mask.shape, plain.theta.tolist())
        assert packed.mask.shape[0] > packed.mask.shape[1]


def test_logs_of_pillow_are_not_printed(tmp_path):
    Image.new("RGB", (6, 4)).save(tmp_path / "a.tiff")
    data = (tmp_path / "a.tiff").read_bytes()
    samples = struct.pack("<HHIH", 277, 3, 1, 3)
    assert data.count(samples) == 1
    (tmp_path / "a.tiff").write_bytes(data.replace(samples, struct.pack("<HHIH", 277, 3, 1, 99)))
    command = [sys.executable, "-m", "crossfield", "instance", "a.tiff", "-o", "a.json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.splitlines() == ["crossfield: " + done.stderr.strip().removeprefix("crossfield: ")]


def test_texts_from_files_are_safe_in_messages(tmp_path):
    strange = "a\x1b[31m\u202eb\u200b\x07\x9b\udcffc\u2028d"
    assert str(cf.InputError(strange)) == r"a\x1b[31m\u202eb\u200b\x07\x9b\udcffc d"
    assert str(cf.InputError("Öl – 12.3° 図")) == "Öl – 12.3° 図"
    error = cf.InputError(f"{strange}{'long ' * 10_000}; write it again", file=tmp_path / "a\u202eb.svg")
    assert str(error).isprintable()
    assert str(error).endswith("; write it again")
    assert r"a\u202eb.svg: " in str(error)
    assert len(str(error)) < 3000
    assert str(cf.InputError(str(error))).endswith("; write it again")


def test_output_is_escaped_on_a_terminal_without_unicode(tmp_path):
    """Drawings may have any name."""
    (tmp_path / "Skizze – 図.svg").write_text(SVG.format(STROKES))
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    command = [sys.executable, "-m", "crossfield", "instance", tmp_path / "Skizze – 図.svg", "--size", "8"]
    for output, code in (("ö.json", 0), ("ö.txt", 1)):
        done = subprocess.run(
            [*command, "-o", tmp_path / output], check=False, capture_output=True, env=environment
        )
        assert (done.returncode, b"internal error" in done.stderr) == (code, False)
        assert done.stdout + done.stderr


def test_written_files_obey_the_umask(tmp_path):
    if os.name == "nt":
        pytest.skip("Windows has no umask")
    for mask in (0o077, 0o027, 0o002):
        before = os.umask(mask)
        try:
            cf.write_instance(kind("square"), tmp_path / f"{mask}.json")
        finally:
            os.umask(before)
        assert (tmp_path / f"{mask}.json").stat().st_mode & 0o777 == 0o666 & ~mask
