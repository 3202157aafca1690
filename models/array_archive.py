"""Archives of arrays (.npz): equal arrays give equal bytes, and members are unpacked within limits.

Of an archive only the members that are asked for are read. The header of each comes first: what it promises
(kind, shape, bytes) is checked before the data is unpacked. No pickles.
"""

from __future__ import annotations

import io
import math
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, cast

import numpy as np

from .errors import InstanceError, shortened
from .input_limits import MAX_ARCHIVE

Arrays = dict[str, np.ndarray[Any, Any]]

_DAMAGE: Final = (
    ValueError,
    TypeError,
    KeyError,
    OSError,
    EOFError,
    RuntimeError,
    SyntaxError,
    MemoryError,
    OverflowError,
    Warning,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
_HEADERS: Final = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


@dataclass(frozen=True)
class Expected:
    """What a member may be: number of dimensions, most entries along one, kinds of its numbers."""

    dimensions: int
    most: int
    kinds: str = "biuf"


def pack_arrays(arrays: Arrays) -> bytes:
    """The bytes of a compressed .npz that depend on the arrays alone, not on the clock.

    numpy.savez_compressed gives steady bytes too, but promises neither them nor, up to numpy 2.1, a way to
    refuse pickles; its members are 20 bytes longer.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = io.BytesIO()
            np.lib.format.write_array(entry, np.ascontiguousarray(array), allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(member, entry.getvalue())
    return buffer.getvalue()


def unpack_arrays(
    data: bytes,
    expected: Mapping[str, Expected],
    prefix: str = "",
    retired: Mapping[str, str] = MappingProxyType({}),
) -> Arrays:
    """Return the expected arrays of an .npz, whose names there begin with a prefix.

    retired: names of arrays that an archive must not hold, each with the message of the error. Other members
    are not read.

    Raises InstanceError, naming the array, for one that is missing, of another kind or shape, pickled, or
    larger than it may be, and for a damaged archive.
    """
    try:
        with warnings.catch_warnings(action="error"), zipfile.ZipFile(io.BytesIO(data)) as archive:
            for name in retired:
                if f"{prefix}{name}.npy" in archive.namelist():
                    raise InstanceError(retired[name])
            members = {name: _member(archive, name, prefix) for name in expected}
            if sum(member.file_size for member in members.values()) > MAX_ARCHIVE:
                raise InstanceError(f"is an .npz of more than {MAX_ARCHIVE >> 20} MiB when unpacked")
            return {name: _array(archive, members[name], name, expected[name]) for name in expected}
    except _DAMAGE as error:
        raise InstanceError(f"is a damaged or unsafe .npz: {shortened(error)}; write it again") from error


def _member(archive: zipfile.ZipFile, name: str, prefix: str) -> zipfile.ZipInfo:
    try:
        return archive.getinfo(f"{prefix}{name}.npy")
    except KeyError as error:
        raise InstanceError(f"holds no array {name!r}; expected a file written by crossfield") from error


def _array(
    archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str, expected: Expected
) -> np.ndarray[Any, Any]:
    """The array of one member, whose header may not promise more than the member holds."""
    with archive.open(member) as stream:
        shape, fortran, kind = _HEADERS[np.lib.format.read_magic(stream)](stream)
        if kind.hasobject:
            raise ValueError(f"array {name!r} is pickled")
        if kind.kind not in expected.kinds:
            raise InstanceError(
                f"array {name!r} holds {shortened(kind)}, not numbers of the kind that belongs there; "
                "write it again"
            )
        if len(shape) != expected.dimensions or max(shape) > expected.most:
            raise InstanceError(
                f"array {name!r} has shape {shortened(shape)}; "
                f"expected {expected.dimensions} dimensions of at most {expected.most} entries"
            )
        length = math.prod(shape) * kind.itemsize
        if length != member.file_size - stream.tell():
            raise ValueError(f"array {name!r} has another length than its header says")
        content = stream.read(length)
        if stream.read(1):  # also has zipfile compare the checksum
            raise ValueError(f"array {name!r} has more than its header says")
    found = np.frombuffer(content, dtype=kind).reshape(shape, order="F" if fortran else "C")
    return cast("np.ndarray[Any, Any]", found)
