"""Archives of arrays in which different programs find different things, or that cost more than their size."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable

import numpy as np


def members_of(archive: bytes) -> dict[str, bytes]:
    """The contents of the members of a .zip, by name."""
    with zipfile.ZipFile(io.BytesIO(archive)) as held:
        return {name: held.read(name) for name in held.namelist()}


def pack_arrays(arrays: dict[str, np.ndarray]) -> bytes:
    """The bytes of an .npz."""
    return packed([(f"{name}.npy", npy(array)) for name, array in arrays.items()])


def packed(members: list[tuple[str, bytes]], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A .zip of names and contents; names may be there twice."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in members:
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            archive.writestr(entry, content, method)
    return buffer.getvalue()


def npy(array: np.ndarray, version: tuple[int, int] = (1, 0), *, allow_pickle: bool = False) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array, version, allow_pickle=allow_pickle)
    return stream.getvalue()


def array_of(content: bytes) -> np.ndarray:
    return np.lib.format.read_array(io.BytesIO(content))


class Unpickled:
    """Ends the program when it is unpickled."""

    def __reduce__(self):
        return exec, ("raise SystemExit('unpickled')",)


def renamed_in_directory(archive: bytes, name: str, other: str) -> bytes:
    at = archive.rindex(name.encode())
    return archive[:at] + other.encode() + archive[at + len(name) :]


def flagged(archive: bytes, bit: int) -> bytes:
    """The archive with a flag at its first member, there and in the directory."""
    data, start = bytearray(archive), struct.unpack("<L", archive[-6:-2])[0]
    data[6] |= bit
    data[start + 8] |= bit
    return bytes(data)


def with_member(name: str, change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """A function that changes the content of the member of that name."""

    def of(archive: bytes) -> bytes:
        return packed(
            [(key, change(held) if key == name else held) for key, held in members_of(archive).items()]
        )

    return of


def with_header(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    """A function that replaces a part of an array's header and keeps its length."""

    def of(content: bytes) -> bytes:
        header = content[:127].replace(old, new, 1)
        assert header != content[:127]
        header = header.rstrip(b" ")
        assert len(header) <= 127
        return header.ljust(127) + content[127:]

    return of


def headed(header: bytes) -> Callable[[bytes], bytes]:
    """A function that replaces the header of an array."""
    return lambda content: content[:8] + struct.pack("<H", len(header) + 1) + header + b"\n" + content[128:]


def overstated(archive: bytes) -> bytes:
    """The archive whose first member is larger, by its header and its directory entry, than it is."""
    data, start = bytearray(archive), struct.unpack("<L", archive[-6:-2])[0]
    length = struct.unpack_from("<L", data, 22)[0] + 8
    struct.pack_into("<L", data, 22, length)
    struct.pack_into("<L", data, start + 24, length)
    return bytes(data)


def with_checksum(archive: bytes) -> bytes:
    data, start = bytearray(archive), struct.unpack("<L", archive[-6:-2])[0]
    data[14] ^= 1
    data[start + 16] ^= 1
    return bytes(data)


def forged(name: str) -> dict[str, Callable[[bytes], bytes]]:
    """Changes of an .npz that no strict reader accepts; name: of a member with an array of doubles in it."""
    member = f"{name}.npy"

    def another(second: str) -> Callable[[bytes], bytes]:
        spare = b"y" * len(second.encode())  # zipfile warns of a name that is there twice

        def of(archive: bytes) -> bytes:
            held = members_of(archive)
            return packed([*held.items(), (spare.decode(), held[member])]).replace(spare, second.encode())

        return of

    def changed(change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
        return with_member(member, change)

    return {
        "a member twice": another(member),
        "a name in other case": another(f"{name}.NPY"),
        "a name in upper case": another(member.upper()),
        "another ending": another(f"{name}.bin"),
        "a member more": another("more.npy"),
        "a folder": another("folder/"),
        "a name in a folder": another(f"./{member}"),
        "a name that is not ASCII": another("alph\xe4.npy"),
        "a name with a NUL": another(f"{member}\0.npy"),
        "other names in the directory": lambda archive: renamed_in_directory(archive, "head", "HEAD"),
        "an encrypted member": lambda archive: flagged(archive, 1),
        "bzip2": lambda archive: packed([*members_of(archive).items()], zipfile.ZIP_BZIP2),
        "LZMA": lambda archive: packed([*members_of(archive).items()], zipfile.ZIP_LZMA),
        "a larger member than there is": overstated,
        "another checksum": with_checksum,
        "a cut archive": lambda archive: archive[:-1],
        "a cut array": changed(lambda content: content[:-1]),
        "a longer array": changed(lambda content: content + b"\0"),
        "big-endian": changed(lambda content: npy(array_of(content).astype(">f8"))),
        "long double": changed(with_header(b"<f8", b"<f16")),
        "no dimension": changed(lambda content: npy(array_of(content)[0])),
        "by columns": changed(with_header(b"False", b"True")),
        "objects": changed(lambda _: npy(np.array([Unpickled()]), allow_pickle=True)),
        "fields": changed(lambda content: npy(array_of(content).view([("a", "<f8")]))),
        "texts": changed(lambda content: npy(array_of(content).astype("U"))),
        "version 2": changed(lambda content: npy(array_of(content), (2, 0))),
        "a header with a key twice": changed(with_header(b"{", b"{'descr': '<f4', ")),
        "a header with a negative side": changed(with_header(b"(", b"(-1, -")),
        "a header with an enormous side": changed(with_header(b"(", b"(99999999")),
        "a header that is an expression": changed(with_header(b"(", b"(1*")),
        "an escape that Python does not know": changed(with_header(b"<f8", b"\\d")),
        "a number that runs into a word": changed(with_header(b"False", b"0or 1")),
        "a long integer of Python 2": changed(with_header(b",)", b"L,)")),
        "the old name of a kind": changed(with_header(b"<f8", b"a8")),
        "a header of many sides": changed(headed(b"{'shape': (" + 5000 * b"3, " + b"), }")),
        "no header": changed(headed(b"")),
        "control characters": changed(headed(b"{'descr': '" + 300 * b"\x1b[31m\x07" + b"'}")),
        "bits beyond 1": bits_beyond_1,
    }  # fmt: skip


def bits_beyond_1(archive: bytes) -> bytes:
    """The archive with a bit of its mask that is stored as 2."""
    name = next(name for name in members_of(archive) if name.endswith("mask.npy"))
    return with_member(name, lambda content: content[:-1] + b"\2")(archive)


def of_numpy(archive: bytes, save: Callable[..., None]) -> bytes:
    """The same arrays as `numpy.savez` or `numpy.savez_compressed` writes them."""
    buffer = io.BytesIO()
    save(buffer, **{name.removesuffix(".npy"): array_of(data) for name, data in members_of(archive).items()})
    return buffer.getvalue()
