"""Sketches of a library: published files, and a site that accepts plain files alone."""

import shutil

import pytest
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.site.site import write_site
from crossfield.models.errors import InputError
from crossfield.models.instance.file import read_instance
from crossfield.models.sketch.drawing_file import suffix_by_content
from libraries import library_of
from loops import for_each
from PIL import Image
from small_drawings import png, read

pytestmark = pytest.mark.usefixtures("short_searches")

DRAWN = b"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 150 110" fill="none" stroke="#000">
<title>a window</title><path d="M20 30H120V90H20Z"/><path d="M20 60H120M70 30V90" stroke="#e00000"/></svg>"""
BLANK = Image.new("L", (3, 3), 255)
SPEC = """formulations = ["qp-fixed"]
[rungs.medium]
sizes = [8]
formats = ["lp"]
[[sketches]]
name = "window"
file = "window.xml"
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sketches")
    (folder / "window.xml").write_bytes(DRAWN)
    return library_of(folder, SPEC).folder


@pytest.fixture
def lib(built, tmp_path):
    return shutil.copytree(built, tmp_path / "lib")


def test_a_sketch_is_published_byte_for_byte_with_the_suffix_of_its_content(built):
    assert (built / "cf_window.sketch.svg").read_bytes() == DRAWN
    instance = read_instance(built / "cf_window_n008.instance.json")
    wanted = read(DRAWN, 8, "window.xml")
    assert (instance.theta.tolist(), instance.w.tolist()) == (wanted.theta.tolist(), wanted.w.tolist())
    assert verify_library(built) == []


@for_each(
    "data, suffix, expected",
    [
        (png(BLANK, "GIF"), ".html", ".gif"),
        (png(BLANK, "JPEG"), ".svg", ".jpg"),
        (png(BLANK, "PNG"), "", ".png"),
        (b"neither this nor that", ".html", ".pnm"),
        (b"#9 9\n{\n}\n", ".html", ".scap"),
        (b"v 2\n0 0 0\n1 0 0\n", ".svg", ".curves"),
        (DRAWN, ".html", ".svg"),
    ],
)
def test_the_suffix_of_a_published_file_follows_from_its_content(data, suffix, expected):
    assert suffix_by_content(data, suffix) == expected


@pytest.mark.parametrize("name", ["cf_window.sketch.svg", "SHA256SUMS"])
def test_a_site_refuses_a_link_and_names_it(lib, tmp_path, name):
    (lib / name).rename(tmp_path / "elsewhere")
    (lib / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match=f"{name}: is a symbolic link, .*put the file in its place"):
        write_site(lib, tmp_path / "site")
    assert not (tmp_path / "site").exists()
