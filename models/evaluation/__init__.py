"""Errors of fields on curves that were hidden from them.

Each curve of a drawing is hidden in turn. The field is made from the other curves and compared with the
hidden one; energies play no part.
"""
