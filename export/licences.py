"""Whether programs accept their licences: those of free editions end on dates."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

_TRIALS: Final = {
    "gurobi": "import gurobipy; gurobipy.Env()",
    "xpress": "import xpress; xpress.problem()",
}
"""The shortest Python code that needs the licence, by program; GAMS runs an empty model."""

_REFUSAL: Final = re.compile(r"^(?:\*\*\*|gurobipy\S*:|xpress\S*:) (.+?)\.?$", re.MULTILINE)
"""The words of a program that refuses its licence: GAMS's log, or the last line of Python."""

_CODES: Final = {"gams": 7, "gurobi": 1, "xpress": 1}
"""Return codes of a refusal."""

_SECONDS: Final = 60.0


def package_folder(name: str) -> Path | None:
    """The folder of an installed package, which is not imported; None if it is not installed."""
    spec = find_spec(name)
    return None if spec is None or spec.origin is None else Path(spec.origin).parent


@cache
def licence_error(program: str) -> str:
    """The words with which an installed program refuses its licence.

    Empty if it accepts the licence, has none that ends, or fails for another reason.
    """
    if program not in _CODES:
        return ""
    with TemporaryDirectory(prefix="crossfield-licence-") as folder:
        (Path(folder) / "empty.gms").write_bytes(b"")
        try:
            done = subprocess.run(
                _command(program), cwd=folder, capture_output=True, check=False, timeout=_SECONDS
            )
        except (OSError, subprocess.TimeoutExpired):
            return ""
    words = _REFUSAL.search((done.stdout + done.stderr).decode(errors="replace"))
    return words[1].rstrip() if words and done.returncode == _CODES[program] else ""


def _command(program: str) -> list[str]:
    if program in _TRIALS:
        return [sys.executable, "-W", "ignore", "-c", _TRIALS[program]]
    gams = package_folder("gamspy_base")
    assert gams is not None
    return [str(gams / "gams"), "empty.gms", "lo=3"]
