"""Pictures of fields.

Figures of crosses, streamlines and singularities with matplotlib, layers that fit on a drawing, combing, and
small drawings as plain SVG.
The numbers in a picture come from models/field.
"""
