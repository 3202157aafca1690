"""Reading SVG files of layers."""

import re

import numpy as np
from defusedxml import ElementTree

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
NUMBER = re.compile(r"-?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")


def layers_of(path):
    """The root of a file, and its layers by their names."""
    root = ElementTree.fromstring(path.read_bytes())
    groups = root.findall(f"{SVG}g")
    assert all(group.get(f"{INKSCAPE}groupmode") == "layer" for group in groups)
    assert all(group.get(f"{INKSCAPE}label") == group.get("id") for group in groups)
    return root, {group.get("id"): group for group in groups}


def lines_in(group):
    """Points (k, 2) of each line of a group: the ends of all pieces."""
    lines = []
    for path in group.iter(f"{SVG}path"):
        for line in path.get("d").split("M")[1:]:
            start, letter, moves = re.split("([lc])", line)
            steps = numbers(moves).reshape(-1, 1 if letter == "l" else 3, 2)[:, -1]
            lines.append(np.cumsum(np.concatenate([[numbers(start)], steps]), axis=0))
    return lines


def numbers(text):
    return np.array([float(number) for number in NUMBER.findall(text)])
