"""Archives of arrays (.npz): equal arrays give equal bytes, and a reader unpacks them within limits.

The reader accepts what `pack_arrays`, `numpy.savez` and `numpy.savez_compressed` write: each name once,
and arrays with the header that NumPy writes, of numbers that their caller expects. Sizes, kinds and shapes
are checked before the data is unpacked. There are no pickles.
"""

from __future__ import annotations

import io
import math
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

import numpy as np

from .errors import InstanceError, shortened
from .input_limits import MAX_ARCHIVE

Arrays = dict[str, np.ndarray[Any, Any]]

_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_LONG: Final = 1 << 20  # bytes of a member from which it is packed fast: five times as fast, and 5 % larger
_HEADER: Final = 128  # bytes of an array's header, for every array
_ARRAY: Final = re.compile(
    rb"\x93NUMPY\x01\x00\x76\x00\{'descr': '([ -&(-~]{1,20})', 'fortran_order': (False|True), "
    rb"'shape': \(((?:[0-9]{1,10}(?:,|(?:, [0-9]{1,10})+))?)\), \} *\n"
)
_ERRORS: Final = (
    zipfile.BadZipFile, zlib.error, RuntimeError, ValueError, OSError, EOFError, MemoryError,
)  # fmt: skip
_NUMBERS: Final = re.compile(r"\|(?:b1|[iu]1)|<(?:[iu][248]|f[248])")


class ExpectedArray(NamedTuple):
    """Limits of a member: number of dimensions, most entries along one, kinds of its numbers."""

    dimensions: int
    most: int
    kinds: str = "biuf"


def pack_arrays(arrays: Arrays) -> bytes:
    """The bytes of a compressed .npz: equal for equal arrays, which numpy.savez does not promise."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = io.BytesIO()
            little = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
            np.lib.format.write_array(entry, little, allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            data = entry.getvalue()
            archive.writestr(member, data, compresslevel=None if len(data) < _LONG else 1)
    return buffer.getvalue()


class ArrayArchive:
    """The members of an .npz in memory; each is unpacked on request. Raises InstanceError for other bytes."""

    def __init__(self, data: bytes) -> None:
        with _report_damage():
            self._archive = zipfile.ZipFile(io.BytesIO(data))
            members = self._archive.infolist()
            self._members = {member.filename.removesuffix(".npy"): member for member in members}
            if len(self._members) < len(members):
                raise zipfile.BadZipFile("it holds two arrays of one name")
            # Other methods unpack a few bytes to gigabytes at once.
            if any(member.compress_type not in _METHODS for member in members):
                raise zipfile.BadZipFile("it is packed in another way than NumPy packs")
        if sum(member.file_size for member in members) > MAX_ARCHIVE:
            raise InstanceError(f"is an .npz of more than {MAX_ARCHIVE >> 20} MiB when unpacked")
        self._unread = set(self._members)

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def arrays(self, expected: Mapping[str, ExpectedArray], prefix: str = "") -> Arrays:
        """The expected arrays by name, without the prefix. Raises InstanceError for any other array."""
        return {name: self._array(prefix + name, name, limits) for name, limits in expected.items()}

    def finish(self) -> None:
        """Raise InstanceError if the archive holds an array that was never requested."""
        if self._unread:
            raise InstanceError(
                f"holds an array {shortened(min(self._unread))!r} that does not belong in it; write it again"
            )

    def _array(self, key: str, name: str, expected: ExpectedArray) -> np.ndarray[Any, Any]:
        if key not in self._members:
            raise InstanceError(f"holds no array {name!r}; expected a file written by crossfield")
        self._unread.discard(key)
        with _report_damage(), self._archive.open(self._members[key]) as stream:
            kind, shape = _parse_header(stream.read(_HEADER), name, expected)
            length = math.prod(shape) * kind.itemsize
            if length + _HEADER != self._members[key].file_size:
                raise zipfile.BadZipFile(f"array {name!r} has another length than its header states")
            content = stream.read(length + 1)  # one byte more, so that the end and the checksum are looked at
            array = np.frombuffer(content, dtype=kind).reshape(shape)
        # NumPy takes the bytes of bits unchanged, and counts and inverts values other than 0 and 1 wrongly.
        if kind.kind == "b" and (array.view(np.uint8) > 1).any():
            raise _damage_error(f"array {name!r} has bits beyond 1")
        return array


@contextmanager
def _report_damage() -> Iterator[None]:
    """Raise InstanceError for everything that zipfile and NumPy raise for bytes of another kind."""
    try:
        yield
    except InstanceError:
        raise
    except _ERRORS as error:
        raise _damage_error(error) from error


def _damage_error(reason: object) -> InstanceError:
    return InstanceError(f"is a damaged or unsafe .npz: {shortened(reason)}; write it again")


def _parse_header(head: bytes, name: str, expected: ExpectedArray) -> tuple[np.dtype[Any], tuple[int, ...]]:
    """The kind and shape in the header of an array. Raises InstanceError unless they are expected."""
    header = _ARRAY.fullmatch(head)
    if header is None:
        raise _damage_error(f"array {name!r} has no header as NumPy writes it")
    kind, by_columns, sides = header[1].decode(), header[2] == b"True", header[3].decode()
    if "O" in kind:
        raise _damage_error(f"array {name!r} is pickled")
    if not _NUMBERS.fullmatch(kind) or np.dtype(kind).kind not in expected.kinds:
        raise InstanceError(
            f"array {name!r} holds {kind}, not numbers of the kind that belongs there; write it again"
        )
    shape = tuple(int(side) for side in sides.split(",") if side)
    if len(shape) != expected.dimensions or max(shape) > expected.most:
        raise InstanceError(
            f"array {name!r} has shape {shortened(shape)}; "
            f"expected {expected.dimensions} dimensions of at most {expected.most} entries"
        )
    if by_columns:
        raise InstanceError(f"array {name!r} is stored by columns; write it with numpy.ascontiguousarray")
    return np.dtype(kind), shape
