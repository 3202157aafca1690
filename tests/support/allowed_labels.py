"""Certificates with other allowed labels, whose shares fit these."""

import json

import numpy as np
from crossfield.models.proof.check_certificate import STEP_PARTS

KINDS = {"steps_16": "<i2", "steps_32": "<i4", "steps_64": "<i8"}


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
        np.split(np.unpackbits(each, count=ends[-1]).astype(bool), ends[:-1])
        for each in (arrays[f"{at}allowed"], np.packbits(bits))
    )
    names = STEP_PARTS[json.loads(arrays["head"].tobytes())["norm"]]
    steps, wide = [], []
    places = dict.fromkeys(names, 0)
    for i, is_wide in zip(earlier, arrays[f"{at}wide"].tolist(), strict=True):
        name, count = names[is_wide], before[i].sum()
        whole = np.zeros(before[i].shape, np.int64)
        given = arrays[f"{at}{name}"][places[name] : places[name] + count]
        sums = np.cumsum(given, dtype=np.int64)
        whole[before[i]] = sums.astype(np.int32) if names[1] == "steps_32" else sums  # modulo 2^32
        places[name] += count
        steps.append(np.diff(whole[after[i]], prepend=0))
        wide.append(np.abs(steps[-1]).max(initial=0) > np.iinfo(KINDS[names[0]]).max)
    parts = {
        f"{at}{name}": np.concatenate(
            [np.zeros(0, int), *(each for each, large in zip(steps, wide, strict=True) if large == broad)]
        ).astype(KINDS[name])
        for broad, name in zip((False, True), names, strict=True)
    }
    return arrays | parts | {f"{at}wide": np.array(wide), f"{at}allowed": np.packbits(bits)}
