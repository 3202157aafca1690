"""Points that a specification brings: what is known of its instances, found once and kept.

A folder or an archive that holds of each instance what a library holds: INSTANCE.about.json, and the fields
and the certificate that it lists. A build with them searches for nothing, so that its bytes do not depend on
the processor. What is about another instance than the one that is built does not count.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError
from ....models.field.file import field_of_json
from ....models.storage import read_bytes, write_bytes
from ..documents.archive import opened
from ..documents.documents import about_file, are_whole, read_about, read_library
from ..plan.recipe import digest
from .points import Known, Provenance

ROLES: Final = ("baseline", "least_1", "least_2")
_DATE: Final = (1980, 1, 1, 0, 0, 0)  # of every member of an archive, so that its bytes follow from its files


@dataclass(frozen=True)
class Given:
    """What is known of an instance: its document, the files that this lists, a digest of both."""

    about: dict[str, Any]
    files: dict[str, bytes]
    sha256: str

    @property
    def instance(self) -> str:
        """The SHA-256 of the instance that it is about."""
        return str(self.about["instance"]["sha256"])

    def field(self, role: str) -> Known:
        """The field of a role of ROLES. Raises InstanceError for a damaged one."""
        facts = self.about["fields"][role]
        return Known(field_of_json(self.files[facts["file"]]), Provenance.of(facts))

    @property
    def certificate(self) -> tuple[bytes, dict[str, Any]] | None:
        """The bytes of the certificate, and what it says, where there is one."""
        facts = dict(self.about.get("certificate", {}))
        return (self.files[facts.pop("file")], facts) if facts else None


Points = Callable[[str], Given | None]
"""What is known of the instance of a name, None where nothing is."""


def nothing(_instance: str) -> None:
    """Nothing is known of any instance."""


def read_points(path: str | Path) -> Points:
    """The points in a folder or an archive. Raises InputError, InstanceError for a damaged one."""
    with opened(path) as folder:
        abouts = map(read_about, sorted(folder.glob("*.about.json")))
        known = {str(about["name"]): _given(folder, about) for about in abouts}
    return known.get


def points_of(folder: Path) -> Points:
    """The points of a library that was built with given ones: its own are at least as good."""

    def of(instance: str) -> Given | None:
        try:
            about = read_about(folder / about_file(instance))
            return _given(folder, about, about["given"]) if "given" in about else None
        except CrossfieldError:  # to be made again
            return None

    return of


def write_points(folder: str | Path, path: str | Path) -> int:
    """The number of instances of a library whose points are now in an archive (.zip).

    The same points give the same bytes. Raises InputError where there is no library or a file is damaged,
    InstanceError, OutputError.
    """
    folder = read_library(folder).folder
    abouts = sorted(folder.glob("*.about.json"))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_LZMA) as archive:
        for each in abouts:
            files = {each.name: read_bytes(each), **_given(folder, read_about(each)).files}
            for name, data in files.items():
                archive.writestr(zipfile.ZipInfo(name, _DATE), data, zipfile.ZIP_LZMA)
    write_bytes(Path(path), buffer.getvalue())
    return len(abouts)


def _given(folder: Path, about: dict[str, Any], sha256: str | None = None) -> Given:
    """What a folder holds of an instance. Raises InputError for a file that is missing or another one."""
    listed = [each for each in about["files"] if each["name"] != about["instance"]["file"]]
    if lost := [each["name"] for each in listed if not are_whole(folder, [each])]:
        raise InputError(
            f"{about_file(about['name'])} lists {lost[0]}, which is missing or another file; "
            "make the points again with `crossfield library points`",
            file=folder,
        )
    facts = [about[key] for key in ("name", "fields")] + [about.get("certificate"), listed]
    files = {each["name"]: read_bytes(folder / each["name"]) for each in listed}
    return Given(about, files, sha256 or digest([about["instance"]["sha256"], *facts]))
