"""Every command and every function that writes: files in the way, files that are read, worse results."""

import re
from dataclasses import replace
from functools import cache

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.bundle.starts import write_start
from crossfield.export.cli.app import invoke
from folders import contents
from loops import for_each
from PIL import Image

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40" fill="none" stroke="black">'
    '<path d="M5 5H55V35H5Z M5 20H55"/></svg>'
)


@pytest.fixture(scope="module")
def tiny():
    mask = np.ones((3, 3), dtype=bool)
    strokes = np.array([[0, 0], [1, 2], [2, 1]])
    return cf.Instance.on_pixels("tiny", mask, strokes, np.array([0.3, 1.2, 2.0]), np.array([1.0, 0.5, 1.0]))


@pytest.fixture(scope="module")
def source(tiny, tmp_path_factory):
    """A folder with inputs for the commands."""
    folder = tmp_path_factory.mktemp("source")
    cf.write_instance(tiny, folder / "tiny.json")
    (folder / "drawing.svg").write_text(SVG)
    good = cf.greedy_field(tiny)
    bad = cf.CrossField(tiny, good.alpha + 0.05, good.beta, good.p)
    problem = cf.formulate(tiny, "milp-mccormick")
    cf.write_problem(problem, folder / "set", formats=["lp"])
    for name, field in (("good", good), ("bad", bad)):
        cf.write_field(field, folder / f"{name}.npz")
        write_start(problem, field, folder / f"{name}.sol", "highs")
    return folder


COMMANDS = {
    "instance": "instance {source}/tiny.json -o {folder}/tiny.json",
    "mask": "instance {source}/drawing.svg --size 6 -o {folder}/mask.png",
    "export": "export {source}/tiny.json -f milp-mccormick -F nl -F mod -o {folder}",
    "solve by a method": "solve {source}/tiny.json -m greedy -o {folder}",
    "solve by a solver": "solve {source}/tiny.json -f milp-mccormick --time-limit 20 -o {folder}",
    "prove": "prove {source}/tiny.json --gap 0.5 -o {folder}",
    "read": "read {source}/good.sol --manifest {source}/set/tiny.milp-mccormick.manifest.json"
    " -o {folder}/f.rawfield",
    "draw": "draw {source}/good.npz -o {folder}/f.png",
    "shade": "shade {source}/good.npz --side 9 -o {folder}",
    "shade a sketch": "shade {source}/tiny.json --side 9 -o {folder}",
}
SLOW = {"run": "run {source}/drawing.svg --size 6 --time-limit 8 -o {folder}"}  # both stages end
BUT_FOR_SECONDS = re.compile(rb'("seconds": )[0-9.]+|(.*\.log$)')


def run(command, source, folder, *more):
    return invoke([*command.format(source=source, folder=folder).split(), *more])


@pytest.mark.parametrize(
    "command",
    [*COMMANDS.values(), *(pytest.param(command, marks=pytest.mark.slow) for command in SLOW.values())],
    ids=[*COMMANDS, *SLOW],
)
def test_no_file_of_the_user_is_replaced_unless_forced(command, source, tmp_path, capsys):
    folder = tmp_path / "out"
    folder.mkdir()
    assert run(command, source, folder) == 0
    assert run(command, source, folder) == 0  # its own files are replaced
    written = contents(folder)
    capsys.readouterr()
    for name in written:
        (folder / name).write_bytes(b"user's")
        before = contents(folder)
        assert run(command, source, folder) == 1, name
        err = capsys.readouterr().err
        assert name in err
        assert "another folder" in err
        assert "--force" in err
        assert contents(folder) == before
        (folder / name).write_bytes(written[name])
    victim = min(written)
    (folder / victim).write_bytes(b"user's")
    (folder / "notes.txt").write_bytes(b"user's")
    assert run(command, source, folder, "--force") == 0
    assert (folder / victim).read_bytes() != b"user's"
    assert contents(folder).keys() == {*written, "notes.txt"}
    assert (folder / "notes.txt").read_bytes() == b"user's"


@cache
def problem_on(field):
    return cf.formulate(field.instance, "miqp-exact")


@cache
def proof_on(field):
    return cf.prove(field.instance)


@cache
def surface_over(field):
    return cf.surface(field)


