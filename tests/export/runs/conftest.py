"""The run that several tests look at."""

import io
from contextlib import redirect_stderr, redirect_stdout

import pytest


@pytest.fixture(scope="session")
def two_parts(tmp_path_factory):
    """Folder of a run on a sketch whose mask has two parts, its exit code, output and errors, and its files.

    On eight pixels and with a small weight the MILP is solved long before the time limit.
    Tests may add files.
    """
    from command_line import invoke
    from folders import contents
    from PIL import Image, ImageDraw

    folder = tmp_path_factory.mktemp("run")
    sketch, mask = Image.new("L", (60, 40), 255), Image.new("L", (60, 40), 0)
    for line in ((5, 5, 55, 35), (5, 35, 55, 5), (8, 3, 8, 37)):
        ImageDraw.Draw(sketch).line(line, fill=0, width=3)
    for box in ((0, 0, 19, 19), (40, 20, 59, 39)):
        ImageDraw.Draw(mask).rectangle(box, fill=255)
    sketch.save(folder / "cross.png")
    mask.save(folder / "mask.png")
    options = ["--size", "6", "--stroke-weight", "0.2", "--time-limit", "10", "--threads", "1"]
    sketch = [str(folder / "cross.png"), "--mask", str(folder / "mask.png")]
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = invoke(["run", *sketch, *options, "-o", str(folder / "out")])
    return folder / "out", (code, out.getvalue(), err.getvalue()), contents(folder / "out")
