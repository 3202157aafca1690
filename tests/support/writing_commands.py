"""Commands that write to a folder, and a folder with their inputs beside it."""

from dataclasses import replace

import crossfield as cf
import numpy as np
from cases import write_point

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40" fill="none" stroke="black">'
    '<path d="M5 5H55V35H5Z M5 20H55"/></svg>'
)
READ = "--manifest {source}/set/tiny.milp-mccormick.manifest.json -o {folder}"
COMMANDS = {
    "instance": "instance {source}/tiny.json -o {folder}/tiny.json",
    "other instance": "instance {source}/other.json -o {folder}/tiny.json",
    "mask": "instance {source}/drawing.svg --size 6 -o {folder}/mask.png",
    "export": "export {source}/tiny.json -f milp-mccormick -F nl -F mod -o {folder}",
    "export with start": "export {source}/tiny.json -f milp-mccormick -F lp --start {source}/good.npz "
    "-o {folder}",
    "greedy": "solve {source}/tiny.json -m greedy -o {folder}",
    "greedy of another": "solve {source}/other.json -m greedy -o {folder}",
    "solver": "solve {source}/tiny.json -f milp-mccormick --time-limit 20 -o {folder}",
    "prove": "prove {source}/tiny.json -o {folder}",
    "read good": f"read {{source}}/good.sol {READ}/f.npz",
    "read bad": f"read {{source}}/bad.sol {READ}/f.npz",
    "read mesh": f"read {{source}}/good.sol {READ}/f.rawfield",
    "draw": "draw {source}/good.npz --kind crosses -o {folder}/f.png",
    "draw overlay": "draw {source}/good.npz --kind crosses -o {folder}/overlay.svg",
    "shade": "shade {source}/good.npz --side 9 -o {folder}",
    "run": "run {source}/drawing.svg --size 6 --time-limit 8 -o {folder}",  # both stages end
}
"""Command lines by name."""


def words(name, folder, source, *more):
    """The words of a command line."""
    return [*COMMANDS[name].format(folder=folder, source=source).split(), *more]


def write_inputs(folder):
    """Write the inputs of the commands to a folder, and return it: instances, fields, answers, a drawing."""
    mask = np.ones((3, 3), dtype=bool)
    strokes = np.array([[0, 0], [1, 2], [2, 1]])
    tiny = cf.Instance.on_pixels("tiny", mask, strokes, np.array([0.3, 1.2, 2.0]), np.array([1.0, 0.5, 1.0]))
    cf.write_instance(tiny, folder / "tiny.json")
    cf.write_instance(replace(tiny, theta=tiny.theta + 0.1), folder / "other.json")
    (folder / "drawing.svg").write_text(SVG)
    good = cf.greedy_field(tiny)
    bad = cf.CrossField(tiny, good.alpha + 0.05, good.beta, good.p)
    problem = cf.formulate(tiny, "milp-mccormick")
    cf.write(problem, folder / "set", formats=["lp"])
    for name, field in (("good", good), ("bad", bad)):
        cf.write_field(field, folder / f"{name}.npz")
        write_point(folder / f"{name}.sol", problem, problem.point(field))
    return folder
