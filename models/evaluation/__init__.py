"""How well fields tell what was hidden from them.

A curve of the drawing is hidden, the field is made from the others, and the curve is the judge.
No energy is consulted.
"""
