"""Rows that NumPy checks by a schema are those that jsonschema accepts one by one."""

import itertools
import math

import jsonschema
import pytest
from crossfield.models.documents import _all_obey

COMMON = [0, 1, -1, 3, 4.0, 0.5, 1e-9, -0.0, 10**6, True, None, "1", [1], {}]
RARE = [10**400, math.inf, -math.inf, math.nan]  # jsonschema decides on those that it may accept
NUMBERS = {
    "number": {"type": "number"},
    "place": {"type": "integer", "minimum": 0, "maximum": 3},
    "weight": {"type": "number", "exclusiveMinimum": 0, "maximum": 1},
    "jump or null": {"type": ["integer", "null"], "minimum": -1, "maximum": 1},
}
OTHERS = {"text": {"type": "string"}, "even": {"type": "number", "multipleOf": 2}}


@pytest.mark.parametrize("name", [*NUMBERS, *OTHERS])
def test_rows_that_are_checked_fast_obey_their_schema_and_no_others_do(name):
    rule = (NUMBERS | OTHERS)[name]
    table = {"type": "array", "minItems": 2, "maxItems": 2}
    for items in (rule, table | {"items": rule}, table | {"prefixItems": [rule, rule]}):
        accepts = jsonschema.Draft202012Validator(items).is_valid
        common = [*COMMON, [], *map(list, itertools.product(COMMON, repeat=2))]
        rare = [*RARE, *map(list, itertools.product(RARE, COMMON))]
        checked = [entry for entry in [*common, *rare] if _all_obey([entry], items)]
        assert all(map(accepts, checked))
        assert _all_obey(checked, items) or not checked
        if name in NUMBERS:
            assert [entry for entry in common if accepts(entry)] == [e for e in checked if e in common]
