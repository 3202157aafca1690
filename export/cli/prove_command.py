"""The command `prove`: a field, a lower bound for the energy of all fields, and a certificate of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import typer

from ...models.errors import CrossfieldError
from . import options
from .inputs import read_start
from .output import print_line, print_notice, show_facts, show_progress
from .sketch_options import Size, SketchOptions

if TYPE_CHECKING:
    from ...models.field.field import Norm as NormOfField
    from ...models.proof.certificate import Certificate
    from ...models.proof.orthogonal_certificate import LevelFacts, OrthogonalProof
    from ...models.proof.record import LevelRecord, Proof

NORMS: Final[dict[str, NormOfField]] = {"1": 1, "2": 2, "mixed": "mixed"}
"""Norms by their names on the command line."""

UNPROVEN: Final = "unproven"
"""Status in the report of a proof without a bound."""


def prove_command(
    source: options.OptionalInput = None,
    output: options.ProofFolder = None,
    *,
    norm: options.Norm = "2",
    size: Size = None,
    start: options.Start = None,
    time_limit: options.SecondsOfProof = 60.0,
    gap: options.ProofGap = 0.0,
    check: options.Check = None,
    printing: options.PrintOptions,
) -> None:
    """Compute a field and prove how far its energy can be from the minimum.

    The certificate in the folder can be checked with --check, or by a separate program without crossfield.
    The check of the certificate comes after the time limit, and for orthogonal crosses within it. Ctrl-C ends
    the search or the check, and keeps all that is proven so far.
    """
    if check is not None:
        if source is not None or output is not None:
            raise typer.BadParameter("give --check FILE alone: the certificate contains the instance")
        _check_certificate(check, printing)
        return
    if source is None or output is None:
        raise typer.BadParameter("give a sketch, a sample or an instance, and -o DIR; or --check FILE")
    from ...models.processes.limits import Limits
    from ...models.proof.prove import prove

    with show_progress(quiet=printing.quiet) as show:
        show("reading the sketch")
        instance = SketchOptions(size).read(source, "prove", quiet=printing.quiet)
        proof = prove(
            instance,
            norm=NORMS[norm],
            start=read_start(start, instance),
            limits=Limits(time_limit, gap),
            progress=lambda line: show(f"{line}; Ctrl-C keeps them"),
        )
        document, failure = _write_proof(proof, output)
    printing.show(document, lambda: _show_proof(proof, document, output))
    if instance.gauge == "box":
        print_notice("the proof is of the gauge strokes; its bound also holds in the gauge box")
    if proof.ended == "interrupted":
        print_notice("interrupted; the best field and bound so far were kept")
    checked = len(document["levels"])
    if 0 < checked < len(proof.levels):
        print_notice(
            f"the check ended early: the certificate has {checked} of {len(proof.levels)} levels, and its "
            "bound is theirs; with a greater --time-limit it has more"
        )
    if failure is not None:
        raise failure


def _write_proof(
    proof: Proof | OrthogonalProof, folder: Path
) -> tuple[dict[str, Any], CrossfieldError | None]:
    """Write field, certificate and report of a proof; return the report, and why there is no certificate."""
    from ...models.field.file import write_field
    from ...models.storage import make_folder, remove_file, write_bytes
    from ..solving.proven import certify

    stem = f"{proof.field.instance.name}.proof"
    path = make_folder(folder) / f"{stem}.certificate.npz"
    write_field(proof.field, folder / f"{stem}.field.npz")
    certificate, failure = None, None
    try:
        certificate = certify(proof, path)
    except CrossfieldError as error:
        failure = error
    proven, bounds = _proven_facts(proof, certificate)
    levels: tuple[LevelFacts | LevelRecord, ...] = proof.levels
    document = proven | {
        "reason": None if failure is None else str(failure),
        "seconds": proof.seconds,
        "ended": proof.ended,
        "levels": [
            {"spacing": level.h, "labels": level.size, "bound": bound}
            for level, bound in zip(levels, bounds, strict=False)  # fewer are checked after Ctrl-C
        ],
    }
    write_bytes(folder / f"{stem}.json", (json.dumps(document, indent=1) + "\n").encode())
    if failure is not None:
        remove_file(path)  # it is of an earlier proof
    return document, failure


def _proven_facts(
    proof: Proof | OrthogonalProof, certificate: Certificate | None
) -> tuple[dict[str, Any], list[float]]:
    """Facts that are proven, and the bound of each level, as the checker confirms them."""
    if certificate is not None:
        return proof_facts(certificate), certificate.proven.levels
    return proof_facts(proof) | {"status": UNPROVEN, "bound": 0.0, "gap": 1.0, "forced_jumps": 0}, []


def proof_facts(source: Proof | OrthogonalProof | Certificate) -> dict[str, Any]:
    """Facts of a proof or a certificate, by name."""
    return {
        "instance": source.field.instance.name,
        "sha256": source.field.instance.sha256,
        "norm": source.norm,
        "status": source.status,
        "energy": source.energy,
        "bound": source.bound,
        "gap": source.gap,
        "forced_jumps": source.forced,
        "pairs": len(source.field.p),
    }


def _show_proof(proof: Proof | OrthogonalProof, document: dict[str, Any], folder: Path) -> None:
    """Print the report without its levels, and the folder of the files."""
    shown = {key: value for key, value in document.items() if key != "levels"}
    show_facts(proof.field.instance.summary, shown)
    certificate = "" if document["status"] == UNPROVEN else "certificate and "
    print_line(f"field, {certificate}report: {folder}")


def _check_certificate(path: Path, printing: options.PrintOptions) -> None:
    """Check a certificate and print its facts."""
    from ...models.proof.certificate import read_certificate

    with show_progress(quiet=printing.quiet) as show:
        show("checking the certificate")
        certificate = read_certificate(path, jobs=2, progress=show)

    printing.show_facts(
        certificate.field.instance.summary, proof_facts(certificate), "the certificate is valid"
    )
