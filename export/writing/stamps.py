"""The stamp of a problem (`Problem.stamp`) in the files of crossfield, and where answers repeat it.

    file            place                                        repeated by
    LP, MPS, OSiL,  a column ONE_1a2b3c4d5e6 that is fixed to 1  every solution file with names
    .bar
    LP              the objective obj_sha256_1a2b3c4d5e6         Gurobi .sol, GLPK
    MPS             the name of the model                        GLPK, Xpress .slx
    .nl             the fourth option of the first line          .sol files of the AMPL Solver Library
    GAMS            a line `problem,sha256_1a2b3c4d5e6`          the CSV of --RESULTS

An answer that repeats none of them may be of any problem with the same columns.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from ...models.errors import SolutionError

PREFIX: Final = "sha256_"

_IN_TEXT: Final = re.compile(rb"sha256_([0-9a-f]{11,64})(?![0-9a-z])")
_COLUMN: Final = re.compile(rb"(?:\b|\bt_)ONE_([0-9a-f]{11})\b", re.IGNORECASE)
_OPTION_DIGITS: Final = 7


def one_column_name(stamp: str) -> bytes:
    """Name of the column fixed to 1."""
    return stamp.replace(PREFIX, "ONE_").encode()


def is_one_column(name: str) -> bool:
    """Whether a column is the one fixed to 1."""
    return _COLUMN.fullmatch(name.encode()) is not None


def stamp_option(stamp: str) -> int:
    """The number of a stamp among the options of an .nl file: its first seven digits, below 2^28.

    Many readers of .sol files take more than four options for a tolerance that follows, so there is room for
    one number of 31 bits.
    """
    return int(stamp.removeprefix(PREFIX)[:_OPTION_DIGITS], 16)


def digits_of_option(number: int) -> frozenset[str]:
    """The digits that an option of a .sol states; none if it cannot be a stamp."""
    return frozenset({f"{number:0{_OPTION_DIGITS}x}"} if 0 <= number < 16**_OPTION_DIGITS else ())


def digits_in_text(text: bytes) -> frozenset[str]:
    """The digits of all stamps in a text."""
    return frozenset(place[1].decode() for place in _IN_TEXT.finditer(text))


def digits_in_columns(names: Iterable[bytes]) -> frozenset[str]:
    """The digits of the stamps in names of columns, in upper or lower case."""
    return frozenset(place[1].decode().lower() for place in filter(None, map(_COLUMN.search, names)))


def is_stated(stamp: str, stated: Iterable[str]) -> bool:
    """Whether an answer states a stamp, or the first digits of it."""
    stamp_digits = stamp.removeprefix(PREFIX)
    return any(stamp_digits.startswith(digits[: len(stamp_digits)]) for digits in stated)


def is_identified(stated: Iterable[str], stamp: str) -> bool:
    """Whether an answer that states these digits is of the problem with that stamp.

    False if it states none. Raises SolutionError if it states the digits of another problem.
    """
    foreign = next((digits for digits in sorted(stated) if not is_stated(stamp, [digits])), None)
    if foreign is not None:
        raise SolutionError(
            f"is of another problem: it states {foreign}, and this one is {stamp.removeprefix(PREFIX)}; "
            "instance, options or fixed jumps differ, give the manifest next to the solver's model"
        )
    return bool(list(stated))
