"""Places of the source tree and of the data of the tests."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
GOLDEN = DATA / "golden"
SOLUTIONS = DATA / "solutions"
