"""What users name on the command line: sketches, samples, instances, names of tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ...models.errors import CrossfieldError, InputError
from ...models.sketch.choice import AS_DRAWN, Choice, Silhouette
from .output import warn_of

if TYPE_CHECKING:
    from ...models.field.field import CrossField
    from ...models.instance.instance import Gauge, Instance

SAVED: Final = (".npz", ".json", ".rawfield")
"""Suffixes of the files that hold a field."""


def load(
    what: str,
    size: int | None,
    mask: Path | None,
    gauge: Gauge | None,
    choice: Choice,
    *,
    stroke_weight: float | None,
    skew_weight: float | None,
    quiet: bool,
) -> Instance:
    """The instance, of a size that can be written, under the weights that are given, a file's too.

    What its reader warns of is printed unless it shall be quiet. Raises InputError, and InstanceError for a
    weight that cannot be.
    """
    import numpy as np

    from ...models.memory import available_memory
    from ...models.sketch.read import check_memory

    instance = _found(what, size, mask, gauge, choice).with_weights(
        stroke_weight=stroke_weight, skew_weight=skew_weight
    )
    check_memory(int(np.count_nonzero(instance.mask)), available_memory())
    warn_of(instance, quiet=quiet)
    return instance


def choice_of(silhouette: Silhouette, curvature: list[str] | None, view: str | None) -> Choice:
    """What of a drawing is a curvature line, as the user says it. Raises InputError."""
    return Choice(silhouette, tuple(curvature or ()), view)


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
        return sample(what, pixels, gauge=gauge or "strokes", silhouette=choice.silhouette)
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
            "leave --silhouette, --curvature and --view out",
            file=what,
        )
    instance = read_instance(path)
    return instance if gauge is None else instance.with_gauge(gauge)


def field_or_instance(path: Path, on: Path | None) -> CrossField | Instance:
    """The field in a file, or else the instance; on: the file of the instance of a .rawfield.

    Raises InputError for what is neither.
    """
    from ...models.field.file import read_field
    from ...models.instance.file import read_instance

    if not path.is_file():
        raise InputError("there is no such file; give a field or an instance (.npz, .json)", file=path)
    require_suffix(path, SAVED)
    if on is not None:
        return read_field(path, on=read_instance(on))
    if path.suffix.lower() == ".rawfield":
        raise InputError("holds no instance; give the one it is on by --on", file=path)
    try:
        return read_field(path)
    except CrossfieldError as as_field:
        try:
            return read_instance(path)
        except CrossfieldError as as_instance:
            first, second = (str(error).removeprefix(f"{path}: ") for error in (as_field, as_instance))
            raise InputError(f"is no field ({first}) and no instance ({second})", file=path) from as_field


def require_suffix(path: Path, allowed: tuple[str, ...]) -> None:
    """Nothing, when a file has one of the suffixes. Raises InputError for another one."""
    if path.suffix.lower() not in allowed:
        has = f"the suffix {path.suffix!r}" if path.suffix else "no suffix"
        raise InputError(f"has {has}, which does not say what it is; use {', '.join(allowed)}", file=path)


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
