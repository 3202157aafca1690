"""The command `prove`: a field, a lower bound for the energy of all fields, and a certificate of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import typer

from ...models.errors import CrossfieldError
from ...models.written_files import kept_notice
from . import options
from .inputs import find_drawing, read_source, read_start
from .output import print_facts, print_notice, show_progress

if TYPE_CHECKING:
    from ...models.field.field import Norm as NormOfField
    from ...models.proof.descent.record import Claim, Proof
    from ...models.storage import NewResults

NORMS: Final[dict[str, NormOfField]] = {"1": 1, "2": 2, "mixed": "mixed"}
"""Norms by their names on the command line."""

UNPROVEN: Final = "unproven"
"""Status in the report of a proof without a bound."""


def prove_command(
    source: options.OptionalInput = None,
    output: options.ProofFolder = None,
    *,
    norm: options.Norm = "2",
    size: options.Size = None,
    start: options.Start = None,
    time_limit: options.SecondsOfProof = 60.0,
    gap: options.ProofGap = 0.0,
    check: options.Check = None,
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Compute a field and prove how far its energy can be from the minimum.

    The certificate in the folder can be checked with --check, or by a separate program without crossfield.
    The check of the certificate comes after the time limit, and for orthogonal crosses within it. Ctrl-C ends
    the search or the check, and keeps all that is proven so far.
    """
    if check is not None:
        if source is not None or output is not None:
            raise typer.BadParameter("give --check FILE alone: the certificate contains the instance")
        _check_certificate(check, as_json=as_json)
        return
    if source is None or output is None:
        raise typer.BadParameter("give a sketch, a sample or an instance, and -o DIR; or --check FILE")
    from ...models.processes.limits import Limits
    from ...models.proof.prove import prove
    from ...models.storage import replace_results

    with show_progress() as show:
        show("reading the sketch")
        instance = read_source(source, sketch={"size": size})
        endings = ("field.npz", "certificate.npz", "json")
        names = ProofNames(*(f"{instance.name}.proof.{ending}" for ending in endings))
        reads = [path for path in (find_drawing(source), start) if path is not None]
        with replace_results(output, names, reads=reads, force=force) as new:
            proof = prove(
                instance,
                norm=NORMS[norm],
                start=read_start(start, instance),
                limits=Limits(time_limit, gap),
                progress=lambda line: show(f"{line}; Ctrl-C keeps them"),
            )
            document, failure = _write_proof(proof, new.path, names)
            if not force:
                _keep_better(new, proof, names, None if document["status"] == UNPROVEN else document["bound"])
    written = f"field, {'' if document['status'] == UNPROVEN else 'certificate and '}report: {output}"
    shown = document if as_json else document | {"describes": None, "levels": None}
    print_facts(instance.summary, shown, written, as_json=as_json)
    if instance.gauge == "box":
        print_notice("the proof is of the gauge strokes; its bound also holds in the gauge box")
    if proof.ended == "interrupted":
        print_notice("interrupted; the best field and bound so far were kept")
    if failure is not None:
        raise failure


class ProofNames(NamedTuple):
    """The names of the files of a proof."""

    field: str
    certificate: str
    report: str


def _write_proof(
    proof: Proof, folder: Path, names: ProofNames
) -> tuple[dict[str, Any], CrossfieldError | None]:
    """Write field, certificate and report of a proof; return the report, and why there is no certificate."""
    from ...models.field.file import write_field
    from ..runs.proven import certify

    write_field(proof.field, folder / names.field)
    certificate, failure = None, None
    try:
        certificate = certify(proof, folder / names.certificate)
    except CrossfieldError as error:
        failure = error
    proven, bounds = _proven_facts(proof, certificate)
    document = proven | {
        "describes": names.field if certificate is None else names.certificate,
        "reason": proof.reason or None if failure is None else str(failure),
        "seconds": proof.seconds,
        "ended": proof.ended,
        "levels": [
            {"spacing": level.h, "labels": level.size, "bound": bound}
            for level, bound in zip(proof.levels, bounds, strict=False)  # fewer are checked after Ctrl-C
        ],
    }
    (folder / names.report).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return document, failure


def _keep_better(new: NewResults, proof: Proof, names: ProofNames, bound: float | None) -> None:
    """Keep an earlier field of less energy, and an earlier certificate of a higher bound.

    Its report stays with a certificate; without one, with the field. With an earlier certificate, an
    earlier field of the same energy stays, too.
    """
    from ...models.proof.certificate import earlier_bound
    from ..bundle.earlier import keep_better_field

    instance, norm = proof.field.instance, proof.norm
    earlier = earlier_bound(new.folder / names.certificate, instance, norm)
    if earlier is not None and (bound is None or earlier > bound):
        now = "no bound" if bound is None else f"bound {bound:.6g}"
        print_notice(kept_notice(names.certificate, f"bound {earlier:.6g}", now))
        new.kept.update((names.certificate, names.report))
    keep_better_field(
        new,
        names.field,
        proof.field,
        print_notice,
        on=instance,
        value=lambda field: field.energy(norm).total,
        also_equal=names.certificate in new.kept,
    )
    if bound is None and names.field in new.kept:
        new.kept.add(names.report)


def _proven_facts(proof: Proof, certificate: Claim | None) -> tuple[dict[str, Any], list[float]]:
    """Facts that are proven, and the bound of each level, as the checker confirms them."""
    if certificate is not None and certificate.proven is not None:
        return proof_facts(certificate), certificate.proven.levels
    return proof_facts(proof) | {"status": UNPROVEN, "bound": 0.0, "gap": 1.0, "forced_jumps": 0}, []


def proof_facts(source: Claim) -> dict[str, Any]:
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


def _check_certificate(path: Path, *, as_json: bool) -> None:
    """Check a certificate and print its facts."""
    from ...models.proof.certificate import read_certificate

    with show_progress() as show:
        show("checking the certificate")
        certificate = read_certificate(path, jobs=2, progress=show)

    facts = proof_facts(certificate)
    print_facts(certificate.field.instance.summary, facts, "the certificate is valid", as_json=as_json)
