"""Forged certificates: whatever is changed, nothing false of the instance in the file is confirmed."""

from __future__ import annotations

import json
import re
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
from crossfield.models.proof.certificate import read_certificate, write_certificate
from crossfield.models.proof.checkers import check_certificate
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


def with_entry(name, at, value):
    """A function that returns arrays with one entry of an array changed."""

    def change(arrays):
        array = arrays[name].copy()
        array.reshape(-1)[at] = value
        return arrays | {name: array}

    return change


def of_instance(**changes):
    """A function that returns arrays with other keys in the head of the instance."""
    return lambda arrays: with_head(arrays, "instance_head", **changes)


BROKEN = {
    "orthogonal crosses": (of_instance(orthogonal=True), "orthogonal"),
    "1 for true": (of_instance(orthogonal=1), "orthogonal"),
    "weights of pairs": (
        lambda a: a | {"instance_pair_weights": np.ones(4)},
        "instance_pair_weights too many",
    ),
    "an unknown gauge": (of_instance(gauge="none"), "gauge"),
    "a skew weight below 0": (of_instance(w_beta=-1e-9), "w_beta"),
    "a skew weight that is no number": (of_instance(w_beta=np.nan), "w_beta"),
    "an infinite weight of strokes": (of_instance(w_strokes=np.inf), "w_strokes"),
    "true for a weight": (of_instance(w_strokes=True), "w_strokes"),
    "a stroke direction of pi": (with_entry("instance_theta", 0, np.pi), "theta"),
    "a stroke without weight": (with_entry("instance_w", 0, 0.0), "instance_w"),
    "one stroke twice": (with_entry("instance_stroke_pixels", [2, 3], [0, 0]), "strokes"),
    "a stroke at -1": (with_entry("instance_stroke_pixels", 0, -1), "stroke_pixels"),
    "a field outside its window": (with_entry("alpha", 0, 4.0), "alpha"),
    "a skew beyond pi/4": (with_entry("beta", 0, -0.8), "beta"),
    "a great jump": (with_entry("p", 0, 65), "p[0]"),
    "the least jump of 32 bits": (with_entry("p", 0, -(2**31)), "p[0]"),
    "a far centre": (with_entry("centre_alpha", 0, -16.1), "centre_alpha"),
    "a far centre of beta": (with_entry("centre_beta", 0, 16.1), "centre_beta"),
    "a spacing of 0": (with_entry("level_0_h", 0, 0.0), "level_0_h"),
    "a spacing below 0": (with_entry("level_0_h", 0, -0.1), "level_0_h"),
    "a wide spacing": (with_entry("level_0_h", 0, 0.8), "level_0_h"),
    "another spacing": (lambda a: a | {"level_1_h": a["level_0_h"] / 3}, "level_1_h"),
    "no cell": (with_entry("level_0_ranges", 1, 1), "level_0_ranges"),
    "a count below 0": (with_entry("level_0_ranges", 1, -9), "level_0_ranges"),
    "many labels": (with_entry("level_0_ranges", 1, 4097), "level_0_ranges"),
    "labels far away": (with_entry("level_0_ranges", 0, -(2**31)), "level_0_ranges"),
    "a unit below 0": (with_entry("level_0_share_unit", 0, -1e-9), "share_unit"),
    "a great unit": (with_entry("level_2_table_unit", 0, 1.1), "table_unit"),
    "a quad at -1": (with_entry("level_2_quads", 0, -1), "level_2_quads"),
    "a quad beyond the pixels": (with_entry("level_2_quads", 0, 4), "level_2_quads"),
    "a pixel without a quad": (with_entry("level_2_quads", 0, 0), "level_2_quads"),
    "a quad twice": (lambda a: a | {"level_2_quads": np.repeat(a["level_2_quads"], 2)}, "out of order"),
    "a cut at no pixel": (lambda a: a | {"cuts": np.array([-2], "i4")}, "cuts"),
    "a cut at no pair": (lambda a: a | {"cuts": np.array([8], "i4")}, "cuts"),
    "a great multiplier": (with_entry("multipliers", 0, -2e6), "multipliers"),
    "a claim below everything": (lambda a: with_head(a, bound=-np.inf), "bound is not in"),
    "a claim that is no number": (lambda a: with_head(a, bound=np.nan), "bound is not in"),
    "an infinite energy": (lambda a: with_head(a, energy=np.inf), "energy is not in"),
    "levels that are no whole number": (lambda a: with_head(a, levels=2.5), "levels"),
}


def test_each_broken_assumption_is_refused_by_name(honest, subtests):
    sound = check_certificate.read_arrays(str(honest("tables")))
    assert check_certificate.check_arrays(sound)
    for kind, (change, message) in BROKEN.items():
        with subtests.test(kind=kind), pytest.raises(REFUSED, match=re.escape(message)):
            check_certificate.check_arrays(change(sound))


def test_tables_and_slopes_are_those_of_the_norm(honest):
    sound = check_certificate.read_arrays(str(honest("norm 1")))
    steep = np.full(len(sound["slopes"]), -1.1)
    for change, message in (
        ({"slopes": steep}, "slopes"),
        ({"level_0_quads": np.array([2], "i4")}, "level_0_quads needs the norm 2"),
        ({"centre_beta": sound["centre_beta"] + 0.1}, "centre_beta"),
        ({"level_0_h": sound["level_0_h"] * (1 + 1e-12)}, "level_0_h"),
    ):
        with pytest.raises(REFUSED, match=message):
            check_certificate.check_arrays(sound | change)
