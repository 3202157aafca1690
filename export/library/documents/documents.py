"""JSON documents of a library: a sidecar per entry, a document per instance, and the index.

Their schemas are the files library-*.schema.json in this folder.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from ....models.documents import read_document
from ....models.errors import CrossfieldError, InputError
from ....models.formulations.problem import Problem
from ....models.formulations.windows import Windows
from ....models.instance.instance import Instance
from ....models.proof.certificate import read_certificate
from ....models.proof.descent.record import Claim
from ....models.proof.tightening import remaining_windows
from ....models.storage import read_bytes
from ...bundle.manifest import ENTRY_FORMAT, described_problem
from ..plan.spec import Spec, spec_of

INDEX_FORMAT: Final = "crossfield-library"
ABOUT_FORMAT: Final = "crossfield-library-instance"
VERSION: Final = 1
INDEX: Final = "library.json"


@dataclass(frozen=True, eq=False)
class Library:
    """A built library: its folder and its checked index.

    failed: the errors of instances and entries that its build could not make, by name. notices: of the build.
    """

    folder: Path
    document: dict[str, Any]
    failed: Mapping[str, CrossfieldError] = field(default_factory=dict)
    notices: Sequence[str] = ()

    @cached_property
    def entries(self) -> tuple[dict[str, Any], ...]:
        """The sidecars of all entries. Raises as `read_sidecar`."""
        return tuple(map(self.entry, self.document["entries"]))

    def entry(self, name: str) -> dict[str, Any]:
        """Read the sidecar of an entry. Raises InputError for a name that the library does not have."""
        if name not in self.document["entries"]:
            near = get_close_matches(name, self.document["entries"], 1)
            asked = f" (is it {near[0]}?)" if near else ""
            raise InputError(f"has no entry {name[:60]!r}{asked}; library.json lists them", file=self.folder)
        return read_sidecar(self.folder / f"{name}.json")

    @property
    def skipped(self) -> dict[str, str]:
        """Names of instances and entries that the specification asks for and the library lacks, and why."""
        return dict(self.document.get("skipped", {}))

    @property
    def spec(self) -> Spec:
        """Its specification, with the drawings in the library."""
        return spec_of(self.document["spec"], self.folder / INDEX)


def existing_folder(path: str | Path) -> Path:
    """Return the path of a folder. Raises InputError for a file, such as a release, or a missing folder."""
    if Path(path).is_file():
        raise InputError("is a file; unpack it, as with `tar -xzf`, and give the folder", file=path)
    if not Path(path).is_dir():
        raise InputError("there is no such folder; give the folder of a library or of points", file=path)
    return Path(path)


def read_library(folder: str | Path) -> Library:
    """Read the library in a folder. Raises InputError without one, InstanceError for a damaged index."""
    path = Path(folder) / INDEX
    if not path.is_file():
        raise InputError(
            "is no library: it has no library.json; build one with `crossfield library build`", file=folder
        )
    return Library(Path(folder), _read(path, INDEX_FORMAT, "library-index"))


def read_sidecar(path: str | Path) -> dict[str, Any]:
    """Read the sidecar in a file. Raises InputError, or InstanceError if it breaks its schema."""
    return _read(Path(path), ENTRY_FORMAT, "library-entry")


def load_document(path: Path) -> dict[str, Any]:
    """Read a document of a build that has just written or checked it, without its schema."""
    document: dict[str, Any] = json.loads(read_bytes(path))
    return document


def read_about(path: str | Path) -> dict[str, Any]:
    """Read the document of an instance. Raises as `read_sidecar`."""
    return _read(Path(path), ABOUT_FORMAT, "library-instance")


def _read(path: Path, form: str, schema: str) -> dict[str, Any]:
    return read_document(path, form, VERSION, schema, __package__, remedy="build the library again")


def about_file(instance: str) -> str:
    """Return the name of the document of an instance, which is written last."""
    return f"{instance}.about.json"


def document_bytes(document: dict[str, Any]) -> bytes:
    """Return a document as the bytes of its file."""
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def problem_of(library: Library | str | Path, document: dict[str, Any]) -> Problem:
    """Return the problem of an entry from its instance's file and its sidecar.

    Raises InputError, InstanceError if the instance is missing, damaged or another one.
    """
    folder = library.folder if isinstance(library, Library) else Path(library)

    def windows_of(instance: Instance) -> Windows | None:
        if "tightened" not in document:
            return None
        return remaining_windows(read_certificate(folder / document["tightened"]["certificate"], on=instance))

    return described_problem(document, folder / f"{document['name']}.json", windows_of)


def tightened_by(certificate: Claim, problem: Problem) -> Problem:
    """Return a problem in the windows that a certificate leaves."""
    return replace(problem, windows=remaining_windows(certificate))


def files_of_entry(sidecar: dict[str, Any]) -> list[str]:
    """Return the names of the model files and points of an entry."""
    return [file["name"] for file in sidecar["files"]]


def files_of_instance(about: dict[str, Any]) -> list[str]:
    """Return the names of the files of an instance: the instance itself, its fields and certificates."""
    named = [about["instance"], *about["fields"].values(), *about.get("certificates", {}).values()]
    return list(dict.fromkeys(facts["file"] for facts in named))
