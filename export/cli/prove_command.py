"""The command `prove`: a field with a lower bound of what any field costs, and a certificate of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, cast

import typer

from ...models.errors import SolverError
from .inputs import choice_of, load
from .options import (
    Curvature,
    GaugeName,
    Json,
    Mask,
    Outline,
    Quiet,
    Size,
    SkewWeight,
    Start,
    StrokeWeight,
    View,
)
from .output import complain, progress, say, say_json, show_facts

if TYPE_CHECKING:
    from ...models.field.field import Norm
    from ...models.processes.deadline import Deadline
    from ...models.proof.certificate import Certificate
    from ...models.proof.record import Proof

UNPROVEN: Final = "unproven"
"""Status in the report of a proof without a bound."""


def prove_command(
    instance: Annotated[
        str | None,
        typer.Argument(
            metavar="[SKETCH|SAMPLE|INSTANCE]",
            help="A drawing (SVG, .scap, .curves) or bitmap; a built-in sample: {samples}; or a file of"
            " `instance`.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Folder for field, certificate and report."),
    ] = None,
    *,
    norm: Annotated[
        int,
        typer.Option(
            "--norm",
            min=1,
            max=2,
            help="Of the energy; proofs in the 1-norm, which milp-mccormick minimises, have no certificate.",
        ),
    ] = 2,
    size: Size = None,
    mask: Mask = None,
    silhouette: Outline = "none",
    curvature: Curvature = None,
    view: View = None,
    gauge: GaugeName = None,
    stroke_weight: StrokeWeight = None,
    skew_weight: SkewWeight = None,
    start: Start = None,
    time_limit: Annotated[
        float,
        typer.Option(
            "--time-limit",
            min=0.1,
            metavar="SECONDS",
            help="Seconds for the proof and for its certificate, which is written and checked."
            " They count from when the sketch is read.",
        ),
    ] = 60.0,
    gap: Annotated[
        float,
        typer.Option(
            "--gap",
            min=0.0,
            help="Relative distance between energy and bound that is enough; 0 asks for a proven optimum.",
        ),
    ] = 0.0,
    check: Annotated[
        Path | None,
        typer.Option("--check", metavar="FILE", help="Only check this certificate, and say what it proves."),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Find a field and prove how far its energy is from the least, at most.

    The certificate in the folder can be checked by --check, or by a program of its own without crossfield.
    Ctrl-C ends the proof with what it has, and the certificate with what is checked.
    """
    if check is not None:
        if instance is not None or output is not None:
            raise typer.BadParameter("--check FILE goes alone: the instance is in the certificate")
        _check(check, quiet=quiet, as_json=as_json)
        return
    if instance is None or output is None:
        raise typer.BadParameter("give a sketch, a sample or an instance, and -o DIR; or --check FILE")
    from ...models.field.file import read_field
    from ...models.processes.deadline import Deadline
    from ...models.processes.limits import Limits
    from ...models.proof.prove import prove

    with progress(quiet=quiet) as show:
        show("reading the sketch")
        choice = choice_of(silhouette, curvature, view)
        loaded = load(
            instance,
            size,
            mask,
            gauge,
            choice,
            stroke_weight=stroke_weight,
            skew_weight=skew_weight,
            quiet=quiet,
        )
        deadline = Deadline.after(time_limit)
        proof = prove(
            loaded,
            norm=cast("Norm", norm),
            start=None if start is None else read_field(start, on=loaded),
            limits=Limits(time_limit, gap).until(deadline),
            certified=True,
            progress=lambda line: show(f"{line}; Ctrl-C keeps them"),
        )
        show("writing and checking the certificate")
        document = _write(proof, output, deadline)
    if as_json:
        say_json(document)
    elif not quiet:
        show_facts(loaded.summary, {key: value for key, value in document.items() if key != "levels"})
        certificate = "certificate and " if norm == 2 and document["status"] != UNPROVEN else ""
        say(f"field, {certificate}report: {output}")
    if proof.ended == "interrupted":
        complain("interrupted; the best field and bound so far were kept")
    if document["status"] == UNPROVEN:
        from ..solving.proven import NOTHING

        raise SolverError(f"{NOTHING}; field and report were written. Increase --time-limit", file=output)


def _write(proof: Proof, folder: Path, deadline: Deadline) -> dict[str, Any]:
    """Write field, report and, in the 2-norm, certificate of a proof; return the facts of the report."""
    from ...models.field.file import write_field
    from ...models.processes.interruption import interruptible
    from ...models.storage import make_folder, write_bytes
    from ..solving.proven import certified

    stem = f"{proof.field.instance.name}.proof"
    path = make_folder(folder) / f"{stem}.certificate.npz"
    with interruptible() as interrupted:
        certificate = certified(proof, path, deadline, interrupted)
    said, bounds = _proven(proof, certificate)
    write_field(proof.field, folder / f"{stem}.field.npz")
    document = said | {
        "norm": proof.norm,
        "seconds": proof.seconds,
        "ended": proof.ended,
        "levels": [
            {"spacing": level.h, "labels": int(level.allowed.sum()), "bound": bound}
            for level, bound in zip(proof.levels, bounds, strict=False)  # fewer are checked after Ctrl-C
        ],
    }
    write_bytes(folder / f"{stem}.json", (json.dumps(document, indent=1) + "\n").encode())
    return document


def _proven(proof: Proof, certificate: Certificate | None) -> tuple[dict[str, Any], list[float]]:
    """Return the facts that are proven, and the bound of each level: those that the checker confirms."""
    if certificate is not None:
        return facts(certificate), certificate.verdict.levels
    if proof.norm == 1 and not proof.bound <= 0 < proof.energy:
        return facts(proof), [level.bound for level in proof.levels]
    return facts(proof) | {"status": UNPROVEN, "bound": 0.0, "gap": 1.0, "forced_jumps": 0}, []


def facts(said: Proof | Certificate) -> dict[str, Any]:
    """What a proof or a certificate says, by name."""
    return {
        "instance": said.field.instance.name,
        "sha256": said.field.instance.sha256,
        "status": said.status,
        "energy": said.energy,
        "bound": said.bound,
        "gap": said.gap,
        "forced_jumps": said.forced,
        "pairs": len(said.field.p),
    }


def _check(path: Path, *, quiet: bool, as_json: bool) -> None:
    from ...models.proof.certificate import read_certificate

    with progress(quiet=quiet) as show:
        show("checking the certificate")
        found = read_certificate(path)
    if as_json:
        say_json(facts(found))
    elif not quiet:
        show_facts(found.field.instance.summary, facts(found))
        say("the certificate is valid")
