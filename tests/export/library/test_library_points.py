"""Points and certificates of a library: found, or given by its specification; entries that they tighten."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace

import crossfield as cf
import pytest
from children import complaints
from command_line import invoke
from crossfield.export.library.building import fields
from forging import change
from libraries import content, defects, document, improve, library_of, problem, write_spec

SPEC = """formulations = ["milp", "exact", "qp"]
[rungs.tiny]
sizes = [3]
formats = ["mps"]
gauges = ["strokes", "box"]
tightened = ["exact", "milp"]
[[sketches]]
name = "rand"
random = "full"
seeds = "7-8"
share = 0.3
points = "proven"
"""
GIVEN = 'points = "known"\n' + SPEC
ONE = GIVEN.replace("7-8", "7-7").replace(', "box"', "")
STEM, OTHER = "cf_rand_n003_s7", "cf_rand_n003_s8"
CERTIFICATES = {"exact": f"{STEM}.certificate.npz", "milp": f"{STEM}.l1.certificate.npz"}
GAP = "states another norm, status, bound or energy"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library with proofs; not to be changed."""
    return library_of(tmp_path_factory.mktemp("proven"), SPEC).folder


@pytest.fixture
def lib(built, tmp_path):
    """A copy that a test may change, as the library of a specification and as points of another one."""
    shutil.copytree(built, tmp_path / "known")
    return shutil.copytree(built, tmp_path / "lib")


def instance_of(lib, stem=STEM):
    return cf.read_instance(lib / f"{stem}.instance.json")


def make_poor(lib):
    """State the greedy field as the best one known, without a certificate; return its 2-norm energy."""
    about = document(lib, f"{STEM}.about")
    poor, best = about["fields"]["baseline"], about["fields"]["least_2"]
    assert poor["energy_2norm"] > best["energy_2norm"] + 1e-6
    about["fields"] = dict.fromkeys(about["fields"], poor)
    del about["certificates"]
    (lib / f"{STEM}.about.json").write_text(json.dumps(about))
    return poor["energy_2norm"]


# Certificates


def test_a_certificate_proves_the_entries_of_its_norm_under_the_gauge_strokes(built):
    for token, norm in (("exact", 2), ("milp", 1)):
        entry = document(built, f"{STEM}_{token}")
        assert (entry["status"], entry["solved"]["by"]) == ("optimal", "certificate")
        certificate = cf.read_certificate(built / CERTIFICATES[token], on=instance_of(built))
        assert (certificate.norm, certificate.status) == (norm, "optimal")
        assert certificate.bound == pytest.approx(entry["best"]["objective"], rel=1e-6)
        assert f"=opt= {STEM}_{token} " in (built / "library.solu").read_text()
        assert document(built, f"{STEM}_box_{token}")["status"] == "best known"
    (bound,) = document(built, f"{STEM}_milp")["bounds"]
    assert bound["certificate"] == CERTIFICATES["milp"]
    assert not [one for one in document(built, f"{STEM}_qp")["bounds"] if "certificate" in one]
    command = [sys.executable, built / "check_certificate.py", built / CERTIFICATES["exact"]]
    assert subprocess.run(command, check=False, capture_output=True).returncode == 0


def forge_bytes(lib):
    path = lib / CERTIFICATES["exact"]
    data, half = path.read_bytes(), path.stat().st_size // 2
    path.write_bytes(data[:half] + bytes([data[half] ^ 1]) + data[half + 1 :])


def forge_proof(lib):
    """A certificate of a worse field."""
    proof = cf.prove(instance_of(lib), jobs=1)
    worse = replace(proof.field, beta=0.9 * proof.field.beta)
    weak = replace(proof.with_levels(1, "gap"), field=worse, energy=worse.energy().total)
    assert cf.write_certificate(weak, lib / CERTIFICATES["exact"], force=True).status == "gap"


def in_about(**changes):
    return lambda lib: change(lib / f"{STEM}.about.json", **changes)


