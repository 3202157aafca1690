"""Puts this folder on the path, so that test modules can import `cases` and `oracles`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from hypothesis import settings

# The same examples in every run: a chance find must not decide whether a change passes. `--hypothesis-profile=fuzz` draws others.
settings.register_profile("same", derandomize=True)
settings.register_profile("fuzz", derandomize=False, print_blob=True)
settings.load_profile("same")
