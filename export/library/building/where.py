"""A small language that selects entries by their facts: `status == 'open' and pairs < 500`.

It has comparisons, `in` with a list, `and`, `or`, `not`, names of facts, numbers, text, True, False and None.
Python parses an expression, and this module interprets it: nothing is evaluated as Python.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from typing import Any, Final

from ....models.errors import InputError, shortened

Facts = Mapping[str, Any]
Test = Callable[[Facts], bool]
Kinds = Mapping[str, type]
_Value = tuple[type, Callable[[Facts], Any]]
"""The type of a value, and a function that returns it from facts, or None if it is unknown."""

LONGEST: Final = 1000  # characters of an expression
_NOTHING: Final = type(None)
_ORDERS: Final[dict[type[ast.cmpop], Callable[[Any, Any], bool]]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_EQUALITIES: Final[dict[type[ast.cmpop], Callable[[Any, Any], bool]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


def condition(text: str, kinds: Kinds) -> Test:
    """Return a function that decides whether facts obey an expression.

    kinds: the type of each fact by its name. A comparison by order with an unknown value is false. Raises
    InputError with the allowed names.
    """
    if len(text) > LONGEST:
        raise _refusal(text, f"has more than {LONGEST} characters", kinds)
    try:
        tree = ast.parse(text.strip(), mode="eval")
        return _test(tree.body, kinds)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise _refusal(text, "is no expression", kinds) from error
    except InputError as error:
        raise _refusal(text, str(error), kinds) from error


def _refusal(text: str, why: str, kinds: Kinds) -> InputError:
    return InputError(
        f"the filter {shortened(text)!r} {why}; write one such as \"status == 'open' and pairs < 500\" "
        f"with these facts: {', '.join(kinds)}"
    )


def _test(node: ast.expr, kinds: Kinds) -> Test:
    match node:
        case ast.BoolOp(op=op, values=values):
            tests = [_test(each, kinds) for each in values]
            both = all if isinstance(op, ast.And) else any
            return lambda facts: both(test(facts) for test in tests)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            test = _test(operand, kinds)
            return lambda facts: not test(facts)
        case ast.Compare(left=left, ops=ops, comparators=others):
            ends = [left, *others]
            parts = [_comparison(*each, kinds) for each in zip(ends[:-1], ops, ends[1:], strict=True)]
            return lambda facts: all(part(facts) for part in parts)
    kind, value = _value(node, kinds)
    if kind is not bool:
        raise InputError(f"has {shortened(ast.unparse(node))!r} where a condition belongs")
    return lambda facts: bool(value(facts))


def _comparison(left: ast.expr, op: ast.cmpop, right: ast.expr, kinds: Kinds) -> Test:
    if isinstance(op, ast.In | ast.NotIn):
        if not isinstance(right, ast.Tuple | ast.List | ast.Set):
            raise InputError("has no list after `in`")
        tests = [_comparison(left, ast.Eq(), each, kinds) for each in right.elts]
        wanted = isinstance(op, ast.In)
        return lambda facts: any(test(facts) for test in tests) == wanted
    (kind, first), (other, second) = _value(left, kinds), _value(right, kinds)
    if _NOTHING not in {kind, other} and _group(kind) != _group(other):
        raise InputError(f"compares {_named(left, kind)} with {_named(right, other)}")
    if type(op) in _EQUALITIES:
        equal = _EQUALITIES[type(op)]
        return lambda facts: equal(first(facts), second(facts))
    if type(op) not in _ORDERS or _NOTHING in {kind, other}:
        raise InputError(f"cannot compare {ast.unparse(left)} with {ast.unparse(right)} in this way")
    order = _ORDERS[type(op)]

    def ordered(facts: Facts) -> bool:
        one, two = first(facts), second(facts)
        return one is not None and two is not None and order(one, two)

    return ordered


def _value(node: ast.expr, kinds: Kinds) -> _Value:
    match node:
        case ast.Name(id=name) if name in kinds:
            return kinds[name], operator.itemgetter(name)
        case ast.Name(id=name):
            near = get_close_matches(name, kinds, 1)
            raise InputError(f"has the unknown fact {name!r}{f' (is it {near[0]}?)' if near else ''}")
        case ast.Constant(value=value) if isinstance(value, str | int | float | None):
            return type(value), lambda _: value
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
            return type(number), lambda _: -number
    raise InputError(f"has {shortened(ast.unparse(node))!r}, which is neither a fact nor a number or text")


def _group(kind: type) -> type:
    """One type for all numbers; truth values are none."""
    return float if kind is int else kind


def _named(node: ast.expr, kind: type) -> str:
    words = {str: "a text", bool: "a truth value"}
    return f"{shortened(ast.unparse(node))}, {words.get(kind, 'a number')},"
