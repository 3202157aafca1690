"""Limits on external files: the one table for all readers of inputs.

A file beyond a limit is refused with a message that states the limit, before work or memory is spent. Each
limit is far above the needs of sketches, instances and fields of the largest grid.
"""

from __future__ import annotations

from typing import Final

MAX_BYTES: Final = 200_000_000  # bytes of a file, except for archives of arrays (MAX_ARCHIVE)

# SVG
MAX_TAGS: Final = 1_000_000  # tags and attributes of a drawing
MAX_ELEMENTS: Final = 100_000  # elements drawn, counting every repetition by `use`
MAX_USES: Final = 10_000  # copies made by `use`
MAX_DEPTH: Final = 50  # elements inside of one another, counting copies; the renderer nests its calls as deep
MAX_LAYERS: Final = 5000  # clips, masks and opacities, each as a share of the page
MAX_DATA: Final = 10_000_000  # characters of path data, point lists, styles and transforms of elements
MAX_CURVES: Final = 500_000  # segments of all shapes, counting every repetition by `use`
MAX_LENGTH: Final = 64  # characters of a length or a colour
MAX_TRANSFORM: Final = 1000  # characters of a transform
LEAST_LENGTH: Final = 1e-9  # width and height of a page: the quotient of two smaller lengths is not finite
MAX_STYLE: Final = 1_000_000  # characters of style sheets
MAX_RULE_CHECKS: Final = 1_000_000  # comparisons of style rules with elements

# Strokes on the grid
MAX_SEGMENTS: Final = 5_000_000  # straight segments that curves are cut into
MAX_PIECES: Final = 40_000_000  # pieces of segments between pixel edges
MAX_LINES: Final = 500_000  # lines of a .scap file, one per sample of a pen stroke

# Pictures
MAX_SIDE: Final = 40_000
MAX_PIXELS: Final = 80_000_000

# Instances and fields
MAX_GRID: Final = 9999  # rows and columns of a grid
MAX_ARCHIVE: Final = 1 << 31  # bytes of an .npz, packed and unpacked: far more than a solvable field takes
MAX_HEAD: Final = 1 << 20  # bytes of the text in an .npz
MAX_NUMBER: Final = 40  # characters of a number in a .rawfield, on average; a double has 24 at most

# Solutions
MAX_SOLUTION: Final = 1 << 31  # bytes of a solution file, packed and unpacked: 50 per column of 40 million
