"""Sets of files and their manifests: round trip, determinism, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cases import SKEWED, make_field, make_instance, make_problem
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_all, write_problem
from crossfield.export.formats.registry import FORMATS, write
from crossfield.models.errors import (
    FormulationError,
    InputError,
    InstanceError,
    UnsupportedByFormatError,
)
from crossfield.models.formulations.problem import with_integers_fixed
from crossfield.models.instance.file import read_instance, write_instance
from folders import contents
from loops import for_each

OPTIONS = [
    ("milp-mccormick", {"facet": "printed", "stroke_norm": 2, "relax": True}),
    ("miqcp-bilinear", {"beta_norm": 1}),
    *((name, {}) for name in SKEWED),
]


@for_each("name, options", OPTIONS)
@for_each("gauge", ["strokes", "box"])
def test_a_manifest_gives_its_problem_back(name, options, gauge, tmp_path):
    problem = make_problem(name, make_instance(gauge=gauge), **options)
    manifest = write_problem(problem, tmp_path)
    assert manifest.path == tmp_path / f"tiny.{name}.manifest.json"
    again = read_manifest(manifest.path)
    assert again.document == manifest.document
    assert (again.formulation, again.folder) == (name, tmp_path)
    rebuilt = again.problem()
    assert rebuilt.sha256 == problem.sha256
    assert rebuilt.instance.sha256 == problem.instance.sha256
    np.testing.assert_array_equal(rebuilt.lower, problem.lower)
    if name == "qp-fixed":
        np.testing.assert_array_equal(rebuilt.jumps, problem.jumps)


def test_refused_and_lifted_formats_are_listed(tmp_path):
    instance = make_instance()
    parity, quartic = write_all(instance, tmp_path, formulations=["minlp-parity", "minlp-quartic"])
    assert set(parity.document["refused"]) == {"lp", "mps"}
    assert all("minlp-quartic" in reason for reason in parity.document["refused"].values())
    assert {entry["format"] for entry in parity.document["files"]} == {"nl", "gms"}
    assert not (tmp_path / "tiny.minlp-parity.lp").exists()
    by_format = {entry["format"]: entry["lifted"] for entry in quartic.document["files"]}
    assert by_format["nl"] == by_format["gms"] == ""
    assert by_format["lp"] == by_format["mps"] == "z = p1 beta_i with the hull facets (26)-(29), exact"


def test_jumps_come_from_the_start(tmp_path):
    instance = make_instance("full")
    field = make_field(instance)
    (manifest,) = write_all(instance, tmp_path, formulations=["qp-fixed"], formats=["mps"], start=field)
    np.testing.assert_array_equal(manifest.problem().jumps, field.p)
    listed = dict(manifest.document["jumps"])
    assert listed == {pair: jump for pair, jump in enumerate(field.p.tolist()) if jump}


def test_options_apply_where_a_formulation_has_them(tmp_path):
    instance, messages = make_instance(), []
    manifests = write_all(
        instance,
        tmp_path,
        formats=["nl"],
        start=make_field(instance),
        options={"facet": "printed", "relax": True},
        progress=messages.append,
    )
    assert messages == SKEWED
    options = {manifest.formulation: manifest.document["options"] for manifest in manifests}
    assert options["milp-mccormick"]["facet"] == "printed"
    assert options["miqp-exact"] == {"facet": "hull", "stroke_norm": 2, "beta_norm": 2, "relax": True}
    assert options["qp-fixed"]["relax"] is False
    with pytest.raises(FormulationError, match="there is no option 'nonsense'; choose one of facet"):
        write_all(instance, tmp_path, options={"nonsense": 1}, start=make_field(instance))


def test_the_instance_is_that_of_the_last_export(tmp_path):
    for instance in (make_instance(), make_instance(seed=8)):
        write_all(instance, tmp_path, formulations=["milp-mccormick"], formats=["lp"])
        assert read_instance(tmp_path / "tiny.instance.json").sha256 == instance.sha256


# what is refused


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """A manifest of qp-fixed with its instance beside it."""
    return write_problem(make_problem("qp-fixed", make_instance()), tmp_path, formats=["nl"]).path


def changed(path: Path, *keys: str, value: object) -> Path:
    document = json.loads(path.read_text())
    place = document
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    path.write_text(json.dumps(document))
    return path


def test_another_instance_beside_a_manifest_is_refused(written):
    write_instance(make_instance(seed=9), written.parent / "tiny.instance.json")
    with pytest.raises(InstanceError, match=r"tiny\.instance\.json: is another instance"):
        read_manifest(written).problem()
    (written.parent / "tiny.instance.json").unlink()
    with pytest.raises(InputError, match=r"tiny\.instance\.json: cannot be read"):
        read_manifest(written).problem()


def test_damaged_manifests_are_refused(written):
    whole = written.read_bytes()
    other = [b"[]", b"null", b'"crossfield-manifest"', b"\xff\xfe", b"[" * 100000]
    other += [b'{"format": "crossfield-instance", "version": 1}']
    for text in (*other, *(whole[:end] for end in range(0, len(whole) - 2, 37))):
        written.write_bytes(text)
        with pytest.raises(InstanceError, match=r"tiny\.qp-fixed\.manifest\.json: ") as error:
            read_manifest(written)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "keys, value, message",
    [
        (["version"], 2, "has version 2, but this program reads version 1"),
        (["version"], True, "version"),
        (["unknown"], 1, "unknown"),
        (["options", "colour"], 1, "colour"),
        (["instance", "file"], "../tiny.instance.json", "instance.file"),
        (["instance", "file"], "a/b.json", "instance.file"),
        (["instance", "file"], "a\\b.json", "instance.file"),
        (["instance", "file"], "", "instance.file"),
        (["instance", "file"], ".hidden", "instance.file"),
        (["instance", "sha256"], "0", "instance.sha256"),
        (["formulation"], "../x", "formulation"),
        (["options", "stroke_norm"], 3, "stroke_norm"),
        (["jumps"], [[0]], "jumps"),
        (["jumps"], [[-1, 1]], "jumps"),
        (["jumps"], [[10**30, 1]], "jumps"),
        (["jumps"], [[0, 1e9]], "jumps"),
        (["jumps"], "none", "jumps"),
        (["files"], [{"name": "/etc/passwd", "format": "nl", "sha256": "0" * 64, "bytes": 1}], "files"),
        (["class"], "SDP", "class"),
    ],
)
def test_documents_that_break_the_schema_are_refused(keys, value, message, written):
    with pytest.raises(InstanceError, match=rf"manifest\.json: .*{message}"):
        read_manifest(changed(written, *keys, value=value))


@pytest.mark.parametrize(
    "keys, value, error, message",
    [
        (["formulation"], "mlip", FormulationError, "no formulation 'mlip'"),
        (["formulation"], "milp-mccormick", FormulationError, "leave p out"),
        (["options", "relax"], True, FormulationError, "qp-fixed has no option relax"),
        (["jumps"], None, FormulationError, "takes the jumps of all pairs"),
        (["jumps"], [[8, 1]], InstanceError, "lists a jump of a pair that the instance does not have"),
        (["jumps"], [], InstanceError, "does not fit its own instance"),
        (["jumps"], [[0, 64]], InstanceError, "does not fit its own instance"),
        (["sha256"], "0" * 64, InstanceError, "does not fit its own instance"),
    ],
)
def test_documents_that_contradict_themselves_are_refused(keys, value, error, message, written):
    renamed = written.rename(written.with_name("renamed.json"))
    manifest = read_manifest(changed(renamed, *keys, value=value))
    with pytest.raises(error, match=rf"renamed\.json: .*{message}"):
        manifest.problem()


def test_problems_that_no_manifest_records_are_refused(tmp_path):
    problem = make_problem("minlp-cubic", make_instance())
    for other in (problem.lifted, with_integers_fixed(problem, make_field(problem.instance))):
        with pytest.raises(InputError, match="a manifest cannot record minlp-cubic"):
            write_problem(other, tmp_path / "set")
    assert list(tmp_path.iterdir()) == []
    write(problem.lifted, tmp_path / "single.lp")
    fixed = with_integers_fixed(problem, make_field(problem.instance))
    with pytest.raises(UnsupportedByFormatError, match="write nl, lp or mps"):
        write(fixed, tmp_path / "fixed.mod")
    assert list(contents(tmp_path)) == ["single.lp"]
    write(fixed, tmp_path / "fixed.gms")


@pytest.mark.parametrize("name", FORMATS)
def test_a_start_is_in_the_file_or_refused(tmp_path, name):
    """It is never dropped; the message names the formats that hold one."""
    problem, path = make_problem("milp-mccormick", make_instance()), tmp_path / f"model.{name}"
    field = make_field(problem.instance)
    if FORMATS[name].has_start:
        write(problem, tmp_path / f"without.{name}")
        write(problem, path, start=field)
        assert path.stat().st_size > (tmp_path / f"without.{name}").stat().st_size
        return
    with pytest.raises(
        UnsupportedByFormatError, match=rf"model\.{name}: .* \(nl, gms, qplib, bar\).*write_problem"
    ):
        write(problem, path, start=field)
    assert list(tmp_path.iterdir()) == []
    manifest = write_problem(problem, tmp_path, formats=[name], start=field)
    assert manifest.document["refused"] == {}
    assert list(tmp_path.glob("*.gurobi.start.mst"))


def test_formats_that_hold_nothing_of_what_was_asked_are_refused_before_a_file(tmp_path):
    instance = make_instance()
    for formats in (["mps"], ["lp", "qplib"]):
        with pytest.raises(UnsupportedByFormatError, match="minlp-parity; write minlp-quartic"):
            write_all(instance, tmp_path, formulations=["minlp-parity"], formats=formats)
        with pytest.raises(UnsupportedByFormatError, match="minlp-parity; write minlp-quartic"):
            write_problem(make_problem("minlp-parity", instance), tmp_path, formats=formats)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["A.LP", "A.Nl.GZ", "A.MOD.Gz"])
def test_suffixes_in_upper_case_are_those_in_lower_case(tmp_path, name):
    """Same bytes, and companions with the same stem."""
    problem = make_problem("milp-mccormick", make_instance("hole"))
    upper = write(problem, tmp_path / name).files
    lower = write(problem, tmp_path / f"a{name[1:].lower()}").files
    assert name in upper
    assert [file.lower() for file in upper] == [file.lower() for file in lower]
    assert list(upper.values()) == list(lower.values())
