"""Pictures of fields.

Lines, dots, areas and words are marks (`marks`), which two writers draw: `canvas` with matplotlib, for PNG,
PDF and panels with text, and `svg` as plain SVG, for layers on a drawing and for the web.
The numbers in a picture come from models/field.
"""
