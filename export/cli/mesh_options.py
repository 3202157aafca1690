"""Options that read a mesh, which the command `instance` has."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from ...models.instance.instance import Instance


@dataclass(frozen=True)
class MeshOptions:
    """Strokes and weights with which a mesh is read as an instance."""

    sharp: Annotated[
        float | None,
        typer.Option(
            "--sharp",
            metavar="DEGREES",
            help="Strokes along the edges of a mesh whose faces meet at this angle or more, from 0 (flat) to"
            " 180; by default only boundaries, and the polylines of an .obj, are strokes.",
        ),
    ] = None
    directions: Annotated[
        Path | None,
        typer.Option(
            "--directions",
            metavar="FILE",
            help="More strokes of a mesh: a table face,x,y,z (CSV) of directions in space, faces from 0, or"
            " the first vectors of a .rawfield.",
        ),
    ] = None
    weights: Annotated[
        Literal["unit", "dual"],
        typer.Option(
            "--weights",
            help="Weights of neighbouring faces in the smoothness: all 1 (unit), or the length of their edge"
            " over the distance of their centres (dual).",
        ),
    ] = "unit"

    def read(self, path: Path) -> Instance:
        """Instance of a mesh file, small enough for the memory. Raises InputError and MeshError."""
        from ...models.memory import check_memory
        from ...models.mesh.read import read_mesh

        instance = read_mesh(path, **asdict(self))
        check_memory(instance.domain.size, instance.domain.kind)
        return instance
