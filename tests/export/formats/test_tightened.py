"""Problems with windows narrowed by a certificate: the same optimum, in every format, and marked."""

import json
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from cases import SKEWED
from crossfield.export.bundle.manifest import read_manifest
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.solvers_table import PROGRAMS
from crossfield.export.verify.checks import Verdict
from crossfield.export.verify.verify import verify
from crossfield.models.errors import InputError, InstanceError
from crossfield.models.field.file import write_field
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.problem import formulate, with_windows
from crossfield.models.formulations.windows import Windows
from crossfield.models.instance.file import write_instance
from crossfield.models.proof.certificate import read_certificate, write_certificate
from crossfield.models.proof.tightening import remaining_windows
from exhaustive import exact, optimum, random_instance
from proofs_round_fields import prove_round

TWO_NORM = ("minlp-parity", "minlp-quartic", "minlp-cubic", "miqp-exact", "qp-fixed")
SAID = "narrowed to what a proof leaves"


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    """A certificate of the optimum of 2 x 3 pixels, and the file it is in."""
    instance = random_instance(103, (2, 3), 9)
    field = optimum(instance)
    assert field.energy().total == pytest.approx(exact(instance), abs=1e-12)
    path = tmp_path_factory.mktemp("proof") / "it.npz"
    return write_certificate(prove_round(field, levels=4), path), path


def problems(proof, name):
    """A formulation with the windows of the gauge, and with the narrowed ones."""
    recipe, field = FORMULATIONS[name], proof.field
    plain = formulate(field.instance, name, p=field.p if recipe.fixed else None)
    return plain, with_windows(plain, remaining_windows(proof))


def test_windows_are_narrower_and_hold_the_optimum(proof):
    certificate, _ = proof
    assert certificate.status == "optimal"
    for name in SKEWED:
        plain, narrow = problems(certificate, name)
        assert (narrow.lower >= plain.lower - 1e-9).all()
        assert (narrow.upper <= plain.upper + 1e-9).all()
        for block in ("alpha", "beta"):
            width = narrow.blocks[block].upper - narrow.blocks[block].lower
            assert (width < 0.2).all()
        assert narrow.violation(narrow.point(certificate.field)).worst < 1e-12
        assert narrow.sha256 != plain.sha256
        assert not replace(narrow, pinned=certificate.field).is_recordable
        assert narrow.is_recordable
        assert ("the optimum stays" in narrow.tightened) == (name in TWO_NORM)
        assert plain.tightened == ""


def test_a_tightened_relaxation_may_rise_and_says_so(proof):
    """Narrower windows cut off points of the relaxation, whose optimum is 0 here, and no optimal field."""
    certificate, _ = proof
    windows = remaining_windows(certificate)
    relaxed = formulate(certificate.field.instance, "miqp-exact", relax=True)
    narrow = with_windows(relaxed, windows)
    assert cf.solve(relaxed, "ipopt").objective < cf.solve(narrow, "ipopt").objective - 1e-4
    assert narrow.tightened.endswith("the relaxation may rise")
    for name in SKEWED:
        if not FORMULATIONS[name].fixed:
            problem = formulate(certificate.field.instance, name, relax=True)
            assert "stays" not in with_windows(problem, windows).tightened


def test_the_optimum_is_that_of_the_whole_problem(proof):
    """Bonmin, exact on a convex problem, against the least squares of all jumps."""
    certificate, _ = proof
    least = exact(certificate.field.instance)
    for problem in problems(certificate, "miqp-exact"):
        assert cf.solve(problem, "bonmin").objective == pytest.approx(least, abs=1e-6)
    _, narrow = problems(certificate, "qp-fixed")
    assert cf.solve(narrow, "ipopt").objective == pytest.approx(least, abs=1e-6)


@pytest.mark.parametrize(
    "norm, formulations",
    [(1, ("milp-mccormick", "miqcp-bilinear-l1")), ("mixed", ("miqp-mccormick", "miqcp-bilinear"))],
)
def test_windows_of_another_norm_keep_the_optimum_of_its_formulations(norm, formulations, tmp_path):
    result = cf.prove(random_instance(103, (2, 3), 9), norm=norm, jobs=1)
    windows = remaining_windows(write_certificate(result, tmp_path / "it.npz"))
    for name in SKEWED:
        problem = formulate(
            result.field.instance, name, p=result.field.p if FORMULATIONS[name].fixed else None
        )
        narrow = with_windows(problem, windows)
        assert ("the optimum stays" in narrow.tightened) == (name in formulations)
        assert narrow.violation(narrow.point(result.field)).worst < 1e-9
        assert Windows.of_document(narrow.windows.document()).norm == norm
    other = formulate(result.field.instance, "milp-mccormick", stroke_norm=2)
    assert "may rise" in with_windows(other, windows).tightened
    if norm == 1:
        plain = formulate(result.field.instance, "milp-mccormick")
        for problem in (plain, with_windows(plain, windows)):
            assert cf.solve(problem, "highs").objective == pytest.approx(result.energy, abs=1e-6)


