"""What users name on the command line: sketches, samples, instances, names of tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...models.errors import InputError
from ...models.sketch.choice import AS_DRAWN, Choice, Silhouette
from .output import warn_of

if TYPE_CHECKING:
    from ...models.instance.instance import Gauge, Instance


def load(
    what: str,
    size: int | None,
    mask: Path | None,
    gauge: Gauge | None,
    choice: Choice,
    *,
    w_strokes: float | None,
    w_beta: float | None,
    quiet: bool,
) -> Instance:
    """The instance, of a size that can be written, under the weights that are given, a file's too.

    What its reader warns of is printed unless it shall be quiet. Raises InputError, and InstanceError for a
    weight that cannot be.
    """
    import numpy as np

    from ...models.sketch.read import available_memory, check_memory

    instance = _found(what, size, mask, gauge, choice).with_weights(w_strokes, w_beta)
    check_memory(int(np.count_nonzero(instance.mask)), available_memory())
    warn_of(instance, quiet=quiet)
    return instance


def choice_of(
    silhouette: Silhouette, curvature: list[str] | None, view: str | None, *, crossings: bool
) -> Choice:
    """What of a drawing is a curvature line, as the user says it. Raises InputError."""
    return Choice(silhouette, tuple(curvature or ()), view, crossings)


def _found(what: str, size: int | None, mask: Path | None, gauge: Gauge | None, choice: Choice) -> Instance:
    """The instance of an instance file, a sketch file or a built-in sample, in this order."""
    from ...models.instance.file import read_instance
    from ...models.sketch.read import DEFAULT_SIZE, read_sketch
    from ...models.sketch.samples import SAMPLES, sample

    path = Path(what)
    pixels = DEFAULT_SIZE if size is None else size
    if not path.is_file() and what in SAMPLES:
        if mask is not None:
            raise InputError(f"the sample {what} has its own mask; leave --mask out")
        if choice.curvature or choice.view:
            raise InputError(
                f"the sample {what} has its own curvature lines; leave --curvature and --view out"
            )
        return sample(
            what, pixels, gauge or "strokes", crossings=choice.crossings, silhouette=choice.silhouette
        )
    if not path.exists():
        raise InputError(
            "there is no such file and no such sample; `crossfield samples` lists the samples", file=what
        )
    if path.suffix.lower() not in {".json", ".npz"}:
        return read_sketch(
            path,
            size=pixels,
            mask=mask,
            gauge=gauge or "strokes",
            crossings=choice.crossings,
            silhouette=choice.silhouette,
            curvature=choice.curvature,
            view=choice.view,
        )
    if size is not None or mask is not None:
        raise InputError(
            "is an instance, which has its own grid and mask; leave --size and --mask out", file=what
        )
    if choice != AS_DRAWN:
        raise InputError(
            "is an instance, which has its own curvature lines; "
            "leave --silhouette, --curvature, --view and --crossings out",
            file=what,
        )
    instance = read_instance(path)
    return instance if gauge is None else instance.with_gauge(gauge)


def drawing_of(what: str) -> str | None:
    """What can be drawn below a field of a sketch, sample or instance as the user names it; None: nothing."""
    from ...models.sketch.samples import SAMPLES

    path = Path(what)
    if path.is_file():
        return None if path.suffix.lower() in {".json", ".npz"} else what
    return what if what in SAMPLES and SAMPLES[what].kind == "sketch" else None


def known(names: list[str] | None, table: Mapping[str, Any], kind: str) -> list[str]:
    """The names, each of which is in the table; all of the table when there are none."""
    for name in names or ():
        if name not in table:
            raise InputError(f"there is no {kind} {name!r}; choose one of {', '.join(table)}")
    return list(dict.fromkeys(names or table))


def formulations_of(names: list[str] | None) -> list[str]:
    """The formulations that full or short names mean, each once; all when there are no names."""
    from ...models.formulations.catalogue import FORMULATIONS, declaration_of

    return list(dict.fromkeys(declaration_of(name).name for name in names or FORMULATIONS))


def options_of(
    facet: str | None, stroke_norm: int | None, beta_norm: int | None, *, relax: bool
) -> dict[str, Any]:
    """The options of a formulation as the user gave them; None: not given."""
    return {"facet": facet, "stroke_norm": stroke_norm, "beta_norm": beta_norm, "relax": relax or None}
