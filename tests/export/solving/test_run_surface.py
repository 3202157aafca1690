"""A run shades the surface over its field if it can be trusted, states doubts, and stops for Ctrl-C."""

import json
from dataclasses import replace

import crossfield as cf
import pytest
from crossfield.export.cli.output import show_report
from crossfield.export.pictures.underlay import read_underlay
from crossfield.export.solving.methods import Candidate
from crossfield.export.solving.report import Report
from crossfield.export.solving.run import _draw_surface
from crossfield.export.surfaces.files import write_layers
from crossfield.models.processes.deadline import never, silent
from PIL import Image
from shapes import ball


@pytest.fixture(scope="module")
def report():
    """The report of a run that found one field."""
    field = cf.bend_field(cf.polyvector_field(cf.sample("mouse", 12)))
    return Report(field.instance, (Candidate("bend", field, 0.1),), (), stages={"start": 0.1})


def test_a_surface_without_doubts_is_drawn_and_one_with_is_not(report, tmp_path, capsys):
    drawn = _draw_surface(report, tmp_path, None, silent, never)
    trusted = not drawn.surface.doubts
    assert drawn.shaded == trusted
    assert {path.name for path in tmp_path.iterdir()} == ({"shaded.png", "normals.png"} if trusted else set())
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


def test_ctrl_c_before_the_surface_leaves_the_rest(report, tmp_path):
    def pressed(line):
        assert "surface" in line
        raise KeyboardInterrupt

    ended = _draw_surface(report, tmp_path, None, pressed, never)
    assert ended.interrupted == "surface"
    assert ended.surface is None
    assert ended.document()["surface"] is None
    assert not list(tmp_path.iterdir())


def test_the_layers_of_a_run_are_those_of_the_command(report, tmp_path):
    surface = cf.surface(report.field)
    cf.write_surface(surface, tmp_path / "folder", drawing="mouse")
    write_layers(surface, tmp_path, read_underlay("mouse", on=report.instance))
    for name in ("normals.png", "shaded.png"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "folder" / name).read_bytes()
        with Image.open(tmp_path / name) as picture:
            assert (picture.mode, picture.size) == ("RGBA", (2000, 1670))
