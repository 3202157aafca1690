"""Instances without pairs, strokes or energy: each has a proof, written, checked and read."""

import json

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.models.instance.instance import Instance
from crossfield.models.instance.mesh import Mesh

pytestmark = pytest.mark.numeric


def triangles(count, strokes):
    """Triangles apart, the first of which have a stroke."""
    at = np.arange(count)[:, None]
    corners = np.stack([3 * at + (0, 1, 0), 0 * at + (0, 0, 1), 0 * at + (0, 0, 0)], axis=-1)
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    ones = np.ones(strokes)
    return Instance.on_faces(
        "apart", Mesh(corners.reshape(-1, 3), faces), np.arange(strokes), 0.3 * ones, ones
    )


def pixels(mask, weight, **more):
    """Pixels whose first one has a stroke."""
    one = np.ones(1)
    return Instance.on_pixels(
        "few", np.array(mask), [[0, 0]], 0.3 * one, one, stroke_coefficient=weight, **more
    )


MASKS = ([[True]], [[True, False, True]], [[True, True]])
CASES = [
    *(triangles(count, strokes) for count in (1, 2) for strokes in range(count + 1)),
    *(pixels(mask, weight, orthogonal=True) for mask in MASKS for weight in (0.0, 1.0, 1e-12)),
    *(pixels(mask, weight) for mask in MASKS for weight in (0.0, 1.0)),
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("instance", CASES, ids=lambda instance: instance.summary)
def test_an_instance_that_costs_nothing_is_proven_optimal(instance, tmp_path):
    path = tmp_path / "it.npz"
    for norm in (2,) if instance.orthogonal else (2, 1, "mixed"):
        proof = cf.prove(instance, norm=norm, jobs=1)
        assert (proof.status, proof.ended, proof.bound) == ("optimal", "optimal", 0.0)
        assert proof.energy == pytest.approx(0.0, abs=1e-12)
        assert cf.write_certificate(proof, path).status == "optimal"
        assert cf.read_certificate(path, on=instance).bound == 0.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("instance", [triangles(1, 0), pixels([[True]], 0.0, orthogonal=True)])
def test_the_command_proves_and_checks_an_instance_that_costs_nothing(instance, tmp_path, capsys):
    cf.write_instance(instance, tmp_path / "it.json")
    invoke(["prove", str(tmp_path / "it.json"), "-o", str(tmp_path / "out"), "--json"])
    assert json.loads(capsys.readouterr().out)["status"] == "optimal"
    invoke(["prove", "--check", *map(str, (tmp_path / "out").glob("*.certificate.npz"))])
    assert "the certificate is valid" in capsys.readouterr().out
