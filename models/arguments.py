"""Checks of arguments whose wrong values would go unnoticed, with errors that name the argument.

Other values of a wrong type fail where they are used, with Python's own errors.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from .errors import CrossfieldError, InputError, InstanceError, shortened

_ErrorClass = type[CrossfieldError]


def check_flag(name: str, value: object, error: _ErrorClass = InputError) -> None:
    """Raise the error, which names the argument, unless it is True or False: a text such as "no" is true."""
    if not isinstance(value, (bool, np.bool_)):
        raise error(f"{name} is {value!r}; give True or False")


def check_choice(
    kind: str, value: object, known: Collection[str], error: _ErrorClass = InputError, *, place: str = ""
) -> None:
    """Raise the error, which lists the known names, unless the value is one of them.

    kind: what is named, in singular. place: of the value in a file, before the message.
    """
    if not isinstance(value, str) or value not in known:
        words = f"there is no {kind} {shortened(repr(value))}; choose one of {', '.join(known)}"
        raise error(f"{place}: {words}" if place else words)


def check_count(name: str, value: int, least: int = 0) -> None:
    """Raise InputError that names the argument unless it is a whole number of at least `least`."""
    if not (value >= least and value % 1 == 0):
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
        kind = array.dtype.kind
        if kind in "biuf" or (kind == "O" and None not in array.ravel().tolist()):  # None would become nan
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise error(f"{name} holds something other than numbers; give an array of numbers")


def whole_numbers(
    values: Any, name: str, error: _ErrorClass = InstanceError
) -> np.ndarray[Any, np.dtype[np.int32]]:
    """The values as a new array of int32. Raises the error, with their name, for other numbers."""
    if getattr(values, "dtype", None) == np.int32:
        return np.array(values, np.int32)
    array = float_array(values, name, error)
    if not ((array >= -(2**31)) & (array < 2**31)).all() or (array != np.floor(array)).any():
        raise error(f"{name} holds something other than whole numbers of 32 bits")
    return array.astype(np.int32)


def boolean_array(values: Any) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """The values as booleans. Raises InstanceError unless they are True and False, or 1 and 0."""
    booleans = isinstance(values, np.ndarray) and values.dtype.kind == "b"
    array = values if booleans else float_array(values, "mask", InstanceError)
    mask = np.asarray(array != 0)
    if (array != mask).any():
        raise InstanceError("mask holds something other than True and False")
    return mask
