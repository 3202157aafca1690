"""Given points of a specification: results for its instances, found once and kept.

A folder holds the same files per instance as a library, or is one: INSTANCE.about.json, and the fields and
the certificate that it lists. A build with them does not search, so its bytes do not depend on the processor.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from ....models.errors import CrossfieldError, InputError, naming
from ....models.field.field import Norm
from ....models.field.file import field_of_json
from ....models.instance.instance import Instance
from ....models.storage import read_bytes
from ..documents.documents import Library, about_file, existing_folder, files_of_instance, read_about
from ..plan.recipe import digest
from .points import (
    METHOD,
    CheckedCertificate,
    KnownField,
    Provenance,
    certificate_file,
    check_certificate,
    provenance_by,
)

ROLES: Final = ("baseline", "least_mixed", "least_1", "least_2")
_SAME: Final = 1e-9  # processors round energies differently
_REMEDY: Final = "make the points again with `crossfield library build --search`"


@dataclass(frozen=True)
class InstancePoints:
    """Results for an instance: its document, and its fields and certificates by file.

    sha256: digest of all; None for results of a search, which are no input of a build.
    """

    about: dict[str, Any]
    files: dict[str, bytes]
    sha256: str | None

    @property
    def instance(self) -> str:
        """The SHA-256 of the instance."""
        return str(self.about["instance"]["sha256"])

    def field(self, role: str) -> KnownField:
        """Return the field of a role in ROLES. Raises InstanceError for a damaged field."""
        facts = self.about["fields"][role]
        with naming(facts["file"]):
            return KnownField(field_of_json(self.files[facts["file"]]), Provenance.of(facts))

    def certificates(self, instance: Instance, norms: Collection[Norm]) -> list[CheckedCertificate]:
        """Return the certificates in some norms, checked.

        Raises InputError if one is invalid or contradicts the document.
        """
        stated = self.about.get("certificates", {})
        return [self._certificate(instance, norm, stated[str(norm)]) for norm in norms if str(norm) in stated]

    def _certificate(self, instance: Instance, norm: Norm, stated: dict[str, Any]) -> CheckedCertificate:
        facts = dict(stated)
        name = facts.pop("file")
        certificate = check_certificate(self.files[name], name, instance, provenance_by(METHOD))
        proven = certificate.facts
        is_same = (norm, facts["status"], facts["bound"]) == (
            certificate.norm, proven["status"], proven["bound"],
        )  # fmt: skip
        if not is_same or not math.isclose(facts["energy"], proven["energy"], rel_tol=_SAME, abs_tol=_SAME):
            reason = f"states another norm, status, bound or energy than {name}; {_REMEDY}"
            raise InputError(reason, file=about_file(self.about["name"]))
        return replace(certificate, file=certificate_file(self.about["name"], norm), facts=facts)


PointSource = Callable[[str], InstancePoints | None]  # results by the name of an instance
NO_POINTS: Final[PointSource] = dict[str, InstancePoints]().get


def read_points(path: str | Path) -> PointSource:
    """Read the points in a folder. Raises InputError, InstanceError for a damaged file."""
    documents = sorted(existing_folder(path).glob("*.about.json"))
    return {str(points.about["name"]): points for points in map(read_instance_points, documents)}.get


def read_instance_points(path: Path) -> InstancePoints:
    """Read the results whose document is a file. Raises InputError, InstanceError for a damaged file."""
    about = read_about(path)
    name = about_file(about["name"])
    if path.name != name:
        raise InputError(f"is about {about['name']}; its name must be {name}", file=path)
    points = _points_of(path.parent, about)
    facts = [about["name"], about["instance"]["sha256"], about["fields"], about.get("certificates")]
    contents = {name: hashlib.sha256(data).hexdigest() for name, data in points.files.items()}
    return replace(points, sha256=digest([*facts, contents]))


def given_points_of(folder: Path) -> PointSource:
    """Return the given points of a library as it holds them."""

    def of(instance: str) -> InstancePoints | None:
        try:
            about = read_about(folder / about_file(instance))
            return _points_of(folder, about) if "given" in about else None
        except CrossfieldError:  # to be made again
            return None

    return of


def all_points_of(library: Library) -> PointSource:
    """Return the fields and certificates of a library, found or given. Its calls raise InputError."""

    def of(instance: str) -> InstancePoints | None:
        if instance in library.skipped:
            return None
        return _points_of(library.folder, read_about(library.folder / about_file(instance)))

    return of


def _points_of(folder: Path, about: dict[str, Any]) -> InstancePoints:
    """Return the results of a document and its files, under the digest that it states. Raises InputError."""
    names = files_of_instance(about)[1:]  # without the instance, which is made again
    return InstancePoints(about, {name: read_bytes(folder / name) for name in names}, about.get("given"))
