"""Problems with windows narrowed by a certificate: the same optimum, in every format, and marked."""

import json
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from cases import SKEWED
from command_line import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.formulations.windows import Windows
from crossfield.models.proof.tightening import remaining_windows
from exhaustive import exact, optimum, random_instance
from proofs_round_fields import prove_round

TWO_NORM = ("minlp-parity", "minlp-quartic", "minlp-cubic", "miqp-exact", "qp-fixed")


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    """A certificate of the optimum of 2 x 3 pixels, and the file it is in."""
    instance = random_instance(103, (2, 3), 9)
    field = optimum(instance)
    assert field.energy().total == pytest.approx(exact(instance), abs=1e-12)
    path = tmp_path_factory.mktemp("proof") / "it.npz"
    return cf.write_certificate(prove_round(field, levels=4), path), path


def problems(proof, name):
    """A formulation with the windows of the gauge, and with the narrowed ones."""
    recipe, field = FORMULATIONS[name], proof.field
    plain = cf.formulate(field.instance, name, p=field.p if recipe.fixed else None)
    return plain, replace(plain, windows=remaining_windows(proof))


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
    relaxed = cf.formulate(certificate.field.instance, "miqp-exact", relax=True)
    narrow = replace(relaxed, windows=windows)
    assert cf.solve(relaxed, "ipopt").objective < cf.solve(narrow, "ipopt").objective - 1e-4
    assert narrow.tightened.endswith("the relaxation may rise")
    for name in SKEWED:
        if not FORMULATIONS[name].fixed:
            problem = cf.formulate(certificate.field.instance, name, relax=True)
            assert "stays" not in replace(problem, windows=windows).tightened


@pytest.mark.parametrize(
    "norm, formulations",
    [(1, ("milp-mccormick", "miqcp-bilinear-l1")), ("mixed", ("miqp-mccormick", "miqcp-bilinear"))],
)
def test_windows_of_another_norm_keep_the_optimum_of_its_formulations(norm, formulations, tmp_path):
    result = cf.prove(random_instance(103, (2, 3), 9), norm=norm, jobs=1)
    windows = remaining_windows(cf.write_certificate(result, tmp_path / "it.npz"))
    for name in SKEWED:
        problem = cf.formulate(
            result.field.instance, name, p=result.field.p if FORMULATIONS[name].fixed else None
        )
        narrow = replace(problem, windows=windows)
        assert ("the optimum stays" in narrow.tightened) == (name in formulations)
        assert narrow.violation(narrow.point(result.field)).worst < 1e-9
        assert Windows.of_document(narrow.windows.document()).norm == norm
    other = cf.formulate(result.field.instance, "milp-mccormick", stroke_norm=2)
    assert "may rise" in replace(other, windows=windows).tightened
    if norm == 1:
        plain = cf.formulate(result.field.instance, "milp-mccormick")
        for problem in (plain, replace(plain, windows=windows)):
            assert cf.solve(problem, "highs").objective == pytest.approx(result.energy, abs=1e-6)


@pytest.mark.parametrize("gauge, seeds", [("strokes", (106, 107, 111, 122)), ("box", (104, 112, 151))])
def test_no_better_field_is_cut_off(gauge, seeds, tmp_path):
    """A certificate of a field that is not the best keeps the best one, under any labels and gauge."""
    for seed in seeds:
        instance = random_instance(seed, (2, 2), 9, gauge)
        best = optimum(instance).with_best_jumps()
        beta = np.clip(best.beta + np.random.default_rng(seed).normal(0, 0.02, 4), -np.pi / 4, np.pi / 4)
        best, worse = sorted((best, replace(best, beta=beta)), key=lambda field: field.energy().total)
        certificate = cf.write_certificate(prove_round(worse, levels=4), tmp_path / "it.npz")
        plain = cf.formulate(instance, "minlp-parity")
        narrow = replace(plain, windows=remaining_windows(certificate))
        assert narrow.violation(narrow.point(best)).worst < 1e-9
        assert (narrow.upper - narrow.lower).sum() < 0.9 * (plain.upper - plain.lower).sum()


def test_headers_and_manifests_say_where_they_come_from(proof, tmp_path):
    certificate, path = proof
    instance = cf.write_instance(certificate.field.instance, tmp_path / "it.json")
    names = ("milp-mccormick", "miqp-exact", "qp-fixed", "minlp-parity")
    arguments = ["export", str(instance), "-o", str(tmp_path), "--tightened", str(path)]
    arguments += [part for name in names for part in ("-f", name)]
    assert invoke(arguments + [part for name in FORMATS for part in ("-F", name)]) == 0
    for name in names:
        manifest = cf.read_manifest(tmp_path / f"random.{name}.manifest.json")
        _, narrow = problems(certificate, name)
        assert manifest.document["tightened"] == narrow.tightened
        assert manifest.problem().sha256 == narrow.sha256
        for file in manifest.document["files"]:
            if file["format"] != "nl":
                assert "narrowed to what a proof leaves" in (tmp_path / file["name"]).read_text()
    assert not list(tmp_path.glob("*.sol")) + list(tmp_path.glob("*.mst"))  # a certificate is no start


def test_what_does_not_fit_is_refused(proof, tmp_path, capsys):
    certificate, path = proof
    with pytest.raises(cf.InputError, match="certificate of another instance"):
        cf.read_certificate(path, on=random_instance(104, (2, 3), 9))
    windows = remaining_windows(certificate)
    for instance, wrong, words in (
        (
            certificate.field.instance,
            replace(windows, beta_lower=windows.beta_lower - 2),
            "is empty or beyond",
        ),
        (random_instance(1, (2, 2)), windows, "do not fit the grid"),
    ):
        with pytest.raises(cf.InstanceError, match=words):
            replace(cf.formulate(instance, "miqp-exact"), windows=wrong)
    field = cf.write_field(certificate.field, tmp_path / "field.npz")
    instance = cf.write_instance(certificate.field.instance, tmp_path / "it.json")
    command = ["export", str(instance), "-o", str(tmp_path / "out"), "--tightened", str(field)]
    assert invoke(command) == 1
    assert "field.npz: " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    narrow = problems(certificate, "milp-mccormick")[1]
    manifest = cf.write(narrow, tmp_path / "m", formats=["lp"])
    broken = manifest.document | {"windows": manifest.document["windows"] | {"p_max": [64]}}
    manifest.path.write_text(json.dumps(broken))
    with pytest.raises(cf.InstanceError, match="do not fit the grid"):
        cf.read_manifest(manifest.path).problem()
