"""Whether GAMS accepts its licence: that of the free package ends on a date."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

_LICENSING_ERROR: Final = 7  # a return code of GAMS
_SECONDS: Final = 60.0


def package_folder(name: str) -> Path | None:
    """The folder of an installed package, which is not imported; None if it is not installed."""
    found = find_spec(name)
    return None if found is None or found.origin is None else Path(found.origin).parent


@cache
def gams_is_licensed() -> bool:
    """Whether the installed GAMS runs an empty model; errors of other kinds count as yes."""
    gams = package_folder("gamspy_base")
    assert gams is not None
    with TemporaryDirectory(prefix="crossfield-gams-") as folder:
        (Path(folder) / "empty.gms").write_bytes(b"")
        command = [str(gams / "gams"), "empty.gms", "lo=0"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, check=False, timeout=_SECONDS)
        except (OSError, subprocess.TimeoutExpired):
            return True
    return done.returncode != _LICENSING_ERROR
