"""Forged certificates: whatever is changed, nothing false of the instance in the file is confirmed."""

from __future__ import annotations

import json
import zipfile
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from allowed_labels import with_allowed
from archives import forged, members_of, npy, packed
from crossfield.models.errors import InputError, InstanceError
from crossfield.models.field.field import CrossField
from crossfield.models.instance.file import instance_of_arrays
from crossfield.models.proof import check_certificate
from crossfield.models.proof.certificate import read_certificate, write_certificate
from crossfield.models.proof.clusters import zero_clusters
from crossfield.models.proof.prove import prove
from crossfield.models.search.angle_program import alternate_absolute
from exhaustive import optimum, random_instance
from proofs_round_fields import prove_round

REFUSED = (check_certificate.NotProvenError, check_certificate.UnreadableError)
KINDS = ("optimal", "a window binds", "a worse field", "tables", "norm 1", "norm mixed")
COARSE = 2.0**-12
TRIES = 7
"""Places of every array that are changed, each once up and once down."""


def proof_of_kind(kind):
    """A proof of four pixels."""
    if kind.startswith("norm"):
        return prove(random_instance(2, (2, 2), 4), norm=1 if kind == "norm 1" else "mixed", jobs=1)
    seed = {"optimal": 1, "a window binds": 6, "a worse field": 4, "tables": 3}[kind]
    field = optimum(random_instance(seed, (2, 2), 4))
    if kind == "a worse field":
        field = CrossField(field.instance, field.alpha, field.beta + np.array([0, 0.01, 0, 0]), field.p)
    proof = prove_round(field, levels=3)
    if kind == "tables":
        *before, last = proof.levels
        clusters = zero_clusters(last, np.zeros(1, int))
        tables = {
            "quads": field.instance.grid.first[clusters.quads[:, 0]].astype(np.int32),
            "table_steps": np.random.default_rng(3).integers(-1, 2, clusters.start[-1]).astype(np.int32),
            "table_unit": np.full(4, COARSE),
        }
        proof = replace(proof, levels=(*before, replace(last, tables=tables)))
    return proof


@pytest.fixture
def honest(tmp_path):
    """A function that returns the file of a certificate of a kind, which claims all that it proves."""

    def of(kind):
        path = tmp_path / "it.npz"
        write_certificate(proof_of_kind(kind), path)
        return path

    return of


def with_head(arrays, name="head", **changes):
    head = json.loads(arrays[name].tobytes()) | changes
    return arrays | {name: np.frombuffer(json.dumps(head).encode(), np.uint8)}


def modest(name, arrays):
    """The arrays with the energy of the field in them and no claim beyond it, if there is such a field."""
    if name == "head":
        return []
    try:
        terms, _ = check_certificate.terms_of(arrays)
        energy, _ = check_certificate.energy_of(terms, *check_certificate.field_of(arrays, terms))
    except (*REFUSED, ValueError, TypeError, KeyError, IndexError, OverflowError):  # as in `check_arrays`
        return []
    return [with_head(arrays, status="gap", energy=energy, bound=0.0)]


def moved(number, way, rng):
    """A number of an array, moved in one direction, little or much."""
    if number.dtype.kind == "b":
        return ~number
    if number.dtype.kind == "f":
        return round(number + way * rng.choice([1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 100.0]), 12)
    limit = np.iinfo(number.dtype)
    value = int(number) + way * int(rng.choice([1, 1, 2, 16, 1000, limit.max]))
    return number.dtype.type(min(max(value, limit.min), limit.max))


def changes(arrays, rng):
    """Names of arrays, and all arrays with one number of that one changed."""
    for name in arrays:
        size = arrays[name].size
        for at in rng.permutation(size)[:TRIES]:
            for way in (1, -1):
                array = arrays[name].copy()
                place = np.unravel_index(at, array.shape)
                array[place] = moved(array[place], way, rng)
                yield name, arrays | {name: array}
                if name.endswith("_allowed"):  # with as many shares, too
                    level = int(name.removeprefix("level_").removesuffix("_allowed"))
                    yield name, with_allowed(arrays, level, np.unpackbits(array))
    for name in ("head", "instance_head"):
        head = json.loads(arrays[name].tobytes())
        for key, value in head.items():
            for factor in (0, 1 - 1e-3, 1 + 1e-9, 1 + 1e-3, 2, -1, 1e9, np.nan, np.inf):
                if type(value) is int or (isinstance(value, float) and key != "pixel_size"):
                    yield name, with_head(arrays, name, **{key: value * factor})