FUNCTIONS = {
    "f.npz": cf.write_field,
    "f.rosy": cf.write_field,
    "f.rawfield": cf.write_field,
    "f.ply": cf.write_field,
    "i.json": lambda field, path, **more: cf.write_instance(field.instance, path, **more),
    "c.npz": lambda field, path, **more: cf.write_certificate(proof_on(field), path, **more),
    "p.nl": lambda field, path, **more: cf.write(problem_on(field), path, **more),
    "p.mod.gz": lambda field, path, **more: cf.write(problem_on(field), path, **more),
    "f.svg": cf.draw,
    "f.pdf": lambda field, path, **more: cf.draw(field.instance, path, **more),
    "tiny.milp-mccormick.lp": lambda field, path, **more: cf.write_all(
        field.instance, path.parent, formulations=["milp-mccormick"], **more
    ),
    "surface.obj": lambda field, path, **more: cf.write_surface(
        surface_over(field), path.parent, side=9, **more
    ),
}


@for_each("name", FUNCTIONS)
def test_no_function_replaces_a_file_of_the_user_unless_forced(name, source, tmp_path):
    field, write = cf.read_field(source / "good.npz"), FUNCTIONS[name]
    write(field, tmp_path / name)
    write(field, tmp_path / name)
    written = contents(tmp_path)
    for one in written:
        (tmp_path / one).write_bytes(b"user's")
        before = contents(tmp_path)
        with pytest.raises(cf.OutputError, match="force=True"):
            write(field, tmp_path / name)
        assert contents(tmp_path) == before
        (tmp_path / one).write_bytes(written[one])
    for one in written:
        (tmp_path / one).write_bytes(b"user's")
    write(field, tmp_path / name, force=True)
    assert contents(tmp_path) == written


@for_each("name", ["x.svg", "x", "x.txt", "x.npz.bak"])
def test_functions_write_names_of_their_own_formats_alone(name, source, tmp_path):
    field = cf.read_field(source / "good.npz")
    mask = cf.read_sketch(source / "drawing.svg", size=6)
    for write in (
        lambda path: cf.write_instance(field.instance, path),
        lambda path: cf.write_field(field, path),
        lambda path: cf.write_certificate(proof_on(field), path),
        lambda path: cf.write_mask(mask, path),
        lambda path: cf.write(problem_on(field), path),
    ):
        with pytest.raises(cf.InputError, match=r"use |choose "):
            write(tmp_path / name)
    assert contents(tmp_path) == {}