@pytest.mark.parametrize("gauge, least", [("strokes", 4), ("box", 1)])
def test_no_better_field_is_cut_off(gauge, least, tmp_path):
    """A certificate of a field that is not the best keeps the best one, under any labels and gauge."""
    checked = 0
    for seed in (*range(103, 123), 151):
        instance = random_instance(seed, (2, 2), 9, gauge)
        best = optimum(instance).with_best_jumps()
        beta = np.clip(best.beta + np.random.default_rng(seed).normal(0, 0.02, 4), -np.pi / 4, np.pi / 4)
        best, worse = sorted((best, replace(best, beta=beta)), key=lambda field: field.energy().total)
        certificate = write_certificate(prove_round(worse, levels=4), tmp_path / "it.npz")
        narrow = with_windows(formulate(instance, "minlp-parity"), remaining_windows(certificate))
        assert narrow.violation(narrow.point(best)).worst < 1e-9
        plain = formulate(instance, "minlp-parity")
        checked += (narrow.upper - narrow.lower).sum() < 0.9 * (plain.upper - plain.lower).sum()
    assert checked >= least


def exported(proof, folder, names):
    """The folder in which `crossfield export --tightened` has written these formulations in every format."""
    certificate, path = proof
    instance = folder / "it.json"
    write_instance(certificate.field.instance, instance)
    arguments = ["export", str(instance), "-o", str(folder), "--tightened", str(path), "-q"]
    arguments += [part for name in names for part in ("-f", name)]
    assert invoke(arguments + [part for name in FORMATS for part in ("-F", name)]) == 0
    return folder


def test_headers_and_manifests_say_where_they_come_from(proof, tmp_path):
    names = ("milp-mccormick", "miqp-exact", "qp-fixed", "minlp-parity")
    folder = exported(proof, tmp_path, names)
    for name in names:
        manifest = read_manifest(folder / f"random.{name}.manifest.json")
        _, narrow = problems(proof[0], name)
        assert manifest.document["tightened"] == narrow.tightened
        assert manifest.problem().sha256 == narrow.sha256
        for file in manifest.document["files"]:
            if file["format"] != "nl":
                assert SAID in (folder / file["name"]).read_text()
    assert not list(folder.glob("*.sol")) + list(folder.glob("*.mst"))  # a certificate is no start


@pytest.mark.slow
@pytest.mark.oracles
def test_every_format_carries_them(proof, tmp_path):
    """All the programs that read the files find the narrow bounds."""
    checks = verify(exported(proof, tmp_path, ("milp-mccormick", "miqp-exact", "qp-fixed"))).checks
    bad = [check for check in checks if check.verdict in {Verdict.DIFFERS, Verdict.FAILED}]
    assert not bad
    read = {check.file.split(".", 2)[2] for check in checks if check.verdict is Verdict.AGREES}
    present = {name for program in PROGRAMS.values() if not program.missing for name in program.formats}
    assert read >= {"nl", "lp", "mps", "mod"} & present


def test_what_does_not_fit_is_refused(proof, tmp_path, capsys):
    certificate, path = proof
    other = random_instance(104, (2, 3), 9)
    with pytest.raises(InputError, match="certificate of another instance"):
        read_certificate(path, on=other)
    windows = remaining_windows(certificate)
    with pytest.raises(InstanceError, match="window of beta number 0 is empty or beyond"):
        with_windows(
            formulate(certificate.field.instance, "miqp-exact"),
            replace(windows, beta_lower=windows.beta_lower - 2),
        )
    with pytest.raises(InstanceError, match="do not fit the grid"):
        with_windows(formulate(random_instance(1, (2, 2)), "miqp-exact"), windows)
    field = tmp_path / "field.npz"
    write_field(certificate.field, field)
    instance = tmp_path / "it.json"
    write_instance(certificate.field.instance, instance)
    assert invoke(["export", str(instance), "-o", str(tmp_path / "out"), "--tightened", str(field)]) == 1
    assert "field.npz: " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    manifest = write_all(
        certificate.field.instance,
        tmp_path / "m",
        formulations=["milp-mccormick"],
        formats=["lp"],
        windows=windows,
    )[0]
    broken = manifest.document | {"windows": manifest.document["windows"] | {"p_max": [64]}}
    manifest.path.write_text(json.dumps(broken))
    with pytest.raises(InstanceError, match="do not fit the grid"):
        read_manifest(manifest.path).problem()
