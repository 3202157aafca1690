"""The table of the domains that each command takes: pixels of sketches, faces of meshes.

A command whose table lacks a domain ends with one DomainError, which `Instance.grid` raises.
docs/architecture.md states the exceptions.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from ...models.errors import DomainError

if TYPE_CHECKING:
    from ...models.instance.instance import Instance

SKETCHES: Final = ("pixel",)
BOTH: Final = ("pixel", "face")

DOMAINS: Final = {
    "run": BOTH,
    "instance": BOTH,
    "export": BOTH,
    "solve": BOTH,
    "prove": BOTH,
    "read": BOTH,
    "draw": BOTH,
    "shade": SKETCHES,
    "studio": SKETCHES,
    "verify": BOTH,
    "list": BOTH,
    "library": BOTH,
}
"""Kinds of points (`Domain.kind`) by command."""


def check_domain(instance: Instance, command: str) -> None:
    """Raise DomainError for an instance on a domain that the command does not take."""
    if instance.domain.kind not in DOMAINS[command]:
        instance.grid.check()  # `grid` raises the error: there is no command for meshes only


def is_mesh_file(path: Path, command: str) -> bool:
    """Whether the suffix is that of a mesh. Raises DomainError if the command takes no meshes."""
    from ...models.mesh.formats import MESH_READERS

    is_mesh = path.suffix.lower() in MESH_READERS
    if is_mesh and "face" not in DOMAINS[command]:
        raise DomainError(f"is a mesh, and `crossfield {command}` takes sketches only", file=path)
    return is_mesh