@for_each("force", [(), ("--force",)])
def test_a_file_that_is_read_is_never_replaced(force, source, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    picture = Image.new("L", (60, 40), 255)
    for column in range(10, 50):
        picture.putpixel((column, 20), 0)
    picture.save("drawing.png")
    field = cf.read_field(source / "good.npz")
    cf.write_instance(field.instance, "tiny.json")
    cf.write_field(field, "tiny.greedy.field.npz")
    before = contents(tmp_path)
    for command in (
        "shade drawing.png --size 8 -o .",
        "instance drawing.png --size 8 -o drawing.png",
        "instance tiny.json --gauge box -o tiny.json",
        "solve tiny.json -m greedy --start tiny.greedy.field.npz -o .",
        "draw tiny.greedy.field.npz --underlay drawing.png -o drawing.png",
    ):
        assert invoke([*command.split(), *force]) == 1, command
        assert "is read by the same command" in capsys.readouterr().err
        assert contents(tmp_path) == before


def test_an_instance_that_a_command_would_write_again_can_be_its_input(source, tmp_path):
    folder = tmp_path / "out"
    assert run(COMMANDS["export"], source, folder) == 0
    before = contents(folder)
    written = folder / "tiny.instance.json"
    assert (
        invoke(["export", str(written), "-f", "milp-mccormick", "-F", "nl", "-F", "mod", "-o", str(folder)])
        == 0
    )
    assert contents(folder) == before


def test_a_worse_field_or_certificate_replaces_no_better_one(source, tmp_path):
    good, bad = (cf.read_field(source / f"{name}.npz") for name in ("good", "bad"))
    cf.write_field(bad, tmp_path / "f.npz")
    cf.write_field(good, tmp_path / "f.npz")
    with pytest.raises(cf.OutputError, match="a field of lower energy"):
        cf.write_field(bad, tmp_path / "f.npz")
    cf.write_field(bad, tmp_path / "f.npz", force=True)
    assert cf.read_field(tmp_path / "f.npz").alpha.tolist() == bad.alpha.tolist()
    other = cf.CrossField(replace(good.instance, w=good.instance.w / 2), bad.alpha, bad.beta, bad.p)
    cf.write_field(other, tmp_path / "f.npz")  # on another instance: not comparable

    mouse = cf.sample("mouse", 5)
    little, much = (cf.prove(mouse, limits=cf.Limits(gap=gap)) for gap in (0.9, 0.0))
    assert little.bound < much.bound
    for proof in (little, much):
        cf.write_certificate(proof, tmp_path / "c.npz")
    with pytest.raises(cf.OutputError, match="a proof of a higher bound"):
        cf.write_certificate(little, tmp_path / "c.npz")
    cf.write_certificate(cf.prove(good.instance), tmp_path / "c.npz")  # of another instance
    assert cf.read_certificate(tmp_path / "c.npz").field.instance.sha256 == good.instance.sha256


def test_prove_keeps_the_better_field_and_the_better_certificate(tmp_path, capsys):
    def prove(gap, *more):
        command = ["prove", "mouse", "--size", "5", "--gap", gap, "-o", str(tmp_path), "--json", *more]
        assert invoke(command) == 0
        return capsys.readouterr().err

    prove("0")
    best = contents(tmp_path)
    assert "kept the earlier mouse.proof.certificate.npz (bound" in prove("0.9")
    assert contents(tmp_path) == best
    assert "kept" not in prove("0.9", "--force")
    assert contents(tmp_path) != best


def test_answers_of_a_solver_stay_with_their_log(tmp_path):
    """At a gap of 90 %, HiGHS ends with a point that is far from the optimum."""
    problem = cf.formulate(cf.sample("mouse", 3), "milp-mccormick")
    solved = cf.solve(problem, folder=tmp_path)
    best = contents(tmp_path)
    worse = cf.solve(problem, folder=tmp_path, limits=cf.Limits(30.0, gap=0.9))
    assert worse.objective > solved.objective * 1.1
    assert contents(tmp_path) == best
    cf.solve(problem, folder=tmp_path, limits=cf.Limits(30.0, gap=0.9), force=True)
    assert contents(tmp_path) != best


def test_a_solve_without_an_answer_keeps_earlier_ones_and_says_so(source, tmp_path, capsys):
    problem = cf.formulate(cf.read_instance(source / "tiny.json"), "milp-mccormick")
    solved = cf.solve(problem, folder=tmp_path)
    best = contents(tmp_path)
    unsolved = cf.solve(problem, folder=tmp_path, limits=cf.Limits(1e-6))
    assert solved.point is not None
    assert unsolved.point is None
    assert contents(tmp_path) == best
    cf.solve(problem, folder=tmp_path, limits=cf.Limits(1e-6), force=True)
    assert contents(tmp_path) != best


@pytest.mark.slow
def test_a_painted_mask_can_be_given_back_and_stays(source, tmp_path, capsys):
    command = ["run", str(source / "drawing.svg"), "--size", "6", "--time-limit", "0.5", "-o", str(tmp_path)]
    assert invoke(command) == 0
    mask = tmp_path / "mask.png"
    with Image.open(mask) as picture:
        painted = picture.copy()
    painted.paste(0, (0, 0, 30, 40))
    painted.save(mask)
    before = contents(tmp_path)
    assert invoke(command) == 1
    assert contents(tmp_path) == before
    assert invoke([*command, "--mask", str(mask)]) == 0
    after = contents(tmp_path)
    assert after["mask.png"] == before["mask.png"]
    assert after["field.npz"] != before["field.npz"]
    assert b"mask.png" in after["index.html"]


@pytest.mark.slow
def test_a_shorter_run_loses_neither_the_certificate_nor_the_lowest_field(tmp_path):
    instance = cf.sample("mouse", 8)
    first = cf.run(instance, tmp_path, limits=cf.Limits(20.0))
    assert first.proven is not None
    kept = {name: contents(tmp_path)[name] for name in ("certificate.npz", "lowest.npz")}
    second = cf.run(instance, tmp_path, limits=cf.Limits(0.1))
    assert second.proven is not None
    assert second.proven.bound >= first.proven.bound
    assert second.best.field.energy().total <= first.best.field.energy().total * (1 + 1e-9)
    if second.best.method == "earlier run":
        assert {name: contents(tmp_path)[name] for name in kept} == kept


@pytest.mark.parametrize("name", ["null\0byte", "long" * 1000], ids=["null byte", "long"])
def test_names_that_no_file_can_have_are_refused(name, tmp_path):
    instance = cf.sample("skew", 5)
    field = cf.greedy_field(instance)
    problem = cf.formulate(instance, "milp-mccormick")
    for write in (
        lambda: cf.write_instance(instance, tmp_path / f"{name}.json"),
        lambda: cf.write_field(field, tmp_path / f"{name}.npz"),
        lambda: cf.write(problem, tmp_path / f"{name}.lp"),
        lambda: cf.draw(field, tmp_path / f"{name}.png"),
        lambda: cf.write_problem(problem, tmp_path / name),
        lambda: cf.write_surface(cf.surface(field), tmp_path / name),
    ):
        with pytest.raises(cf.OutputError, match=r"another (name|folder)"):
            write()
    assert list(tmp_path.iterdir()) == []
