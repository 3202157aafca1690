"""Tightened entries: the plain entry in the windows that a certificate leaves, with the same optimum."""

import json
import shutil

import crossfield as cf
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.table import read_table
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents.documents import problem_of
from crossfield.models.errors import InputError
from libraries import improve, library_of, spec_of

SPEC = """formulations = ["milp", "exact", "qp"]

[rungs.tiny]
sizes = [3]
formats = ["mps"]
gauges = ["strokes", "box"]
tightened = ["exact", "milp-mccormick"]

[[sketches]]
name = "rand"
random = "full"
seeds = [1]
points = "proven"
"""
STEM = "cf_rand_n003_s1"
CERTIFICATES = {"exact": f"{STEM}.certificate.npz", "milp": f"{STEM}.l1.certificate.npz"}


REMEDY = "give one of `crossfield prove` with --points"
ORDER = (("", ("milp", "exact")), ("_tight", ("exact", "milp")))


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library with tightened entries; not to be changed."""
    return library_of(tmp_path_factory.mktemp("tightened"), SPEC)


@pytest.fixture
def lib(built, tmp_path):
    return shutil.copytree(built.folder, tmp_path / "lib")


def test_it_has_the_optimum_of_its_plain_entry_and_names_its_certificate(built):
    names = [f"{STEM}_{token}{end}" for end, tokens in ORDER for token in tokens]
    assert [name for name in built.document["entries"] if "qp" not in name and "box" not in name] == names
    for token, file in CERTIFICATES.items():
        narrow, plain = built.entry(f"{STEM}_{token}_tight"), built.entry(f"{STEM}_{token}")
        for key in ("status", "bound", "gap", "instance"):
            assert narrow[key] == plain[key]
        assert narrow["best"]["objective"] == plain["best"]["objective"]
        assert (narrow["status"], narrow["solved"]["by"]) == ("optimal", "certificate")
        stated = narrow["tightened"]
        assert (stated["certificate"], stated["plain"]) == (file, plain["name"])
        assert plain["name"] in [relation["entry"] for relation in narrow["equivalent"]]
        assert "tightened" not in plain
        windows = [problem_of(built, entry).blocks["alpha"] for entry in (narrow, plain)]
        width = [(block.upper - block.lower).sum() for block in windows]
        assert width[0] < width[1]
    rows = read_table(built.folder / "entries.csv")
    assert {row["name"] for row in rows if row["tightened"]} == {name for name in names if "tight" in name}
    assert verify_library(built.folder) == []


@pytest.mark.parametrize("token, name", [("milp", "milp-mccormick"), ("exact", "miqp-exact")])
def test_it_has_the_bytes_of_an_export_with_the_certificate(built, tmp_path, token, name):
    instance, certificate = built.folder / f"{STEM}.instance.json", built.folder / CERTIFICATES[token]
    command = ["export", str(instance), "-o", str(tmp_path), "--tightened", str(certificate), "-q"]
    assert invoke([*command, "-f", name, "-F", "mps"]) == 0
    (written,) = tmp_path.glob("*.mps")
    assert written.read_bytes() == (built.folder / f"{STEM}_{token}_tight.mps").read_bytes()


@pytest.mark.parametrize(
    "token, solver",
    [
        ("milp", "highs"),
        pytest.param("exact", "scip", marks=pytest.mark.needs("scip")),
    ],
)
def test_a_solver_finds_the_proven_optimum(built, token, solver):
    sidecar = built.entry(f"{STEM}_{token}_tight")
    solution = cf.solve(problem_of(built, sidecar), solver)
    assert solution.objective == pytest.approx(sidecar["best"]["objective"], abs=1e-6)


def test_an_entry_without_a_certificate_is_skipped_with_its_reason(tmp_path):
    library = library_of(tmp_path, SPEC.replace("proven", "greedy"))
    assert library.skipped == {
        f"{STEM}_{token}_tight": f"{STEM} has no certificate in the {norm}-norm; {REMEDY}"
        for token, norm in (("exact", 2), ("milp", 1))
    }
    assert not any("tight" in name for name in library.document["entries"])
    assert f"{STEM}_exact_tight: {STEM} has no certificate" in (library.folder / "README.md").read_text()
    assert verify_library(library.folder) == []
    proof = cf.prove(cf.read_instance(library.folder / f"{STEM}.instance.json"), jobs=1)
    (tmp_path / "sent").mkdir()
    cf.write_certificate(proof, tmp_path / "sent" / "it.npz")
    assert improve(library.folder, tmp_path / "sent") == ({"it.npz": [f"{STEM}_exact"]}, {})
    assert f"{STEM}_exact_tight" in json.loads((library.folder / "library.json").read_text())["entries"]
    assert verify_library(library.folder) == []


def test_a_build_counts_the_entries_that_await_a_certificate_and_warns_of_none(tmp_path, capfd):
    spec_of(tmp_path, SPEC.replace("proven", "greedy"))
    assert invoke(["library", "build", str(tmp_path / "spec.toml"), "-o", str(tmp_path / "lib")]) == 0
    shown = capfd.readouterr()
    assert shown.out.endswith(" entries; 2 tightened entries await a certificate\n")
    assert complaints(shown.err) == ""


def test_a_field_outside_the_windows_is_not_better_and_not_refused(lib, tmp_path):
    (tmp_path / "sent").mkdir()
    field = cf.power_field(cf.read_instance(lib / f"{STEM}.instance.json"))
    cf.write_field(field, tmp_path / "sent" / "worse.npz")
    assert improve(lib, tmp_path / "sent") == ({"worse.npz": []}, {})


@pytest.mark.parametrize(
    "stated, words",
    [
        ('["parity"]', "rungs.tiny.tightened: 'minlp-parity' is not in formulations"),
        ('["qp"]', "rungs.tiny.tightened: qp-fixed has fixed jumps"),
        ('["exact", "miqp-exact"]', "rungs.tiny.tightened: 'miqp-exact' is listed twice"),
        ('["exakt"]', "rungs.tiny.tightened: there is no formulation 'exakt'"),
    ],
)
def test_a_bad_list_is_refused(tmp_path, stated, words):
    with pytest.raises(InputError, match=r"spec\.toml") as error:
        spec_of(tmp_path, SPEC.replace('["exact", "milp-mccormick"]', stated))
    assert words in str(error.value)
