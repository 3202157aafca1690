"""The commands that take pixels of sketches alone; all others take faces of meshes, too.

Their refusal is one DomainError, which `Instance.grid` raises. docs/architecture.md names them.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from ...models.errors import DomainError

if TYPE_CHECKING:
    from ...models.instance.instance import Instance

SKETCHES_ONLY: Final = ("shade", "studio")


def check_domain(instance: Instance, command: str) -> None:
    """Raise DomainError for an instance on a domain that the command does not take."""
    if instance.domain.kind == "face" and command in SKETCHES_ONLY:
        instance.grid.check()  # `grid` raises the error


def is_mesh_file(path: Path, command: str) -> bool:
    """Whether the suffix is that of a mesh. Raises DomainError if the command takes no meshes."""
    from ...models.mesh.formats import MESH_READERS

    is_mesh = path.suffix.lower() in MESH_READERS
    if is_mesh and command in SKETCHES_ONLY:
        raise DomainError(f"is a mesh, and `crossfield {command}` takes sketches only", file=path)
    return is_mesh