DAMAGED = {
    "bytes of a certificate": (forge_bytes, CERTIFICATES["exact"]),
    "a worse field": (forge_proof, GAP),
    "of another instance": (
        lambda lib: shutil.copy(lib / f"{OTHER}.certificate.npz", lib / CERTIFICATES["exact"]),
        "is a certificate of another instance",
    ),
    "a higher bound": (in_about(certificates__2__bound=99.0), GAP),
    "another status": (in_about(certificates__2__status="gap"), GAP),
    "another energy": (in_about(certificates__2__energy=99.0), GAP),
    "an absent certificate": (in_about(certificates__2__file=f"{STEM}.b.npz"), "cannot be read"),
    "half a surrogate": (in_about(title="half \ud800"), "half of a surrogate pair"),
    "an infinite number": (in_about(fields__least_2__seconds=float("inf")), "a number that is not finite"),
    "another version": (in_about(version=True), "has version True"),
    "no field": (lambda lib: (lib / f"{STEM}.field.json").unlink(), f"{STEM}.field.json: cannot be read"),
    "a damaged field": (lambda lib: (lib / f"{STEM}.field.json").write_text("{}"), f"{STEM}.field.json"),
}
"""Changes of given points, and words of the error."""


@pytest.mark.parametrize("fault", DAMAGED)
def test_damaged_or_forged_points_are_refused(fault, lib, tmp_path, capsys):
    damage, words = DAMAGED[fault]
    damage(tmp_path / "known")
    spec = write_spec(tmp_path, ONE)
    assert invoke(["library", "build", str(spec), "-o", str(tmp_path / "out")]) == 1
    (line,) = complaints(capsys.readouterr().err).splitlines()
    assert words in line
    assert STEM in line


def test_a_large_certificate_of_an_optimum_is_kept(tmp_path, monkeypatch):
    """It was left out with its field, although it proved the optimum."""
    monkeypatch.setattr(fields, "_MOST_BYTES", 1)  # which any certificate exceeds
    lib = library_of(tmp_path, SPEC.replace("7-8", "7-7"))
    assert lib.entry(f"{STEM}_exact")["status"] == "optimal"
    assert (lib.folder / CERTIFICATES["exact"]).exists()


def test_less_work_gives_the_same_instances_and_points_of_no_lower_energy(built, tmp_path):
    less = library_of(tmp_path, SPEC.replace('"proven"', '"greedy"'))
    names = [f"{STEM}_exact", f"{OTHER}_exact"]
    for greedy, proven in zip(map(less.entry, names), [document(built, name) for name in names], strict=True):
        assert (greedy["status"], greedy["best"]["solver"]) == ("best known", "crossfield (greedy)")
        assert greedy["instance"]["sha256"] == proven["instance"]["sha256"]
        assert proven["best"]["objective"] <= greedy["best"]["objective"] + 1e-12


# Tightened entries: the plain entry in the windows that a certificate leaves


def test_a_tightened_entry_has_the_optimum_of_its_plain_one_and_names_its_certificate(built):
    for token, file in CERTIFICATES.items():
        narrow, plain = document(built, f"{STEM}_{token}_tight"), document(built, f"{STEM}_{token}")
        for key in ("status", "bound", "gap", "instance"):
            assert narrow[key] == plain[key]
        assert narrow["best"]["objective"] == plain["best"]["objective"]
        assert (narrow["tightened"]["certificate"], narrow["tightened"]["plain"]) == (file, plain["name"])
        assert plain["name"] in [relation["entry"] for relation in narrow["equivalent"]]
        assert "tightened" not in plain
        windows = [problem(built, entry["name"]).blocks["alpha"] for entry in (narrow, plain)]
        width = [(block.upper - block.lower).sum() for block in windows]
        assert width[0] < width[1]
    assert not list(built.glob("*_box_*tight*"))


@pytest.mark.parametrize("token", CERTIFICATES)
def test_a_tightened_entry_has_the_bytes_of_an_export_with_the_certificate(built, tmp_path, token):
    instance, certificate = built / f"{STEM}.instance.json", built / CERTIFICATES[token]
    command = ["export", str(instance), "-o", str(tmp_path), "--tightened", str(certificate)]
    assert invoke([*command, "-f", token, "-F", "mps"]) == 0
    (written,) = tmp_path.glob("*.mps")
    assert written.read_bytes() == (built / f"{STEM}_{token}_tight.mps").read_bytes()


@pytest.mark.parametrize(
    "token, solver",
    [("milp", "highs"), pytest.param("exact", "scip", marks=[pytest.mark.needs("scip"), pytest.mark.slow])],
)
def test_a_solver_finds_the_proven_optimum_of_a_tightened_entry(built, token, solver):
    name = f"{STEM}_{token}_tight"
    solution = cf.solve(problem(built, name), solver)
    assert solution.objective == pytest.approx(document(built, name)["best"]["objective"], abs=1e-6)


