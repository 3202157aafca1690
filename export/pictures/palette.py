"""The one palette: colours of lines, strokes and singularities in every picture, plot and page."""

from __future__ import annotations

from typing import Final

LIGHT: Final = {
    "u": "#00798c",
    "v": "#e1812c",
    "stroke": "#b3261e",
    "plus": "#d1242f",
    "minus": "#3056d3",
}
"""Colours on white of both families of lines, strokes, and singularities of an index above and below 0.

Teal and orange differ for all common kinds of colour blindness.
"""
DARK: Final = {
    "u": "#41b3c5",
    "v": "#f0a35e",
    "stroke": "#ff7b72",
    "plus": "#ff6b70",
    "minus": "#7c9cff",
}
"""Colours of the same parts on dark pages."""

ANGLES: Final = ("#000004", "#51127c", "#b73779", "#fc8961", "#fcfdbf")
"""Colours of angles between the lines of 0, 22.5, ..., 90 degrees: the map magma."""
