"""Changes of the arrays of certificates, which are then as a forger would have them."""

import json

import numpy as np


def with_head(arrays, name="head", **changes):
    """The arrays with other keys in the head of the certificate, or in that of its instance."""
    head = json.loads(arrays[name].tobytes()) | changes
    return arrays | {name: np.frombuffer(json.dumps(head).encode(), np.uint8)}


def claiming(**changes):
    """A function that returns arrays with other claims."""
    return lambda arrays: with_head(arrays, **changes)


def of_instance(**changes):
    """A function that returns arrays with other keys in the head of the instance."""
    return lambda arrays: with_head(arrays, "instance_head", **changes)


def with_array(name, array, kind="i4"):
    """A function that returns arrays with another one of that name."""
    return lambda arrays: arrays | {name: np.array(array, kind)}


def with_entry(name, at, value):
    """A function that returns arrays with one entry of an array changed."""

    def change(arrays):
        array = arrays[name].copy()
        array.reshape(-1)[at] = value
        return arrays | {name: array}

    return change


def allowed_of(arrays, level):
    """The bits of a level's labels."""
    count = arrays[f"level_{level}_ranges"][:, 1::2].astype(int).prod(axis=1).sum()
    return np.unpackbits(arrays[f"level_{level}_allowed"], count=count).astype(bool)


def with_allowed(arrays, level, bits):
    """The arrays with other bits of a level's labels: shares stay as they were, and are 0 at new labels."""
    at = f"level_{level}_"
    rows, columns = np.nonzero(arrays["instance_mask"])
    number = {place: i for i, place in enumerate(zip(rows.tolist(), columns.tolist(), strict=True))}
    neighbours = (((r - 1, c), (r, c + 1)) for r, c in number)
    earlier = [
        min(i, number[place]) for i, both in enumerate(neighbours) for place in both if place in number
    ]
    ends = np.cumsum(arrays[f"{at}ranges"][:, 1::2].astype(int).prod(axis=1))
    before, after = (
        np.split(np.unpackbits(packed, count=ends[-1]).astype(bool), ends[:-1])
        for packed in (arrays[f"{at}allowed"], np.packbits(bits))
    )
    steps, place = [np.zeros(0, np.int32)], 0
    for i in earlier:
        whole, count = np.zeros(before[i].shape, np.int32), before[i].sum()
        whole[before[i]] = np.cumsum(arrays[f"{at}share_steps"][place : place + count], dtype=np.int32)
        place += count
        steps.append(np.diff(whole[after[i]], prepend=np.int32(0)))
    return arrays | {f"{at}share_steps": np.concatenate(steps), f"{at}allowed": np.packbits(bits)}
