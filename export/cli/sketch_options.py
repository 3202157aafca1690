"""Options that read a sketch, a sample, a mesh or an instance file.

`run`, `shade` and `instance` have all of them. The other commands have --size, and take the file that
`instance` wrote for everything else.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from ...models.errors import InputError, naming
from .mesh_options import MeshOptions, check_domain, is_mesh_file
from .output import print_warnings

if TYPE_CHECKING:
    from ...models.instance.instance import Instance

_sketch_option = partial(typer.Option, rich_help_panel="Sketch")
Size = Annotated[
    int | None, _sketch_option("--size", help="Pixels on the longer side of the grid; {size} by default.")
]

_PLAIN: Final = MeshOptions()


@dataclass(frozen=True)
class SketchOptions:
    """Grid, curvature lines and weight of the strokes with which a sketch is read as an instance."""

    size: Size = None
    mask: Annotated[
        Path | None,
        _sketch_option(
            "--mask",
            metavar="FILE",
            help="Picture of the same size as the sketch, white where the field is wanted.",
        ),
    ] = None
    silhouette: Annotated[
        Literal["none", "outer"],
        _sketch_option(
            "--silhouette",
            help="Strokes along the outline of the drawing carry no direction (outer), or are curvature lines"
            " like all others (none).",
        ),
    ] = "none"
    curvature: Annotated[
        list[str] | None,
        _sketch_option(
            "--curvature",
            metavar="LABEL",
            help="Label of the strokes that are curvature lines, such as colour=red, class=flow, id=group2,"
            " layer=Flow (SVG) or cluster=3 (.scap). Other strokes cut the field. May be repeated; by default"
            " red strokes, or all strokes of a drawing in one colour.",
        ),
    ] = None
    view: Annotated[
        str | None,
        _sketch_option(
            "--view",
            metavar="VIEW",
            help="Viewpoint of a .curves file: front, side, top, or azimuth and elevation in degrees, as in"
            " 30,25; by default the view in which the strokes extend furthest.",
        ),
    ] = None
    stroke_weight: Annotated[
        float | None,
        _sketch_option(
            "--stroke-weight",
            metavar="X",
            help="Weight of the distance from the strokes, 0 to {most weight} (to less on grids below 24"
            " pixels), the same on every grid; by default {stroke weight}, or the weight in the instance"
            " file.",
        ),
    ] = None

    @property
    def _chooses_strokes(self) -> bool:
        """Whether an option decides which strokes of a drawing are curvature lines."""
        return self.silhouette != "none" or bool(self.curvature) or self.view is not None

    def read(self, source: str, command: str, *, mesh: MeshOptions = _PLAIN, quiet: bool = False) -> Instance:
        """Instance of a sketch or mesh file, a sample or an instance file.

        Prints the warnings of the reader unless quiet. Raises DomainError for a domain that the command does
        not take, InputError, and InstanceError for a weight that is out of range.
        """
        from ...models.mesh.read import read_mesh
        from ...models.mesh.shapes import MESHES

        path = Path(source)
        is_saved = path.is_file() and path.suffix.lower() in {".json", ".npz"}
        is_mesh = is_mesh_file(path, command)
        if mesh != _PLAIN and not is_mesh:
            raise InputError("is no mesh file; leave --sharp, --directions and --weights out", file=path)
        is_sample = not path.is_file() and str(path) in MESHES
        if (is_mesh or is_sample) and replace(self, stroke_weight=None) != SketchOptions():
            raise InputError("is a mesh; leave out the options that read a sketch", file=path)
        if is_saved:
            instance = self._read_instance(path)
        else:
            instance = read_mesh(path, **asdict(mesh)) if is_mesh else self._read_drawing(path)
        with naming(path):
            check_domain(instance, command)
        instance = instance.with_weights(stroke_weight=self.stroke_weight)
        print_warnings(instance, quiet=quiet)
        return instance

    def _read_drawing(self, path: Path) -> Instance:
        from ...models.mesh.shapes import MESHES
        from ...models.sketch.read import DEFAULT_SIZE, read_sketch
        from ...models.sketch.samples import SAMPLES

        if not path.is_file() and (str(path) in SAMPLES or str(path) in MESHES):
            return self._make_sample(str(path))
        if not path.exists():
            raise InputError(
                "there is no such file and no such sample; `crossfield list` lists the samples", file=path
            )
        return read_sketch(
            path,
            size=DEFAULT_SIZE if self.size is None else self.size,
            mask=self.mask,
            silhouette=self.silhouette,
            curvature=self.curvature or (),
            view=self.view,
        )

    def _make_sample(self, name: str) -> Instance:
        from ...models.samples.samples import sample

        if self.mask is not None:
            raise InputError(f"the sample {name} has its own mask; leave --mask out")
        if self.curvature or self.view:
            raise InputError(
                f"the sample {name} has its own curvature lines; leave --curvature and --view out"
            )
        return sample(name, self.size, silhouette=self.silhouette)

    def _read_instance(self, path: Path) -> Instance:
        from ...models.instance.file import read_instance

        if self.size is not None or self.mask is not None:
            raise InputError(
                "is an instance, which has its own grid or mesh; leave --size and --mask out", file=path
            )
        if self._chooses_strokes:
            raise InputError(
                "is an instance, which has its own curvature lines; "
                "leave --silhouette, --curvature and --view out",
                file=path,
            )
        return read_instance(path)
