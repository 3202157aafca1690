"""Forged certificates: whatever is changed, nothing false of the instance in the file is confirmed."""

from __future__ import annotations

import json
import re
import zipfile
from collections import Counter
from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest
from archives import members_of, npy, packed
from certificate_arrays import claiming, of_instance, with_allowed, with_array, with_entry, with_head
from crossfield.models.instance.file import instance_of_arrays
from crossfield.models.proof.checkers import check_certificate
from crossfield.models.search.angle_program import alternate_absolute
from exhaustive import optimum, random_instance
from proofs_round_fields import prove_round

REFUSED = (check_certificate.NotProvenError, check_certificate.UnreadableError)
KINDS = ("optimal", "a window binds", "a worse field", "tables", "norm 1", "norm mixed")
COARSE = 2.0**-12
TRIES = 1
"""Places of every array that are changed, each once up and once down; others for every kind."""


def proof_of_kind(kind):
    """A proof of four pixels."""
    if kind.startswith("norm"):
        return cf.prove(random_instance(2, (2, 2), 4), norm=1 if kind == "norm 1" else "mixed", jobs=1)
    seed = {"optimal": 1, "a window binds": 6, "a worse field": 4, "tables": 3}[kind]
    field = optimum(random_instance(seed, (2, 2), 4))
    if kind == "a worse field":
        field = cf.CrossField(field.instance, field.alpha, field.beta + np.array([0, 0.01, 0, 0]), field.p)
    proof = prove_round(field, levels=3)
    if kind == "tables":
        grid, last = field.instance.grid, f"level_{len(proof.levels) - 1}_"
        side = proof.arrays[f"{last}ranges"][:, 1]
        size = int(side[grid.first] @ side[grid.second])
        tables = {
            f"{last}quads": grid.first[grid.quads[:, 0]].astype(np.int32),
            f"{last}table_steps": np.random.default_rng(3).integers(-1, 2, size).astype(np.int32),
            f"{last}table_unit": np.full(4, COARSE),
        }
        proof = replace(proof, arrays=proof.arrays | tables)
    return proof


@pytest.fixture
def honest(tmp_path):
    """A function that returns the file of a certificate of a kind, which claims all that it proves."""

    def of(kind):
        path = tmp_path / "it.npz"
        cf.write_certificate(proof_of_kind(kind), path)
        return path

    return of


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
    arrays = check_certificate.unpack_arrays(honest(kind).read_bytes())
    arrays = {name: arrays[name] for name in sorted(arrays)}  # the same changes for any order in the file
    rng, known, counts = np.random.default_rng([7, KINDS.index(kind)]), {}, Counter()
    for name, other in changes(arrays, rng):
        for held in [other, *modest(name, other)]:
            bound = confirmed_bound(held)
            counts["refused" if bound is None else "confirmed"] += 1
            if bound is None:
                continue
            head = json.loads(held["head"].tobytes())
            try:
                least = least_energy(other, known, head["norm"])
            except cf.InstanceError:
                continue  # crossfield does not read such an instance
            assert max(bound, head["bound"]) <= least + 1e-11, name
            assert head["bound"] <= bound + 1.1 * check_certificate.SPARE * (1 + bound), name
            assert head["status"] == "gap" or head["energy"] <= least + 2e-8, name
    assert counts["refused"] > 50
    assert counts["confirmed"] > 50


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


@pytest.mark.slow
def test_every_array_in_another_form_is_refused(honest, tmp_path, subtests):
    """Or if it is left out; arrays of the last level stand for those of all."""
    path, other = honest("tables"), tmp_path / "other.npz"
    members, arrays = members_of(path.read_bytes()), check_certificate.unpack_arrays(path.read_bytes())
    for name, array in arrays.items():
        if name.startswith(("level_0", "level_1")):
            continue
        for kind, form in {**other_forms(array), "left out": None}.items():
            with subtests.test(name=name, what=kind):
                changed = {key: data for key, data in members.items() if key != f"{name}.npy"}
                changed |= {} if form is None else {f"{name}.npy": npy(form)}
                other.write_bytes(packed([*changed.items()], zipfile.ZIP_STORED))
                with pytest.raises((cf.InputError, cf.InstanceError)):
                    cf.read_certificate(other)


def first_level(arrays):
    """The arrays with the first level alone, whose labels are too coarse for the optimum."""
    kept = {name: array for name, array in arrays.items() if not re.match("level_[12]_", name)}
    kept |= {name: kept[name][:0] for name in ("cuts", "multipliers")}
    return with_head(kept, levels=1, bound=0.0)


def without_a_label(arrays):
    """The arrays with one label less on the first level, and as many shares."""
    bits = np.unpackbits(arrays["level_0_allowed"])
    bits[0] = 0
    return with_allowed(arrays, 0, bits)


def repeated_key(arrays):
    """The arrays with two bounds in their head."""
    text = arrays["head"].tobytes().replace(b"{", b'{"bound": 1.0, ', 1)
    return arrays | {"head": np.frombuffer(text, np.uint8)}


def with_cuts(cuts):
    """A function that returns arrays with other cuts, and as many rows of multipliers."""

    def change(arrays):
        rows = np.resize(arrays["multipliers"], (cuts.count(-1), arrays["multipliers"].shape[1]))
        return arrays | {"cuts": np.array(cuts, "i4"), "multipliers": rows}

    return change


