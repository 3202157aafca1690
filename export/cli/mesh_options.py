"""Options that read a mesh, which the command `instance` has, and the commands that take no meshes.

Their refusal is one DomainError, which `Instance.grid` raises. docs/architecture.md names them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from ...models.errors import DomainError

if TYPE_CHECKING:
    from ...models.instance.instance import Instance

_mesh_option = partial(typer.Option, rich_help_panel="Mesh")

SKETCHES_ONLY: Final = ("shade", "studio")
"""Commands that take pixels of sketches alone."""


@dataclass(frozen=True)
class MeshOptions:
    """Strokes and weights with which a mesh is read as an instance."""

    sharp: Annotated[
        float | None,
        _mesh_option(
            "--sharp",
            metavar="DEGREES",
            help="Strokes along the edges of a mesh whose faces meet at this angle or more, above 0 (flat),"
            " up to 180; by default only boundaries, and the polylines of an .obj, are strokes.",
        ),
    ] = None
    directions: Annotated[
        Path | None,
        _mesh_option(
            "--directions",
            metavar="FILE",
            help="More strokes of a mesh: a table face,x,y,z (CSV) of directions in space, faces from 0, or"
            " the first vectors of a .rawfield.",
        ),
    ] = None
    weights: Annotated[
        Literal["unit", "dual"],
        _mesh_option(
            "--weights",
            help="Weights of neighbouring faces in the smoothness: all 1 (unit), or the length of their edge"
            " over the distance of their centres (dual).",
        ),
    ] = "unit"


def check_domain(instance: Instance, command: str) -> None:
    """Raise DomainError for an instance on a domain that the command does not take."""
    if command in SKETCHES_ONLY:
        instance.grid.check()  # `grid` raises the error


def is_mesh_file(path: Path, command: str) -> bool:
    """Whether the suffix is that of a mesh. Raises DomainError if the command takes no meshes."""
    from ...models.mesh.formats import MESH_READERS

    is_mesh = path.suffix.lower() in MESH_READERS
    if is_mesh and command in SKETCHES_ONLY:
        raise DomainError(f"is a mesh, and `crossfield {command}` takes sketches only", file=path)
    return is_mesh
