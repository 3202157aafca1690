"""A run shades the surface over its field if it can be trusted, states doubts, and stops for Ctrl-C."""

import json
from dataclasses import replace

import crossfield as cf
import pytest
from crossfield.export.cli.output import show_report
from crossfield.export.pictures.underlay import read_underlay
from crossfield.export.runs.methods import Candidate, Request
from crossfield.export.runs.report import Report
from crossfield.export.runs.run import OVERLAY, PICTURES, _Pictures, picture_name
from crossfield.export.surfaces.files import write_layers
from crossfield.models.processes.deadline import never, silent
from folders import contents
from PIL import Image
from shapes import ball


@pytest.fixture(scope="module")
def report():
    """The report of a run that found one field."""
    field = cf.bend_field(cf.polyvector_field(cf.sample("mouse", 12)))
    return Report(field.instance, (Candidate("bend", field, 0.1),), (), stages={"start": 0.1})


def draw(report, folder, progress=silent, stop=never):
    request = Request(report.instance, folder, progress=progress, stop=stop)
    return _Pictures(report.field, None, request, "").draw_all(folder)


def test_a_surface_without_doubts_is_drawn_and_one_with_is_not(report, tmp_path, capsys):
    drawn = draw(report, tmp_path)
    layers = set() if drawn.surface.doubts else {"shaded.png", "normals.png"}
    assert contents(tmp_path).keys() == {*map(picture_name, PICTURES), *OVERLAY} | layers
    for surface, doubt in ((ball(8), ""), (replace(ball(8), doubts=("it is flat",)), "it is flat")):
        with_surface = replace(report, surface=surface)
        document = json.loads(json.dumps(with_surface.document()))["surface"]
        assert document["doubts"] == ([doubt] if doubt else [])
        assert document["picture"] == (None if doubt else "shaded.png")
        show_report(with_surface, tmp_path)
        text = " ".join(capsys.readouterr().out.split())
        shown = "no shaded surface: it is flat; crossfield shade draws it" if doubt else "and normals.png"
        assert shown in text
        assert ("no shaded surface" in text) == bool(doubt)


def test_a_request_to_stop_before_the_surface_keeps_the_pictures(report, tmp_path):
    lines = []
    ended = draw(report, tmp_path, lines.append, lambda: "surface" in str(lines[-1:]))
    assert ended.interrupted == "surface"
    assert {path.name for path in tmp_path.iterdir()} >= {*map(picture_name, PICTURES), *OVERLAY}


def test_the_layers_of_a_run_are_those_of_the_command(report, tmp_path):
    surface = cf.surface(report.field)
    cf.write_surface(surface, tmp_path / "folder", drawing="mouse")
    write_layers(surface, tmp_path, read_underlay("mouse", on=report.instance))
    for name in ("normals.png", "shaded.png"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "folder" / name).read_bytes()
        with Image.open(tmp_path / name) as picture:
            assert (picture.mode, picture.size) == ("RGBA", (1200, 1002))
