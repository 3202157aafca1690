"""From a drawing to an instance.

Readers of SVG, bitmaps, .scap and .curves, the choice of curvature lines, the cover of pixels by strokes, the
outline of a drawing, and the samples. No energy and no field: the result is an Instance.
"""
