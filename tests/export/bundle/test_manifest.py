"""Sets of files and their manifests: round trip, determinism, and what is refused."""

import crossfield as cf
import numpy as np
import pytest
from cases import SKEWED, make_field, make_instance, make_problem
from crossfield.export.formats.registry import FORMATS
from crossfield.export.writing.canonical import CanonicalForm
from folders import contents
from forging import change
from loops import for_each

OPTIONS = [
    ("milp-mccormick", {"facet": "printed", "stroke_norm": 2, "relax": True}),
    ("miqcp-bilinear", {"beta_norm": 1}),
    *((name, {}) for name in SKEWED),
]


@for_each("name, options", OPTIONS)
def test_a_manifest_gives_its_problem_back(name, options, tmp_path):
    problem = make_problem(name, make_instance(gauge="box" if options else "strokes"), **options)
    manifest = cf.write(problem, tmp_path, formats=["nl", "gms", "lp", "mps"])
    assert manifest.path == tmp_path / f"tiny.{name}.manifest.json"
    again = cf.read_manifest(manifest.path)
    assert again.document == manifest.document
    assert (again.formulation, again.folder) == (name, tmp_path)
    rebuilt = again.problem()
    assert rebuilt.sha256 == problem.sha256
    assert rebuilt.instance.sha256 == problem.instance.sha256
    np.testing.assert_array_equal(rebuilt.lower, problem.lower)
    if name == "qp-fixed":
        np.testing.assert_array_equal(rebuilt.jumps, problem.jumps)


def test_refused_and_lifted_formats_and_the_jumps_of_the_start_are_listed(tmp_path):
    instance = make_instance()
    field, names = make_field(instance), ["minlp-parity", "minlp-quartic", "qp-fixed"]
    parity, quartic, fixed = cf.write_all(instance, tmp_path, formulations=names, start=field)
    assert set(parity.document["refused"]) == {"lp", "mps"}
    assert all("minlp-quartic" in reason for reason in parity.document["refused"].values())
    assert {entry["format"] for entry in parity.document["files"]} == {"nl", "gms"}
    assert not (tmp_path / "tiny.minlp-parity.lp").exists()
    by_format = {entry["format"]: entry["lifted"] for entry in quartic.document["files"]}
    assert by_format["nl"] == by_format["gms"] == ""
    assert by_format["lp"] == by_format["mps"] == "z = p1 beta_i with the hull facets (26)-(29), exact"
    assert fixed.problem().jumps.tolist() == field.p.tolist()
    assert dict(fixed.document["jumps"]) == {pair: jump for pair, jump in enumerate(field.p) if jump}
    cf.write_all(make_instance(seed=8), tmp_path, formulations=["milp-mccormick"], formats=["lp"])
    assert cf.read_instance(tmp_path / "tiny.instance.json").sha256 == make_instance(seed=8).sha256