BROKEN = [
    # The claim
    ("is no crossfield-certificate of version 4", claiming(version=3)),
    ("is no crossfield-certificate of version 4", claiming(version=5)),
    ("is no crossfield-certificate of version 4", claiming(version="4")),
    ("is no crossfield-certificate of version 4", claiming(version=4.0)),
    ("is no crossfield-certificate of version 4", claiming(version=True)),
    ("a repeated key", repeated_key),
    ("energy is claimed", claiming(energy=0.01)),
    ("energy is not in", claiming(energy=np.inf)),
    ("bound is claimed", claiming(bound=1.0)),
    ("bound is not in", claiming(bound=-np.inf)),
    ("bound is not in", claiming(bound=np.nan)),
    ("status is neither", claiming(status="best")),
    ("status is claimed as optimal", first_level),
    ("levels is not in", claiming(levels=0)),
    ("levels is no whole number", claiming(levels=2.5)),
    ("too many for a certificate with 1 levels", claiming(levels=1, status="gap", bound=0.0)),
    # The instance and the field
    ("orthogonal", of_instance(orthogonal=True)),
    ("orthogonal", of_instance(orthogonal=1)),
    ("gauge", of_instance(gauge="none")),
    ("w_beta", of_instance(w_beta=-1e-9)),
    ("w_beta", of_instance(w_beta=np.nan)),
    ("w_strokes", of_instance(w_strokes=np.inf)),
    ("w_strokes", of_instance(w_strokes=True)),
    ("instance_pair_weights too many", with_array("instance_pair_weights", [1] * 4, "f8")),
    ("instance_crossings", with_array("instance_crossings", [0])),
    ("theta", with_entry("instance_theta", 0, np.pi)),
    ("instance_w[0] is not in", with_entry("instance_w", 0, 0.0)),
    ("instance_w[0] is not in", with_entry("instance_w", 0, 1.5)),
    ("strokes", with_entry("instance_stroke_pixels", [2, 3], [0, 0])),
    ("stroke_pixels", with_entry("instance_stroke_pixels", 0, -1)),
    ("alpha[0] is outside", with_entry("alpha", 0, 4.0)),
    ("beta[3] is beyond", with_entry("beta", 3, -0.8)),
    ("p[0]", with_entry("p", 0, 65)),
    ("p[0]", with_entry("p", 0, -(2**31))),
    # The levels
    ("has no array level_1_h", lambda arrays: {name: arrays[name] for name in arrays if name != "level_1_h"}),
    ("centre_alpha", with_entry("centre_alpha", 0, -16.1)),
    ("centre_beta", with_entry("centre_beta", 0, 16.1)),
    ("level_0_h holds something", with_entry("level_0_h", 0, np.nan)),
    ("level_0_h", with_entry("level_0_h", 0, 0.0)),
    ("level_0_h", with_entry("level_0_h", 0, -0.1)),
    ("level_0_h", with_entry("level_0_h", 0, 0.8)),
    ("level_1_h", lambda arrays: arrays | {"level_1_h": arrays["level_0_h"] / 3}),
    ("level_0_ranges", with_entry("level_0_ranges", 1, 1)),
    ("level_0_ranges", with_entry("level_0_ranges", 1, -9)),
    ("level_0_ranges", with_entry("level_0_ranges", 1, 4097)),
    ("level_0_ranges", with_entry("level_0_ranges", 0, -(2**31))),
    ("level_0_allowed of pixel 0", without_a_label),
    ("level_0_share_steps has another", with_entry("level_0_allowed", 0, 127)),
    (
        "level_2_allowed of pixel[0]",
        lambda arrays: with_array("level_2_allowed", 0 * arrays["level_2_allowed"], "u1")(arrays),
    ),
    ("level 1, pixel 0", lambda arrays: arrays | {"level_0_share_unit": arrays["level_0_share_unit"] / 2}),
    (
        "level 1, pixel 2",
        lambda arrays: with_entry("level_1_ranges", 8, arrays["level_1_ranges"][2, 0] + 1)(arrays),
    ),
    ("share_unit", with_entry("level_0_share_unit", 0, -1e-9)),
    ("table_unit", with_entry("level_2_table_unit", 0, 1.1)),
    ("level_2_quads", with_entry("level_2_quads", 0, -1)),
    ("level_2_quads", with_entry("level_2_quads", 0, 4)),
    ("level_2_quads", with_entry("level_2_quads", 0, 0)),
    ("out of order", lambda arrays: arrays | {"level_2_quads": np.repeat(arrays["level_2_quads"], 2)}),
    # The last step
    ("cuts", with_array("cuts", [-2])),
    ("cuts", with_array("cuts", [8])),
    ("multipliers", with_entry("multipliers", 0, -2e6)),
]
"""Messages, and the changes that they refuse."""
BROKEN_IN_NORM_1 = [
    ("slopes", with_entry("slopes", 0, -1.1)),
    ("level_0_quads needs the norm 2", with_array("level_0_quads", [2])),
    ("centre_beta", with_entry("centre_beta", 0, 0.1)),
    ("level_0_h", lambda arrays: arrays | {"level_0_h": arrays["level_0_h"] * (1 + 1e-12)}),
    ("leaves out jumps of pair 1", with_cuts([5])),
    ("leaves pieces out", with_cuts([0, -1])),
    ("leaves pieces out", with_cuts([0, 0, -1, -1])),
    ("has a piece too many", with_cuts([0, -1, -1, -1, -1, -1])),
    ("is no pixel and no pair", with_cuts([99, -1, -1])),
]


@pytest.mark.parametrize("kind, broken", [("tables", BROKEN), ("norm 1", BROKEN_IN_NORM_1)])
def test_each_broken_assumption_is_refused_by_name(kind, broken, honest, subtests):
    sound = check_certificate.unpack_arrays(honest(kind).read_bytes())
    assert check_certificate.check_arrays(sound)
    for number, (message, change) in enumerate(broken):
        with (
            subtests.test(message, number=number),
            pytest.raises(REFUSED, match=re.escape(message)) as refusal,
        ):
            check_certificate.check_arrays(change(sound))
        assert "\n" not in str(refusal.value)