def test_a_tightened_entry_awaits_its_certificate(tmp_path, capfd):
    """It is counted and listed with the reason, is no fault, and is made once its proof is sent."""
    spec = write_spec(tmp_path, SPEC.replace('"proven"', '"greedy"').replace("7-8", "7-7"))
    command = ["library", "build", str(spec), "-o", str(tmp_path / "lib")]
    assert invoke(command) == 0
    shown, lib = capfd.readouterr(), tmp_path / "lib"
    assert shown.out.endswith(" entries; 2 tightened entries await a certificate\n")
    assert complaints(shown.err) == ""
    skipped = document(lib, "library")["skipped"]
    assert skipped[f"{STEM}_exact_tight"] == (
        f"{STEM} has no certificate in the 2-norm; give one of `crossfield prove` with --points"
    )
    assert f"{STEM}_milp_tight: {STEM} has no certificate in the 1-norm" in (lib / "README.md").read_text()
    assert not list(lib.glob("*_tight*"))
    (tmp_path / "sent").mkdir()
    cf.write_certificate(cf.prove(instance_of(lib), jobs=1), tmp_path / "sent" / "it.npz")
    assert invoke([*command, "--points", str(tmp_path / "sent")]) == 0
    assert "; 1 tightened entries await a certificate; 1 of 1 points" in capfd.readouterr().out
    assert document(lib, f"{STEM}_exact_tight")["status"] == "optimal"
    assert defects(lib) == {}


def test_a_field_outside_the_windows_is_not_better_and_not_refused(lib, tmp_path):
    (tmp_path / "sent").mkdir()
    cf.write_field(cf.power_field(instance_of(lib)), tmp_path / "sent" / "worse.npz")
    assert improve(lib, tmp_path / "sent") == ({"worse.npz": []}, {})


# Given points


@pytest.mark.slow
def test_given_points_are_stated_and_the_models_are_those_of_a_search(built, lib, tmp_path):
    given = library_of(tmp_path, GIVEN, "given").folder
    assert defects(given) == {}
    before, after = content(built), content(given)
    assert before.keys() == after.keys()
    stated = {name for name in before if before[name] != after[name]}
    assert all(name.endswith(".json") or name == "SHA256SUMS" for name in stated)
    about, old = (document(one, f"{STEM}.about") for one in (given, built))
    assert all(about[key] == old[key] for key in ("fields", "certificates"))
    assert ("given" in about, "given" in old) == (True, False)


@pytest.mark.slow
def test_a_build_with_poor_points_searches_for_nothing_and_keeps_a_better_point(built, lib, tmp_path):
    """Another build, from the same points and the ledger, gives the same library."""
    poor = make_poor(tmp_path / "known")
    poorly = library_of(tmp_path, GIVEN, "poorly").folder
    about = document(poorly, f"{STEM}.about")
    assert {field["energy_2norm"] for field in about["fields"].values()} == {poor}
    assert document(poorly, f"{STEM}_exact")["bounds"] == []
    (tmp_path / "sent").mkdir()
    shutil.copy(built / f"{STEM}_exact.sol", tmp_path / "sent")
    improved, _ = improve(poorly, tmp_path / "sent")
    assert f"{STEM}_exact" in improved[f"{STEM}_exact.sol"]
    assert defects(poorly) == {}
    again = library_of(tmp_path, 'ledger = "poorly/ledger.json"\n' + GIVEN, "again").folder
    assert content(again) == content(poorly)


@pytest.mark.slow
def test_points_of_another_instance_are_reported_and_do_not_count(lib, tmp_path, capsys):
    known = tmp_path / "known"
    for path in known.glob(f"{STEM}*"):
        path.unlink()
    for path in [*known.glob(f"{OTHER}.*"), *known.glob(f"{OTHER}_box.*")]:
        data = path.read_bytes()
        data = data.replace(OTHER.encode(), STEM.encode()) if path.suffix == ".json" else data
        path.with_name(path.name.replace(OTHER, STEM)).write_bytes(data)
        path.unlink()
    spec = write_spec(tmp_path, GIVEN.replace("7-8", "7-7"))
    assert invoke(["library", "build", str(spec), "-o", str(tmp_path / "out")]) == 0
    assert complaints(capsys.readouterr().err).splitlines() == [
        f"crossfield: {name}: the points given are of another instance; searched for others"
        for name in (f"{STEM}_box", STEM)
    ]
    assert defects(tmp_path / "out") == {}
