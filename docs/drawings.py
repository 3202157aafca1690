"""Drawings, tiny instances and commands whose results are kept, for the programs that measure."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import crossfield as cf
import numpy as np
from crossfield.export.bundle.problem_files import write_all
from crossfield.export.verify.checks import Check
from crossfield.export.verify.verify import verify
from crossfield.models.field.field import CrossField
from crossfield.models.instance.grid import REFERENCE
from crossfield.models.instance.instance import Instance
from crossfield.models.sketch.samples import SAMPLES

SUFFIXES: Final = (".svg", ".png", ".scap")
"""Endings of the files of drawings."""
PROVERS: Final = ("gurobi", "cplex")
PROOF_SECONDS: Final = 60.0
RANDOM: Final = 8  # random instances of 5 x 5 pixels


def subject_of(name: str) -> str:
    """The subject of a drawing: the name of its file, without suffix and mark of a rasterized copy."""
    return name.partition(".")[0].removesuffix("_rasterized")


@dataclass(frozen=True)
class Sketch:
    """A sample, or a drawing in a file with its mask, if it has one."""

    name: str
    what: str
    mask: Path | None = None

    @property
    def arguments(self) -> list[str]:
        """Its argument on the command line."""
        return [self.what, *(["--mask", str(self.mask)] if self.mask else [])]

    def weights(self, size: int) -> list[str]:
        """The weights whose coefficients at that size are those of the paper, 1 and 1e-6."""
        scale = size / REFERENCE
        return ["--stroke-weight", repr(scale), "--skew-weight", repr(1e-6 * scale**2)]

    def instance(self, size: int) -> Instance:
        """The instance of that size, with the coefficients of the paper."""
        if self.what in SAMPLES:
            instance = cf.sample(self.what, size)
        else:
            instance = cf.read_sketch(self.what, size=size, mask=self.mask)
        return replace(
            instance,
            stroke_coefficient=Instance.stroke_coefficient,
            skew_coefficient=Instance.skew_coefficient,
        )


def sketches(folder: Path | None) -> list[Sketch]:
    """Every sample, and every drawing of a folder."""
    return [*(Sketch(name, name) for name in SAMPLES), *(drawings_of(folder) if folder else ())]


def drawings_of(folder: Path, suffixes: tuple[str, ...] = SUFFIXES) -> Iterator[Sketch]:
    """Every drawing of a folder; a picture called NAME_mask.png is the mask of NAME.png."""
    for path in sorted(folder.iterdir()):
        if path.suffix in suffixes and not path.stem.endswith("_mask"):
            mask = path.with_name(f"{path.stem}_mask.png")
            yield Sketch(path.name, str(path), mask if path.suffix == ".png" and mask.exists() else None)


def run_command(command: list[str], folder: Path, name: str) -> dict[str, Any]:
    """The JSON output of a command of crossfield.

    With `memory`, the most bytes that its processes held, and `whole`, its wall time in seconds. The folder
    keeps it with the command's files; the next call reads it from there.
    """
    record = folder / "facts.json"
    if record.exists():
        return dict(json.loads(record.read_text()))
    begin = time.perf_counter()
    command = [sys.executable, "-m", "crossfield", *command]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        most = 0
        while process.poll() is None:
            most = max(most, memory_of(process.pid))
            time.sleep(0.25)
        answer = process.communicate()[0]
    whole = time.perf_counter() - begin
    if process.returncode:
        raise SystemExit(f"{name}: exit code {process.returncode}")
    facts = dict(json.loads(answer)) | {"memory": most, "whole": whole}
    record.write_text(json.dumps(facts, indent=1) + "\n")
    return facts


def memory_of(session: int) -> int:
    """Bytes of memory that the processes of a session hold, shared pages counted once for each."""
    total = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        total += int(fields[21]) * os.sysconf("SC_PAGE_SIZE") if int(fields[3]) == session else 0
    return total


def tiny_instances() -> Iterator[Instance]:
    """Instances small enough for a proof: the smallest samples, and random strokes on 5 x 5 pixels."""
    for name in SAMPLES:
        for size in range(5, 12):
            try:
                instance = Sketch(name, name).instance(size)
            except cf.CrossfieldError:  # the outline leaves no room on so coarse a grid
                continue
            if len(instance.theta) >= 3:
                yield instance
                break
    for seed in range(RANDOM):
        rng = np.random.default_rng(seed)
        pixels = np.argwhere(rng.random((5, 5)) < 0.5)
        theta = rng.uniform(0, np.pi, len(pixels))
        yield Instance.on_pixels(f"random_{seed}", np.ones((5, 5), bool), pixels, theta, np.ones(len(pixels)))


def optimum(
    instance: Instance, start: CrossField, provers: tuple[str, ...] = PROVERS
) -> tuple[Check | None, float | None]:
    """The check of the first prover that closes `miqp-exact`, or None, and the best dual bound of all."""
    bounds = []
    with tempfile.TemporaryDirectory() as folder:
        write_all(instance, folder, formulations=["miqp-exact"], formats=["mps", "nl"], start=start)
        for prover in provers:
            for check in verify(folder, seconds=PROOF_SECONDS, programs=[prover]).checks:
                if check.step == "solve" and check.proven:
                    return check, check.bound
                if check.step == "solve" and check.bound is not None:
                    bounds.append(check.bound)
    return None, max(bounds, default=None)
