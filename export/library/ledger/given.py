"""Given points of a specification: results for its instances, found once and kept.

A folder holds the same files per instance as a library, or is one: INSTANCE.about.json, and the fields and
the certificate that it lists. A build with them does not search, so its bytes do not depend on the processor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError
from ....models.field.field import Norm
from ....models.field.file import field_of_json
from ....models.instance.instance import Instance
from ....models.storage import read_bytes
from ..documents.documents import about_file, are_whole, folder_of, read_about
from ..plan.recipe import digest
from .points import METHOD, Certified, Known, Provenance, certificate_file, certified_by, ours

ROLES: Final = ("baseline", "least_mixed", "least_1", "least_2")
_SAME: Final = 1e-9  # processors round energies differently
_REMEDY: Final = "make the points again with `crossfield library build --search`"


@dataclass(frozen=True)
class Given:
    """Results for an instance: its document, the listed files, a digest of both."""

    about: dict[str, Any]
    files: dict[str, bytes]
    sha256: str

    @property
    def instance(self) -> str:
        """The SHA-256 of the instance."""
        return str(self.about["instance"]["sha256"])

    def field(self, role: str) -> Known:
        """Return the field of a role in ROLES. Raises InstanceError for a damaged field."""
        facts = self.about["fields"][role]
        return Known(field_of_json(self.files[facts["file"]]), Provenance.of(facts))

    def certificates(self, instance: Instance, norms: Collection[Norm]) -> list[Certified]:
        """Return the certificates in some norms, checked.

        Raises InputError if one is invalid or contradicts the document.
        """
        stated = self.about.get("certificates", {})
        return [self._certificate(instance, norm, stated[str(norm)]) for norm in norms if str(norm) in stated]

    def _certificate(self, instance: Instance, norm: Norm, stated: dict[str, Any]) -> Certified:
        facts = dict(stated)
        name = facts.pop("file")
        found = certified_by(self.files[name], name, instance, ours(METHOD))
        same = (norm, facts["status"], facts["bound"]) == (
            found.norm, found.facts["status"], found.facts["bound"],
        )  # fmt: skip
        if not same or not math.isclose(facts["energy"], found.facts["energy"], rel_tol=_SAME, abs_tol=_SAME):
            what = f"states another norm, status, bound or energy than {name}; {_REMEDY}"
            raise InputError(what, file=about_file(self.about["name"]))
        return replace(found, file=certificate_file(self.about["name"], norm), facts=facts)


Points = Callable[[str], Given | None]  # results by the name of an instance
NO_POINTS: Final[Points] = dict[str, Given]().get


def read_points(path: str | Path) -> Points:
    """Read the points in a folder. Raises InputError, InstanceError for a damaged file."""
    given = map(read_point, sorted(folder_of(path).glob("*.about.json")))
    return {str(each.about["name"]): each for each in given}.get


def read_point(path: Path) -> Given:
    """Read the results whose document is a file. Raises InputError, InstanceError for a damaged file."""
    about = read_about(path)
    name = about_file(about["name"])
    if path.name != name:
        raise InputError(f"is about {about['name']}; its name must be {name}", file=path)
    return given_of(path.parent, about)


def points_of(folder: Path) -> Points:
    """Return the given points of a library as it holds them."""

    def of(instance: str) -> Given | None:
        try:
            about = read_about(folder / about_file(instance))
            return given_of(folder, about, about["given"]) if "given" in about else None
        except CrossfieldError:  # to be made again
            return None

    return of


def given_of(folder: Path, about: dict[str, Any], sha256: str | None = None) -> Given:
    """Return the results of a document and its files. Raises InputError for a missing or different file."""
    path = folder / about_file(about["name"])
    listed = [each for each in about["files"] if each["name"] != about["instance"]["file"]]
    if lost := [each["name"] for each in listed if not are_whole(folder, [each])]:
        raise InputError(f"lists {lost[0]}, which is missing or another file; {_REMEDY}", file=path)
    named = [*about["fields"].values(), *about.get("certificates", {}).values()]
    if unlisted := {each["file"] for each in named} - {each["name"] for each in listed}:
        raise InputError(f"names {min(unlisted)} and does not list it; {_REMEDY}", file=path)
    facts = [about[key] for key in ("name", "fields")] + [about.get("certificates"), listed]
    files = {each["name"]: read_bytes(folder / each["name"]) for each in listed}
    return Given(about, files, sha256 or digest([about["instance"]["sha256"], *facts]))
