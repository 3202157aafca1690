"""Where things lie: the source tree, the data of the tests,
and drawings that some machines have beside the checkout.
"""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
GOLDEN = DATA / "golden"
SOLUTIONS = DATA / "solutions"
SHARED = ROOT.parent / "shared"
