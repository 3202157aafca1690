"""Checks of the arguments of public functions against their annotations, with errors that name the argument.

Ranges are checked by the functions themselves.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import wraps
from numbers import Integral, Real
from typing import Any, Final, ParamSpec, TypeVar

import numpy as np

from .errors import CrossfieldError, InputError, InstanceError, shortened

_P = ParamSpec("_P")
_Result = TypeVar("_Result")
_ErrorClass = type[CrossfieldError]

_BOOLEAN: Final = (bool, np.bool_)
_KINDS: Final[dict[str, tuple[str, Callable[[Any], bool]]]] = {
    "None": ("None", lambda value: value is None),
    "bool": ("True or False", lambda value: isinstance(value, _BOOLEAN)),
    "int": ("a whole number", lambda value: isinstance(value, Integral) and not isinstance(value, _BOOLEAN)),
    "float": ("a number", lambda value: isinstance(value, Real) and not isinstance(value, _BOOLEAN)),
    "str": ("text", lambda value: isinstance(value, str)),
    "Path": ("a path", lambda value: isinstance(value, os.PathLike)),
    "Progress": ("a function that receives a line of text", callable),
}
"""Kinds of arguments by their annotation: words for an error, and whether a value is of the kind."""

_CLASSES: Final = frozenset({
    "CrossField", "Hint", "Instance", "Light", "Limits", "OrthogonalProof", "Problem", "Proof", "Surface",
    "Underlay", "Windows",
})  # fmt: skip
"""Classes of the package, known by their names, because this module can import none of them."""


def check_arguments(function: Callable[_P, _Result]) -> Callable[_P, _Result]:
    """The function, which raises InputError for an argument of another kind than its annotation names."""
    signature = inspect.signature(function)

    @wraps(function)
    def checked(*args: _P.args, **kwargs: _P.kwargs) -> _Result:
        try:
            bound = signature.bind(*args, **kwargs).arguments
        except TypeError:  # the call below raises it, with the name of the function
            bound = {}
        for name, value in bound.items():
            check_kind(name, value, str(signature.parameters[name].annotation))
        return function(*args, **kwargs)

    return checked


def check_fields(item: Any, error: _ErrorClass = InputError) -> None:
    """Raise the error for a field of a dataclass that is of another kind than its annotation names."""
    for field_ in fields(item):
        check_kind(field_.name, getattr(item, field_.name), str(field_.type), error)


def check_kind(name: str, value: Any, annotation: str, error: _ErrorClass = InputError) -> None:
    """Raise the error that names the argument unless the value is of one of the kinds of its annotation.

    Kinds that this module does not know are checked by whoever uses them.
    """
    kinds = [_kind(part) for part in annotation.split(" | ")]
    if any(fits(value) for _, fits in kinds):
        return
    raise error(f"{name} is {_quoted_value(value)}; give {' or '.join(words for words, _ in kinds)}")


def check_count(name: str, value: int, least: int = 0) -> None:
    """Raise InputError that names the argument unless it is at least `least`."""
    if value < least:
        raise InputError(f"{name} is {value}; give a whole number of at least {least}")


def check_positive(name: str, value: float) -> None:
    """Raise InputError that names the argument unless it is positive and finite."""
    if not 0 < value < np.inf:
        raise InputError(f"{name} is {value}; give a number above 0")


def float_array(
    values: Any, name: str, error: _ErrorClass = InputError
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The values as a new array of float64. Raises the error, which names them, unless they are real."""
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biufO":
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise error(f"{name} holds something other than numbers; give an array of numbers")


def whole_numbers(
    values: Any, name: str, error: _ErrorClass = InstanceError
) -> np.ndarray[Any, np.dtype[np.int32]]:
    """The values as a new array of int32. Raises the error, with their name, for other numbers."""
    array = values if getattr(values, "dtype", None) == np.int32 else float_array(values, name, error)
    if not ((array >= -(2**31)) & (array < 2**31)).all() or (array != np.floor(array)).any():
        raise error(f"{name} holds something other than whole numbers of 32 bits")
    return array.astype(np.int32)


def _kind(annotation: str) -> tuple[str, Callable[[Any], bool]]:
    """Words for the kind of an annotation, and whether a value is of it; any value for unknown ones."""
    if annotation in _KINDS:
        return _KINDS[annotation]
    if annotation in _CLASSES:
        return _with_article(
            annotation
        ), lambda value: annotation in {base.__name__ for base in type(value).mro()}
    outer, _, inner = annotation.removesuffix("]").partition("[")
    if outer in {"dict", "Mapping"}:
        return "a dictionary", lambda value: isinstance(value, Mapping)
    if outer == "Iterable":
        words, fits = _kind(inner)
        return f"a list of {words.split()[-1]}s", lambda value: _is_list(value, fits)
    return annotation, lambda _: True


def _is_list(value: Any, fits: Callable[[Any], bool]) -> bool:
    """Whether a value is iterable and no text, and its items fit where they can be read twice."""
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        return False
    return not isinstance(value, Sequence) or all(map(fits, value))


def _quoted_value(value: Any) -> str:
    if value is None or isinstance(value, (str, Real, list, tuple, *_BOOLEAN)):
        return shortened(repr(value), 40)
    return _with_article(type(value).__name__)


def _with_article(kind: str) -> str:
    return f"{'an' if kind[0] in 'AEIOUaeiou' else 'a'} {kind}"
