"""From a drawing to an instance.

Readers of SVG, bitmaps, .scap and .curves, which strokes are curvature lines, how much of a pixel a stroke
covers, the outline of a drawing, and the samples. No energy and no field: the product is an Instance.
"""