def least_energy(arrays, known, norm):
    """The energy of a good field of the instance in a certificate; InstanceError where it is none."""
    parts = {key.removeprefix("instance_"): arrays[key] for key in arrays if key.startswith("instance_")}
    instance = instance_of_arrays(parts)
    if instance.sha256 not in known:
        field = optimum(instance)
        known[instance.sha256] = (field if norm == 2 else alternate_absolute(field, norm)).energy(norm).total
    return known[instance.sha256]


def confirmed_bound(arrays):
    """The bound that the checker confirms, None where it refuses."""
    try:
        return check_certificate.check_arrays(arrays).bound
    except REFUSED:
        return None


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_no_changed_number_makes_a_false_claim_pass(kind, honest):
    """With the claims of the file, and with none beyond the energy: a bound is not above the optimum.

    Where the status is `optimal`, the bound confirms the energy, too.
    """
    arrays = check_certificate.read_arrays(str(honest(kind)))
    arrays = {name: arrays[name] for name in sorted(arrays)}  # the same changes for any order in the file
    rng, known, counts = np.random.default_rng(7), {}, Counter()
    for name, other in changes(arrays, rng):
        for held in [other, *modest(name, other)]:
            bound = confirmed_bound(held)
            counts["refused" if bound is None else "confirmed"] += 1
            if bound is None:
                continue
            head = json.loads(held["head"].tobytes())
            try:
                least = least_energy(other, known, head["norm"])
            except InstanceError:
                continue  # crossfield does not read such an instance
            assert max(bound, head["bound"]) <= least + 1e-11, name
            assert head["bound"] <= bound + 1.1 * check_certificate.SPARE * (1 + bound), name
            assert head["status"] == "gap" or head["energy"] <= least + 2e-8, name
    assert counts["refused"] > 100
    assert counts["confirmed"] > 100


def other_forms(array):
    """The array in forms that a certificate does not have."""
    kind = array.dtype
    swapped = kind.newbyteorder(">") if kind.itemsize > 1 else np.dtype("S1")
    forms = {
        "another type": array.astype("<i8" if kind != np.int64 else "<i4"),
        "another width": array.astype("<f4" if kind.kind == "f" else "<u4"),
        "another byte order": array.astype(swapped),
        "one more": np.concatenate([array, array[-1:]]) if array.size else np.zeros(1, kind),
        "one more axis": array[None],
        "no entry": array[:0] if array.size else array[None],
        "one less": array[:-1],
        "flat": array.ravel() if array.ndim > 1 else array[:, None],
    }
    if array.ndim > 1 and min(array.shape) > 1:
        forms["order of columns"] = np.asfortranarray(array)
        forms["transposed"] = np.ascontiguousarray(array.T[:-1])
    if kind.kind == "f":
        for value in (np.nan, np.inf, -np.inf):
            forms[str(value)] = np.where(np.arange(array.size) == array.size - 1, value, array)
    return {name: form for name, form in forms.items() if array.size or name in {"one more", "another type"}}


def assert_refused(path):
    """No reader takes the file for a certificate."""
    assert check_certificate.main([str(path)]) in {1, 2}
    with pytest.raises((InputError, InstanceError)):
        read_certificate(path)


def test_every_array_in_another_form_is_refused(honest, tmp_path, subtests):
    """Arrays of the last level stand for those of all."""
    path, other = honest("tables"), tmp_path / "other.npz"
    members, arrays = members_of(path.read_bytes()), check_certificate.read_arrays(str(path))
    for name, array in arrays.items():
        for kind, form in other_forms(array).items() if not name.startswith(("level_0", "level_1")) else ():
            with subtests.test(name=name, what=kind):
                changed = members | {f"{name}.npy": npy(form)}
                other.write_bytes(packed([*changed.items()], zipfile.ZIP_STORED))
                assert_refused(other)


def test_every_array_twice_renamed_or_left_out_is_refused(honest, tmp_path, subtests):
    data, other = honest("tables").read_bytes(), tmp_path / "other.npz"
    members = members_of(data)
    for member in members:
        files = forged(member.removesuffix(".npy"))
        left_out = packed([entry for entry in members.items() if entry[0] != member])
        for forgery in ("a member twice", "a name in other case", "another ending", "left out"):
            with subtests.test(member=member, what=forgery):
                other.write_bytes(left_out if forgery == "left out" else files[forgery](data))
                assert_refused(other)
