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
from .grades import SAME
from .points import CheckedCertificate, KnownField, certificate_file, check_certificate

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
            return KnownField.of(field_of_json(self.files[facts["file"]]), facts)

    def certificates(self, instance: Instance, norms: Collection[Norm]) -> list[CheckedCertificate]:
        """Return the certificates in some norms, checked.

        Raises InputError if one is invalid or contradicts the document.
        """
        stated = self.about.get("certificates", {})
        return [self._certificate(instance, norm, stated[str(norm)]) for norm in norms if str(norm) in stated]

    def _certificate(self, instance: Instance, norm: Norm, stated: dict[str, Any]) -> CheckedCertificate:
        facts = dict(stated)
        name, energy = facts.pop("file"), facts["energy"]
        certificate = check_certificate(self.files[name], name, instance)
        proven = certificate.facts | {"energy": energy}  # processors round energies differently
        if (certificate.norm, proven) != (norm, facts) or not math.isclose(
            energy, certificate.facts["energy"], rel_tol=SAME, abs_tol=SAME
        ):
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
    points = _points_of(path.parent, about)
    facts = [about["name"], about["instance"]["sha256"], about["fields"], about.get("certificates")]
    contents = {name: hashlib.sha256(data).hexdigest() for name, data in points.files.items()}
    return replace(points, sha256=digest([*facts, contents]))


def points_of(library: Library, *, strict: bool) -> PointSource:
    """Return the fields and certificates of a library, found or given.

    strict: whether damaged ones raise InputError; otherwise they are passed over.
    """

    def of(instance: str) -> InstancePoints | None:
        if instance in library.skipped:
            return None
        try:
            return _points_of(library.folder, read_about(library.folder / about_file(instance)))
        except CrossfieldError:
            if strict:
                raise
            return None

    return of


def _points_of(folder: Path, about: dict[str, Any]) -> InstancePoints:
    """Return the results of a document and its files, under the digest that it states. Raises InputError."""
    names = files_of_instance(about)[1:]  # without the instance, which is made again
    return InstancePoints(about, {name: read_bytes(folder / name) for name in names}, about.get("given"))
