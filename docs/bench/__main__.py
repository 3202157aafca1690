"""Measure on a quiet machine and replace tables of pages: `python docs/bench NAME`."""

import importlib
import sys
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "performance.md"
BENCHMARKS = {
    "closed": "proofs on closed surfaces, for docs/notebooks/mesh.md",
    "doubts": "doubts about drawings whose surfaces are known",
    "start": "CPU seconds of short commands",
    "studio": "the answer of the studio to a stroke",
    "surfaces": "errors of surfaces by their fields",
    "writing": "the writers next to those of other programs",
}


def main() -> None:
    """Run the benchmark that the first argument names: the function `main` of the module of that name."""
    if sys.argv[1:2] and sys.argv[1] in BENCHMARKS:
        sys.path.append(str(PAGE.parent))  # for what the programs of docs/ share
        importlib.import_module(sys.argv[1]).main(PAGE, sys.argv[2:])
    else:
        lines = [f"  {name}: {measured}" for name, measured in BENCHMARKS.items()]
        sys.exit("\n".join(["usage: python docs/bench NAME [OPTIONS]", *lines]))


if __name__ == "__main__":
    main()
