"""Given points of a specification: results for its instances, found once and kept.

A folder or an archive holds the same files per instance as a library: INSTANCE.about.json, and the fields
and the certificate that it lists. A build with them does not search, so that its bytes do not depend on the
processor. Results for another instance than the built one do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError
from ....models.field.file import field_of_json
from ....models.instance.instance import Instance
from ....models.storage import make_folder, read_bytes, write_bytes
from ..documents.documents import about_file, are_whole, folder_of, read_about, read_library
from ..plan.recipe import digest
from .certificates import METHOD, Certified, certified_by
from .points import Known, Provenance, ours

ROLES: Final = ("baseline", "least_1", "least_2")
_SAME: Final = 1e-9  # processors round energies differently


@dataclass(frozen=True)
class Given:
    """Results for an instance: its document, the listed files, a digest of both."""

    about: dict[str, Any]
    files: dict[str, bytes]
    sha256: str

    @property
    def instance(self) -> str:
        """The SHA-256 of the instance that it is about."""
        return str(self.about["instance"]["sha256"])

    def field(self, role: str) -> Known:
        """Return the field of a role of ROLES. Raises InstanceError for a damaged one."""
        facts = self.about["fields"][role]
        return Known(field_of_json(self.files[facts["file"]]), Provenance.of(facts))

    def certificate(self, instance: Instance) -> Certified | None:
        """Return the certificate, checked, if there is one.

        Raises InputError if the checker refuses it, if it is of another instance, or if the document states
        another status, bound or energy.
        """
        facts = dict(self.about.get("certificate", {}))
        if not facts:
            return None
        name = facts.pop("file")
        found = certified_by(self.files[name], name, instance, ours(METHOD))
        same = (facts["status"], facts["bound"]) == (found.facts["status"], found.facts["bound"])
        if not same or not math.isclose(facts["energy"], found.facts["energy"], rel_tol=_SAME, abs_tol=_SAME):
            raise InputError(
                f"{about_file(self.about['name'])} states another status, bound or energy than {name}; "
                "make the points again with `crossfield library points`"
            )
        return replace(found, file=f"{self.about['name']}.certificate.npz", facts=facts)


Points = Callable[[str], Given | None]
"""Results for the instance of a name, None without any."""


def nothing(_instance: str) -> None:
    """Return no results for any instance."""


def read_points(path: str | Path) -> Points:
    """Read the points in a folder. Raises InputError, InstanceError for a damaged file."""
    folder = folder_of(path)
    return dict(_named(folder, each) for each in sorted(folder.glob("*.about.json"))).get


def _named(folder: Path, path: Path) -> tuple[str, Given]:
    """The name of a document's instance and the results for it."""
    about = read_about(path)
    if path.name != about_file(about["name"]):
        raise InputError(f"is about {about['name']}; its name must be {about_file(about['name'])}", file=path)
    return about["name"], _given(folder, about)


def points_of(folder: Path) -> Points:
    """Return the points of a library that was built with given ones, which are at least as good."""

    def of(instance: str) -> Given | None:
        try:
            about = read_about(folder / about_file(instance))
            return _given(folder, about, about["given"]) if "given" in about else None
        except CrossfieldError:  # to be made again
            return None

    return of


def write_points(library: str | Path, folder: str | Path) -> int:
    """Write the points of a library to a folder and return the number of instances.

    Raises InputError where there is no library or a file is damaged, InstanceError, OutputError.
    """
    source = read_library(library).folder
    abouts = sorted(source.glob("*.about.json"))
    files = {each.name: read_bytes(each) for each in abouts}
    for each in abouts:
        files |= _given(source, read_about(each)).files
    target = make_folder(folder)
    for name, data in files.items():
        write_bytes(target / name, data)
    return len(abouts)


def _given(folder: Path, about: dict[str, Any], sha256: str | None = None) -> Given:
    """The results for an instance in a folder. Raises InputError for a missing or another file."""
    listed = [each for each in about["files"] if each["name"] != about["instance"]["file"]]
    if lost := [each["name"] for each in listed if not are_whole(folder, [each])]:
        raise InputError(
            f"{about_file(about['name'])} lists {lost[0]}, which is missing or another file; "
            "make the points again with `crossfield library points`",
            file=folder,
        )
    named = [*about["fields"].values(), *([about["certificate"]] if "certificate" in about else [])]
    if unlisted := {each["file"] for each in named} - {each["name"] for each in listed}:
        raise InputError(
            f"{about_file(about['name'])} names {min(unlisted)} and does not list it; "
            "make the points again with `crossfield library points`",
            file=folder,
        )
    facts = [about[key] for key in ("name", "fields")] + [about.get("certificate"), listed]
    files = {each["name"]: read_bytes(folder / each["name"]) for each in listed}
    return Given(about, files, sha256 or digest([about["instance"]["sha256"], *facts]))
