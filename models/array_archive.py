"""Archives of arrays (.npz): equal arrays give equal bytes, and one strict reader unpacks them within limits.

The reader accepts only what `pack_arrays`, `numpy.savez` and `numpy.savez_compressed` write, so that no other
program can find other arrays in the same file:

- The file consists of the members, the central directory and its end record, in this order, without other
  bytes before, between or after them. There are no comments, and no 64-bit end record.
- Each member is stored or deflated, and is not encrypted. Its header repeats the directory exactly; the
  64-bit sizes that NumPy adds are the only extra field.
- Names are ASCII, end in `.npy` and differ in more than case. Each array is one that its caller expects.
- An array has the format version 1.0, a header of 128 bytes as NumPy writes it, at least one dimension,
  little-endian numbers in the order of rows (C), and exactly the bytes that its header promises.

Sizes, kinds and shapes are checked before the data is unpacked. There are no pickles.
"""

from __future__ import annotations

import io
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from .errors import InstanceError, shortened
from .input_limits import MAX_ARCHIVE

Arrays = dict[str, np.ndarray[Any, Any]]

_END: Final = struct.Struct("<4s4H2LH")
_ENTRY: Final = struct.Struct("<4s6H3L5H2L")
_LOCAL: Final = struct.Struct("<4s5H3L2H")
_WIDE: Final = struct.Struct("<2H2Q")
_UNKNOWN: Final = 0xFFFFFFFF  # stands for a size that the extra field of 64-bit sizes holds
_LONG: Final = 1 << 20  # bytes of a member from which it is packed fast: five times as fast, and 5 % larger
_HEADER: Final = 128  # bytes of an array's header, for every array
_ARRAY: Final = re.compile(
    rb"\x93NUMPY\x01\x00\x76\x00\{'descr': '([ -&(-~]{1,20})', 'fortran_order': (False|True), "
    rb"'shape': \(((?:[0-9]{1,10}(?:,|(?:, [0-9]{1,10})+))?)\), \} *\n"
)
_NUMBERS: Final = re.compile(r"\|(?:b1|[iu]1)|<(?:[iu][248]|f[248])")


class _DamagedError(Exception):
    """A defect in the bytes of an archive."""


class Expected(NamedTuple):
    """Limits of a member: number of dimensions, most entries along one, kinds of its numbers."""

    dimensions: int
    most: int
    kinds: str = "biuf"


class _Member(NamedTuple):
    """Packing of a member, the number of its bytes once unpacked, and their checksum."""

    deflated: bool
    packed: memoryview
    length: int
    checksum: int