def test_options_apply_where_a_formulation_has_them(tmp_path):
    instance, messages = make_instance(), []
    manifests = cf.write_all(
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
    with pytest.raises(cf.FormulationError, match="there is no option 'nonsense'; choose one of facet"):
        cf.write_all(instance, tmp_path, options={"nonsense": 1}, start=make_field(instance))


# what is refused


@pytest.fixture
def written(tmp_path):
    """A manifest of qp-fixed with its instance beside it."""
    return cf.write(make_problem("qp-fixed", make_instance()), tmp_path, formats=["nl"]).path


def test_another_instance_beside_a_manifest_is_refused(written):
    cf.write_instance(make_instance(seed=9), written.parent / "tiny.instance.json")
    with pytest.raises(cf.InstanceError, match=r"tiny\.instance\.json: is another instance"):
        cf.read_manifest(written).problem()
    (written.parent / "tiny.instance.json").unlink()
    with pytest.raises(cf.InputError, match=r"tiny\.instance\.json: cannot be read"):
        cf.read_manifest(written).problem()


def test_damaged_manifests_are_refused(written):
    whole = written.read_bytes()
    other = [b"[]", b"null", b'"crossfield-manifest"', b"\xff\xfe", b"[" * 100000]
    other += [b'{"format": "crossfield-instance", "version": 1}']
    for text in (*other, *(whole[:end] for end in range(0, len(whole) - 2, 37))):
        written.write_bytes(text)
        with pytest.raises(cf.InstanceError, match=r"tiny\.qp-fixed\.manifest\.json: ") as error:
            cf.read_manifest(written)
        assert "\n" not in str(error.value)


@for_each(
    "key, value, message",
    [
        # What breaks the schema
        ("version", 2, "has version 2, but this program reads version 1"),
        ("version", True, "version"),
        ("unknown", 1, "unknown"),
        ("options__colour", 1, "colour"),
        ("instance__file", "../tiny.instance.json", "instance.file"),
        ("instance__file", "a/b.json", "instance.file"),
        ("instance__file", "a\\b.json", "instance.file"),
        ("instance__file", "", "instance.file"),
        ("instance__file", ".hidden", "instance.file"),
        ("instance__sha256", "0", "instance.sha256"),
        ("formulation", "../x", "formulation"),
        ("options__stroke_norm", 3, "stroke_norm"),
        ("jumps", [[0]], "jumps"),
        ("jumps", [[-1, 1]], "jumps"),
        ("jumps", [[10**30, 1]], "jumps"),
        ("jumps", [[0, 1e9]], "jumps"),
        ("jumps", "none", "jumps"),
        ("files", [{"name": "/etc/passwd", "format": "nl", "sha256": "0" * 64, "bytes": 1}], "files"),
        ("class", "SDP", "class"),
        # What contradicts itself
        ("formulation", "mlip", "no formulation 'mlip'"),
        ("formulation", "milp-mccormick", "leave p out"),
        ("options__relax", True, "qp-fixed has no option relax"),
        ("jumps", None, "takes the jumps of all pairs"),
        ("jumps", [[8, 1]], "lists a jump of a pair that the instance does not have"),
        ("jumps", [], "does not fit its own instance"),
        ("jumps", [[0, 64]], "does not fit its own instance"),
        ("sha256", "0" * 64, "does not fit its own instance"),
        ("columns", lambda names: names[::-1], "columns in another order"),
    ],
)
def test_documents_that_break_the_schema_or_contradict_themselves_are_refused(key, value, message, tmp_path):
    problem = make_problem("qp-fixed", make_instance())
    path = cf.write(problem, tmp_path, formats=["nl"]).path.rename(tmp_path / "renamed.json")
    change(path, **{key: value})
    with pytest.raises((cf.InstanceError, cf.FormulationError), match=rf"renamed\.json: .*{message}"):
        cf.read_manifest(path).problem()


def test_problems_that_no_manifest_records_are_refused(tmp_path):
    problem = make_problem("minlp-cubic", make_instance())
    for other in (problem.lifted, problem.with_integers_fixed(make_field(problem.instance))):
        with pytest.raises(cf.InputError, match="a manifest cannot record minlp-cubic"):
            cf.write(other, tmp_path / "set", formats=["nl", "gms", "lp", "mps"])
    assert list(tmp_path.iterdir()) == []
    cf.write(problem.lifted, tmp_path / "single.lp")
    fixed = problem.with_integers_fixed(make_field(problem.instance))
    with pytest.raises(cf.UnsupportedByFormatError, match="write nl, lp or mps"):
        cf.write(fixed, tmp_path / "fixed.mod")
    assert list(contents(tmp_path)) == ["single.lp"]
    cf.write(fixed, tmp_path / "fixed.gms")


@pytest.mark.parametrize("name", FORMATS)
def test_a_start_is_in_the_file_or_refused(tmp_path, name):
    """It is never dropped; the message names the formats that hold one."""
    problem, path = make_problem("milp-mccormick", make_instance()), tmp_path / f"model.{name}"
    field = make_field(problem.instance)
    if FORMATS[name].has_start:
        cf.write(problem, tmp_path / f"without.{name}")
        cf.write(problem, path, start=field)
        assert path.stat().st_size > (tmp_path / f"without.{name}").stat().st_size
        return
    with pytest.raises(
        cf.UnsupportedByFormatError, match=rf"model\.{name}: .* \(nl, gms, qplib, bar\).*formats="
    ):
        cf.write(problem, path, start=field)
    assert list(tmp_path.iterdir()) == []
    manifest = cf.write(problem, tmp_path, formats=[name], start=field)
    assert manifest.document["refused"] == {}
    assert list(tmp_path.glob("*.gurobi.start.mst"))


@pytest.mark.parametrize("name", ["A.LP", "A.Nl.GZ", "A.MOD.Gz"])
def test_suffixes_in_upper_case_are_those_in_lower_case(tmp_path, name):
    """Same bytes, and companions with the same stem."""
    problem = make_problem("milp-mccormick", make_instance("hole"))
    upper = cf.write(problem, tmp_path / name).files
    lower = cf.write(problem, tmp_path / f"a{name[1:].lower()}").files
    assert name in upper
    assert [file.lower() for file in upper] == [file.lower() for file in lower]
    assert list(upper.values()) == list(lower.values())


# Answers without names: lifting and the order of columns come from the manifest


def raw_of_glpk(path, form, file, point):
    """A file as from `glpsol -w` for an LP or MPS file: values in the order of its columns, no names."""
    values = np.append(point, 1.0)[form.order(file)]
    rows = [f"i {place + 1} 0" for place in range(form.row_count(file))]
    columns = [f"j {place + 1} {value!r}" for place, value in enumerate(values.tolist())]
    name = f"{form.problem.instance.name}_{form.problem.stamp}" if file == "mps" else ""
    head = [f"c Problem:    {name}", f"c Objective:  obj_{form.problem.stamp} = 0 (MINimum)"]
    sizes = f"s mip {len(rows)} {len(columns)} f 0"
    path.write_text("\n".join([*head, sizes, *rows, *columns, "e o f", ""]))
    return path


def test_values_without_names_follow_the_file_that_the_manifest_lists(tmp_path):
    problem = make_problem("minlp-cubic", make_instance())
    manifest = cf.read_manifest(cf.write(problem, tmp_path, formats=["nl", "gms", "lp", "mps"]).path)
    held = manifest.problems_by_format(problem)
    assert {name: form.sha256 == problem.sha256 for name, form in held.items()} == {
        "nl": True, "gms": True, "lp": False, "mps": False,
    }  # fmt: skip
    point = problem.lifted.point(make_field(problem.instance))
    for file in ("lp", "mps"):
        path = raw_of_glpk(tmp_path / "x.sol", CanonicalForm(problem.lifted), file, point)
        for solution in (cf.read_solution(path, problem, held=held), cf.read_solution(path, problem)):
            np.testing.assert_array_equal(solution.point, point)
        with pytest.raises(cf.SolutionError, match="the problem has"):
            cf.read_solution(path, problem, held={file: problem})


def test_values_without_names_of_a_file_that_cannot_hold_the_problem_are_refused(tmp_path):
    problem = make_problem("milp-mccormick", make_instance())
    path = raw_of_glpk(
        tmp_path / "x.sol", CanonicalForm(problem), "lp", problem.point(make_field(problem.instance))
    )
    parity = make_problem("minlp-parity", problem.instance)
    path.write_text(path.read_text().replace(problem.stamp, parity.stamp))
    with pytest.raises(cf.SolutionError, match="lp holds nothing beyond quadratic"):
        cf.read_solution(path, parity)
