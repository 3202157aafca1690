"""The language that selects entries by their facts."""

import pytest
from crossfield.export.library.building.where import LONGEST, condition
from crossfield.models.errors import InputError
from loops import for_each

KINDS = {"name": str, "status": str, "pairs": int, "gap": float, "convex": bool}
FACTS = {"name": "cf_a", "status": "open", "pairs": 40, "gap": None, "convex": True}

TRUE = [
    "status == 'open' and pairs < 500",
    "pairs == 40.0",
    "10 < pairs <= 40",
    "not pairs > 40",
    "status in ('open', 'claimed')",
    "pairs not in [1, 2]",
    "convex",
    "convex == True",
    "gap == None",
    "not gap < 1",
    "gap != 0",
    "name >= 'cf' or pairs < -1",
    " pairs > 1 ",
]
FALSE = ["status != 'open'", "gap < 1", "gap > -1", "pairs < 1 or not convex", "status in ['a']", "gap == 0"]


@for_each("text, wanted", [(text, True) for text in TRUE] + [(text, False) for text in FALSE])
def test_an_expression_means_what_it_means_in_python_and_unknown_values_have_no_order(text, wanted):
    assert condition(text, KINDS)(FACTS) is wanted


BAD = {
    "nothing": ("", "is no expression"),
    "half": ("pairs <", "is no expression"),
    "statement": ("pairs = 3", "is no expression"),
    "nested": ("(" * 500 + "1" + ")" * 400, "is no expression"),
    "nul": ("pairs < 1\0", "is no expression"),
    "long": ("pairs < 1 " + " " * LONGEST, "has more than 1000 characters"),
    "unknown fact": ("pair < 5", "has the unknown fact 'pair' (is it pairs?)"),
    "builtin": ("__import__ == 'os'", "has the unknown fact '__import__'"),
    "call": ("__import__('os').system('true') == 0", "which is neither a fact nor a number or text"),
    "attribute": ("name.upper() == 'A'", "which is neither"),
    "subscript": ("name[0] == 'c'", "which is neither"),
    "sum": ("pairs + 1 < 3", "'pairs + 1', which is neither"),
    "power": ("9 ** 9 ** 9 < pairs", "which is neither"),
    "bytes": ("name == b'a'", "which is neither"),
    "walrus": ("(pairs := 3) > 1", "which is neither"),
    "text with number": ("pairs < 'many'", "compares pairs, a number, with 'many', a text,"),
    "truth with number": ("convex == 1", "compares convex, a truth value, with 1, a number,"),
    "a number alone": ("pairs", "has 'pairs' where a condition belongs"),
    "order of nothing": ("gap < None", "cannot compare gap with None in this way"),
    "identity": ("gap is None", "cannot compare gap with None in this way"),
    "in a text": ("status in 'open'", "has no list after `in`"),
    "type in a list": ("pairs in (1, 'a')", "compares pairs, a number, with 'a', a text,"),
}


@for_each("case", BAD)
def test_a_bad_expression_is_refused_with_the_allowed_facts(case):
    text, words = BAD[case]
    with pytest.raises(InputError) as error:
        condition(text, KINDS)
    assert words in str(error.value)
    assert "with these facts: name, status, pairs, gap, convex" in str(error.value)