class Packing:
    """A compressed .npz in the making: equal arrays, added in equal order, give equal bytes.

    numpy.savez does not promise that.
    """

    def __init__(self) -> None:
        self._buffer = io.BytesIO()
        self._archive = zipfile.ZipFile(self._buffer, "w", zipfile.ZIP_DEFLATED)

    def add(self, arrays: Arrays) -> None:
        """Compress arrays and add them."""
        for name, array in arrays.items():
            entry = io.BytesIO()
            little = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
            np.lib.format.write_array(entry, little, allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            data = entry.getvalue()
            self._archive.writestr(member, data, compresslevel=None if len(data) < _LONG else 1)

    def finish(self) -> bytes:
        """The bytes of the archive."""
        self._archive.close()
        return self._buffer.getvalue()


def pack_arrays(arrays: Arrays) -> bytes:
    """The bytes of a compressed .npz of these arrays."""
    packing = Packing()
    packing.add(arrays)
    return packing.finish()


class ArrayArchive:
    """The members of an .npz in memory; each is unpacked on request. Raises InstanceError for other bytes."""

    def __init__(self, data: bytes) -> None:
        try:
            self._members = dict(_members(memoryview(data)))
        except (_DamagedError, struct.error) as error:
            raise _damaged(error) from error
        if sum(member.length for member in self._members.values()) > MAX_ARCHIVE:
            raise InstanceError(f"is an .npz of more than {MAX_ARCHIVE >> 20} MiB when unpacked")
        self._unread = set(self._members)

    def arrays(self, expected: Mapping[str, Expected], prefix: str = "") -> Arrays:
        """The expected arrays by name, without the prefix. Raises InstanceError for any other array."""
        return {name: self._array(prefix, name, kind) for name, kind in expected.items()}

    def finish(self) -> None:
        """Raise InstanceError if the archive holds an array that was never requested."""
        if self._unread:
            raise InstanceError(
                f"holds an array {shortened(min(self._unread))!r} that does not belong in it; write it again"
            )

    def _array(self, prefix: str, name: str, expected: Expected) -> np.ndarray[Any, Any]:
        member = self._members.get(prefix + name)
        if member is None:
            raise InstanceError(f"holds no array {name!r}; expected a file written by crossfield")
        self._unread.discard(prefix + name)
        try:
            return _array(member, name, expected)
        except (_DamagedError, zlib.error, MemoryError) as error:
            raise _damaged(error) from error


def _damaged(error: Exception) -> InstanceError:
    return InstanceError(f"is a damaged or unsafe .npz: {shortened(error)}; write it again")


def _need(holds: object, otherwise: str) -> None:
    """Raise _DamagedError unless the condition holds."""
    if not holds:
        raise _DamagedError(otherwise)


def _members(data: memoryview) -> Iterator[tuple[str, _Member]]:
    """The members in their order, by name without suffix."""
    end = len(data) - _END.size
    _need(end >= 0, "it is cut off")
    mark, *disks, here, count, size, begin, comment = _END.unpack(data[end:])
    _need(mark == b"PK\5\6" and not comment and not any(disks) and here == count, "its end is missing")
    _need(begin + size == end, "its directory does not end where the archive does")
    at, place, names = begin, 0, set[str]()
    for _ in range(count):
        entry = _ENTRY.unpack_from(data, at)
        name_length, extra, remark = entry[10:13]
        raw = bytes(data[at + _ENTRY.size : at + _ENTRY.size + name_length])
        name = raw.decode("ascii", "replace")
        _need(raw.isascii() and name.isprintable() and name.endswith(".npy"), f"it holds {name!r}, no .npy")
        _need(name.lower() not in names, f"it holds {name!r} twice")
        _need(entry[0] == b"PK\1\2" and not extra and not remark, f"the directory entry of {name!r} is wrong")
        names.add(name.lower())
        member, place = _member(data, place, entry, name)
        at += _ENTRY.size + name_length
        yield name.removesuffix(".npy"), member
    _need((at, place) == (end, begin), "its members do not fill it")


def _member(data: memoryview, place: int, entry: tuple[Any, ...], name: str) -> tuple[_Member, int]:
    """The member at a position, whose header must repeat its directory entry, and the next position."""
    version, flags, method, time, date, checksum, packed, length = entry[2:10]
    mark, *repeated, name_length, extra = _LOCAL.unpack_from(data, place)
    begin = place + _LOCAL.size + len(name)
    after = begin + extra
    if extra == _WIDE.size and repeated[-2:] in ([packed, length], [_UNKNOWN, _UNKNOWN]):
        _need(_WIDE.unpack(data[begin:after]) == (1, 16, length, packed), f"the sizes of {name!r} differ")
        repeated[-2:], extra = [packed, length], 0
    same = [version, flags, method, time, date, checksum, packed, length] == repeated
    _need(
        mark == b"PK\3\4" and same and not extra and entry[-1] == place and entry[13] == 0
        and name_length == len(name) and data[begin - len(name) : begin] == name.encode(),
        f"the header of {name!r} differs from its directory entry",
    )  # fmt: skip
    _need(
        not flags and method in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED),
        f"{name!r} is packed in another way than NumPy packs",
    )
    _need(method != zipfile.ZIP_STORED or packed == length, f"the sizes of {name!r} differ")
    content = data[after : after + packed]
    _need(len(content) == packed, "it is cut off")
    return _Member(method != zipfile.ZIP_STORED, content, length, checksum), after + packed


def _array(member: _Member, name: str, expected: Expected) -> np.ndarray[Any, Any]:
    """The array of a member, whose header is checked before the rest is unpacked."""
    unpacker = zlib.decompressobj(-zlib.MAX_WBITS)
    packed = member.packed
    head = unpacker.decompress(packed, _HEADER) if member.deflated else bytes(packed[:_HEADER])
    kind, shape = _described(head, name, expected)
    length = math.prod(shape) * kind.itemsize
    _need(length == member.length - _HEADER, f"array {name!r} has another length than its header states")
    if member.deflated:
        rest: bytes | memoryview = unpacker.decompress(unpacker.unconsumed_tail, length + 1)
        _need(unpacker.eof and not unpacker.unused_data, f"array {name!r} has more than its header states")
    else:
        rest = packed[_HEADER:]
    _need(len(rest) == length, f"array {name!r} has another length than its header states")
    _need(zlib.crc32(rest, zlib.crc32(head)) == member.checksum, f"array {name!r} has another checksum")
    found = np.frombuffer(rest, dtype=kind).reshape(shape)
    # NumPy takes the bytes of bits unchanged, and counts and inverts values other than 0 and 1 wrongly.
    _need(kind.kind != "b" or not (found.view(np.uint8) > 1).any(), f"array {name!r} has bits beyond 1")
    return found


def _described(head: bytes, name: str, expected: Expected) -> tuple[np.dtype[Any], tuple[int, ...]]:
    """The kind and shape in the header of an array. Raises InstanceError unless they are expected."""
    found = _ARRAY.fullmatch(head)
    if found is None:
        raise _DamagedError(f"array {name!r} has no header as NumPy writes it")
    kind, by_columns, sides = found[1].decode(), found[2] == b"True", found[3].decode()
    _need("O" not in kind, f"array {name!r} is pickled")
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
