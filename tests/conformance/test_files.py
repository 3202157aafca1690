"""Every file of an instance, a field, a certificate and a surface, and every picture: on every kind, written,
read back and written again, the same bytes each time.
"""

import re
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from folders import contents
from hypothesis import given, settings
from hypothesis import strategies as st
from independent_energy import Formulas
from instance_kinds import KINDS, SMALL, crossed, first_field, instances, is_provable, kind, on_mesh


def choices(call, *arguments, **more):
    """The names that a function lists in its refusal of an unknown one."""
    with pytest.raises(cf.InputError) as refused:
        call(*arguments, **more)
    return re.split(r", (?:with|and) ", str(refused.value).split("one of ")[1])[0].split(", ")


FIELD = cf.greedy_field(kind("square-orthogonal"))
FIELD_FILES = choices(cf.write_field, FIELD, "x.none")
PICTURES = choices(cf.draw, FIELD, "x.none")
PICTURE_KINDS = choices(cf.draw, FIELD, "x.png", kind="none")
LOSSLESS = {".npz", ".json"}
WORK = 4000
"""Labels after which a proof ends."""
OF_MESH = {"instance", "crosses"}


def any_field(instance):
    """A field whose lines are anywhere, as far as prescribed indices allow that."""
    if instance.indices is not None:
        return first_field(instance)
    rng = np.random.default_rng(1)
    u = rng.uniform(0, np.pi, instance.domain.size)
    skew = 0 if instance.orthogonal else rng.uniform(-0.7, 0.7, len(u))
    return cf.CrossField.from_lines(instance, u, u + np.pi / 2 - skew)


@pytest.mark.parametrize("suffix, name", crossed([".json", ".npz"], KINDS, every=2))
def test_an_instance_comes_back(suffix, name, tmp_path):
    instance = kind(name)
    path = cf.write_instance(instance, tmp_path / f"one{suffix}")
    same = cf.read_instance(path)
    assert same.sha256 == instance.sha256
    assert Formulas(same).pairs == Formulas(instance).pairs
    assert Formulas(same).strokes == Formulas(instance).strokes
    assert cf.write_instance(same, tmp_path / f"two{suffix}").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("suffix, name", crossed(FIELD_FILES, KINDS, every=3))
def test_a_field_comes_back_on_its_own_instance_only(suffix, name, tmp_path):
    field = any_field(kind(name))
    path = cf.write_field(field, tmp_path / f"one{suffix}")
    if suffix in {".ply", ".vtk"}:  # for other programs alone
        assert cf.write_field(field, tmp_path / f"two{suffix}").read_bytes() == path.read_bytes()
        return
    same = cf.read_field(path, on=field.instance)
    if suffix in LOSSLESS:
        assert all((getattr(same, key) == getattr(field, key)).all() for key in ("alpha", "beta", "p"))
        assert cf.read_field(path).instance.sha256 == field.instance.sha256
    elif suffix == ".rosy":  # the orthogonal cross between the lines
        turned = (same.alpha - field.alpha) / (np.pi / 2)
        assert np.abs(turned - np.round(turned)).max() <= 1e-9
    else:
        assert same.cross_error(field.u_angle, field.v_angle).max() <= 1e-7
        assert same.energy().total <= field.energy().total + 1e-6 * (1 + field.energy().total)
    cf.write_field(field, path)  # over its own file, which is no better
    (tmp_path / "again").mkdir()
    cf.write_field(same if suffix in LOSSLESS else field, tmp_path / "again" / path.name)
    again = contents(tmp_path / "again")
    assert again == {name: data for name, data in contents(tmp_path).items() if name in again}
    assert path.name in again
    for other in others_than(field.instance, suffix):
        with pytest.raises(cf.CrossfieldError):
            cf.read_field(path, on=other)


def others_than(instance, suffix):
    """Instances that a field is not on: with other points, and other data as far as its file holds them."""
    yield cf.sample("disc") if on_mesh(instance) else cf.sample("bottle", 8)
    if suffix in LOSSLESS:
        yield replace(instance, name="another")


PROVABLE = [name for name in SMALL if is_provable(kind(name))]


@pytest.mark.parametrize("name", crossed(PROVABLE, every=5))
def test_a_certificate_comes_back_on_its_own_instance_only(name, tmp_path):
    assert_certificate_comes_back(kind(name), 2, tmp_path)


