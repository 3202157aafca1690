"""The command `prove`: a field, a lower bound for the energy of all fields, and a certificate of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Self

import typer

from ...models.errors import CrossfieldError
from ...models.written_files import is_unchanged, kept_notice
from . import options
from .inputs import find_drawing, read_start
from .output import print_line, print_notice, show_facts, show_progress
from .sketch_options import Size, SketchOptions

if TYPE_CHECKING:
    from ...models.field.field import Norm as NormOfField
    from ...models.instance.instance import Instance
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
    size: Size = None,
    start: options.Start = None,
    time_limit: options.SecondsOfProof = 60.0,
    gap: options.ProofGap = 0.0,
    check: options.Check = None,
    force: options.Force = False,
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
    from ...models.storage import replace_results

    with show_progress(quiet=printing.quiet) as show:
        show("reading the sketch")
        instance = SketchOptions(size).read(source, "prove", quiet=printing.quiet)
        names = ProofNames.of(instance)
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
                _keep_better(new, proof, names, document)
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


class ProofNames(NamedTuple):
    """The names of the files of a proof."""

    field: str
    certificate: str
    report: str

    @classmethod
    def of(cls, instance: Instance) -> Self:
        """Return the names for an instance."""
        stem = f"{instance.name}.proof"
        return cls(f"{stem}.field.npz", f"{stem}.certificate.npz", f"{stem}.json")


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
        "reason": None if failure is None else str(failure),
        "seconds": proof.seconds,
        "ended": proof.ended,
        "levels": [
            {"spacing": level.h, "labels": level.size, "bound": bound}
            for level, bound in zip(proof.levels, bounds, strict=False)  # fewer are checked after Ctrl-C
        ],
    }
    _write_report(document, folder / names.report)
    return document, failure


def _write_report(document: dict[str, Any], path: Path) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _keep_better(new: NewResults, proof: Proof, names: ProofNames, document: dict[str, Any]) -> None:
    """Keep an earlier field of less energy and an earlier certificate of a higher bound.

    The report then has the energy of the one, and levels and bound of the other.
    """
    from ...models.proof.checkers.check_certificate import gap_of, status_of
    from ..bundle.earlier import keep_better_field

    instance, norm = proof.field.instance, proof.norm
    bound = None if document["status"] == UNPROVEN else document["bound"]
    higher = _keep_better_bound(new, names.certificate, bound, on=instance, norm=norm)
    lower = keep_better_field(
        new,
        names.field,
        proof.field,
        print_notice,
        on=instance,
        value=lambda field: field.energy(norm).total,
    )
    if higher is not None:
        if is_unchanged(new.folder / names.report):
            document.update(json.loads((new.folder / names.report).read_text("utf-8")))
        document |= {"bound": higher, "status": "gap"}
    if higher is not None or lower is not None:
        energy = (lower or proof.field).energy(norm).total
        document["energy"] = energy
        if document["status"] != UNPROVEN:
            document["status"] = status_of(energy, document["bound"])
            document["gap"] = gap_of(energy, document["bound"])
        _write_report(document, new.path / names.report)


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


def _show_proof(proof: Proof, document: dict[str, Any], folder: Path) -> None:
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


def _keep_better_bound(
    new: NewResults, name: str, bound: float | None, *, on: Instance, norm: NormOfField = 2
) -> float | None:
    """Keep an earlier certificate of a higher bound than the one proven now, if any; return that bound."""
    from ...models.proof.certificate import earlier_bound

    earlier = earlier_bound(new.folder / name, on, norm)
    if earlier is None or (bound is not None and earlier <= bound):
        return None
    print_notice(
        kept_notice(name, f"bound {earlier:.6g}", "no bound" if bound is None else f"bound {bound:.6g}")
    )
    new.kept.add(name)
    return earlier