@pytest.mark.slow
@settings(max_examples=60)
@given(instances(), st.sampled_from([2, 1, "mixed"]))
def test_certificates_of_instances_of_any_kind_come_back(tmp_path_factory, instance, norm):
    if is_provable(instance):
        norm = 2 if instance.orthogonal else norm
        assert_certificate_comes_back(instance, norm, tmp_path_factory.mktemp("proof"))


def assert_certificate_comes_back(instance, norm, folder):
    proof, again = (cf.prove(instance, norm=norm, work=WORK, jobs=1) for _ in range(2))
    path = folder / "one.npz"
    if not proof.has_bound:
        with pytest.raises(cf.SolverError):
            cf.write_certificate(proof, path)
        return
    written = cf.write_certificate(proof, path)
    read = cf.read_certificate(path, on=proof.field.instance)
    for certificate in (written, read):
        assert (certificate.bound, certificate.status, certificate.forced) == (
            proof.bound, proof.status, proof.forced,
        )  # fmt: skip
    assert (read.field.alpha == proof.field.alpha).all()
    assert read.energy == pytest.approx(read.field.energy(norm).total, rel=1e-12, abs=1e-12)
    assert (proof.gap == 0) == (proof.status == "optimal") == (proof.ended == "optimal")
    least = None if norm == "mixed" else Formulas(proof.field.instance).least(norm)
    if least is not None:
        assert proof.bound <= least + 1e-9 * max(1.0, least)
        assert proof.status == "gap" or proof.energy <= least + 1e-8 * max(1.0, least)
    cf.write_certificate(again, folder / "two.npz")
    assert (folder / "two.npz").read_bytes() == path.read_bytes()
    with pytest.raises(cf.InputError, match="is a certificate of another instance"):
        cf.read_certificate(path, on=replace(proof.field.instance, name="another"))


STREAMED = ("field", "overview", "layers")
"""Pictures that follow lines through the field, which takes seconds: on one kind; meshes have none."""


@pytest.mark.parametrize(
    "suffix, picture, name",
    [
        *crossed(PICTURES, [name for name in PICTURE_KINDS if name not in STREAMED], SMALL[::8], every=7),
        *crossed(PICTURES, STREAMED, ["hole"], every=1, slow=STREAMED),
        *crossed(PICTURES, STREAMED, ["fan"], every=1),
    ],
)
def test_a_picture_is_drawn(suffix, picture, name, tmp_path):
    instance = kind(name)
    subject = instance if picture == "instance" else any_field(instance)
    paths = [tmp_path / f"{count}{suffix}" for count in range(2)]
    if on_mesh(instance) and picture not in OF_MESH:
        with pytest.raises(cf.InstanceError, match="choose one of instance, crosses"):
            cf.draw(subject, paths[0], kind=picture)
        assert not contents(tmp_path)
        return
    for path in paths:
        cf.draw(subject, path, kind=picture)
    one, two = contents(tmp_path).values()
    assert one == two
    assert len(one) > 500


@pytest.mark.parametrize("name", crossed(SMALL, every=8))
def test_a_surface_is_written(name, tmp_path):
    field = any_field(kind(name))
    if on_mesh(field.instance):
        with pytest.raises(cf.InstanceError, match="on the faces of a mesh"):
            cf.surface(field)
        return
    surface = cf.surface(field)
    inside = np.isfinite(surface.heights)
    assert inside.sum() >= field.instance.domain.size
    for folder in ("one", "two"):
        cf.write_surface(surface, tmp_path / folder, side=32)
    one, two = (contents(tmp_path / folder) for folder in ("one", "two"))
    assert one == two
    assert len(one) >= 8


def test_the_order_of_work_does_not_matter(tmp_path):
    """Instances that were made twice, and fields that were computed after others, give the same bytes."""
    for count, names in enumerate([SMALL, SMALL[::-1]]):
        for name in names:
            cf.write_field(cf.greedy_field(KINDS[name]()), tmp_path / f"{name}.{count}.npz")
    for name in SMALL:
        one, two = ((tmp_path / f"{name}.{count}.npz").read_bytes() for count in range(2))
        assert one == two, name
