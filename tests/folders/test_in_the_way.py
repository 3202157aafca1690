"""Every command and every function that writes: files in the way, files that are read, worse results."""

import re
from dataclasses import replace
from functools import cache

import crossfield as cf
import pytest
from command_line import invoke
from folders import contents
from instance_kinds import kind
from loops import for_each
from PIL import Image
from writing_commands import words, write_inputs


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A folder with inputs for the commands."""
    return write_inputs(tmp_path_factory.mktemp("source"))


QUICK = ("instance", "mask", "export", "greedy", "read mesh", "draw")
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("shade", "solver", "prove", "run")]


@pytest.mark.parametrize("name", [*QUICK, *SLOW])
def test_no_file_of_the_user_is_replaced_unless_forced(name, source, tmp_path, capsys):
    folder = tmp_path / "out"
    folder.mkdir()
    command = words(name, folder, source)
    for _ in range(1 if name == "run" else 2):  # its own files are replaced; runs have tests of that below
        assert invoke(command) == 0
    written = contents(folder)
    capsys.readouterr()
    for file in {re.sub(r"/.*[.]", "/", name): name for name in written}.values():  # one of many models
        (folder / file).write_bytes(b"user's")
        before = contents(folder)
        assert invoke(command) == 1, file
        err = capsys.readouterr().err
        assert file in err
        assert "another folder" in err
        assert "--force" in err
        assert contents(folder) == before
        (folder / file).write_bytes(written[file])
    victim = min(written)
    (folder / victim).write_bytes(b"user's")
    (folder / "notes.txt").write_bytes(b"user's")
    assert invoke([*command, "--force"]) == 0
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
    "f.rawfield": cf.write_field,
    "i.json": lambda field, path, **more: cf.write_instance(field.instance, path, **more),
    "c.npz": lambda field, path, **more: cf.write_certificate(proof_on(field), path, **more),
    "p.nl": lambda field, path, **more: cf.write(problem_on(field), path, **more),
    "p.mod.gz": lambda field, path, **more: cf.write(problem_on(field), path, **more),
    "f.svg": lambda field, path, **more: cf.draw(field, path, kind="crosses", **more),
    "i.png": lambda field, path, **more: cf.draw(field.instance, path, **more),
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


NAMED = {
    ".json": lambda field, path: cf.write_instance(field.instance, path),
    ".npz": cf.write_field,
    ".certificate.npz": lambda field, path: cf.write_certificate(proof_on(field), path),
    ".lp": lambda field, path: cf.write(problem_on(field), path),
    ".png": lambda field, path: cf.draw(field, path, kind="crosses"),
    "": lambda field, path: cf.write(problem_on(field), path, formats=["nl", "gms", "lp", "mps"]),
    "/surface": lambda field, path: cf.write_surface(surface_over(field), path),
}
"""Functions that write, by the end of a name that each of them takes."""


@for_each("name", ["x.bmp", "x", "x.txt", "x.npz.bak"])
def test_functions_write_names_of_their_own_formats_alone(name, source, tmp_path):
    for suffix, write in NAMED.items():
        if suffix.startswith("."):
            with pytest.raises(cf.InputError, match=r"use |choose "):
                write(cf.read_field(source / "good.npz"), tmp_path / name)
    assert contents(tmp_path) == {}


@pytest.mark.parametrize("name", ["null\0byte", "long" * 1000], ids=["null byte", "long"])
def test_names_that_no_file_can_have_are_refused(name, source, tmp_path):
    for suffix, write in NAMED.items():
        with pytest.raises(cf.OutputError, match=r"another (name|folder)"):
            write(cf.read_field(source / "good.npz"), tmp_path / f"{name}{suffix}")
    assert list(tmp_path.iterdir()) == []


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
        "shade tiny.greedy.field.npz --underlay drawing.png -o .",
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
    command = words("export", folder, source)
    assert invoke(command) == 0
    before = contents(folder)
    assert invoke([command[0], str(folder / "tiny.instance.json"), *command[2:]]) == 0
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

    little, much = (cf.prove(kind("contradicting"), limits=cf.Limits(gap=gap)) for gap in (0.9, 0.0))
    assert little.bound < much.bound
    for proof in (little, much):
        cf.write_certificate(proof, tmp_path / "c.npz")
    with pytest.raises(cf.OutputError, match="a proof of a higher bound"):
        cf.write_certificate(little, tmp_path / "c.npz")
    cf.write_certificate(cf.prove(good.instance), tmp_path / "c.npz")  # of another instance
    assert cf.read_certificate(tmp_path / "c.npz").field.instance.sha256 == good.instance.sha256


def test_prove_keeps_the_better_field_and_the_better_certificate(tmp_path, capsys):
    command = ["prove", "mouse", "--size", "8", "-o", str(tmp_path), "--gap"]
    assert invoke([*command, "0"]) == 0
    best = contents(tmp_path)
    assert invoke([*command, "0.9"]) == 0
    assert "kept the earlier mouse.proof.certificate.npz (bound" in capsys.readouterr().err
    assert contents(tmp_path) == best
    assert invoke([*command, "0.9", "--force"]) == 0
    assert "kept" not in capsys.readouterr().err
    assert contents(tmp_path) != best


WORSE = pytest.param(cf.Limits(30.0, gap=0.9), marks=pytest.mark.slow)


@pytest.mark.parametrize("limits", [WORSE, cf.Limits(1e-6)])
def test_answers_of_a_solver_stay_with_their_log(tmp_path, limits):
    """At a gap of 90 %, HiGHS ends with a point that is far from the optimum; without time, with none."""
    problem = cf.formulate(cf.sample("mouse", 3), "milp-mccormick")
    solved = cf.solve(problem, folder=tmp_path)
    best = contents(tmp_path)
    worse = cf.solve(problem, folder=tmp_path, limits=limits)
    assert worse.point is None or worse.objective > solved.objective * 1.1
    assert contents(tmp_path) == best
    cf.solve(problem, folder=tmp_path, limits=limits, force=True)
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
    instance = cf.sample("skew", 4)
    first = cf.run(instance, tmp_path, limits=cf.Limits(8.0))
    assert first.bound is not None
    kept = {name: contents(tmp_path)[name] for name in ("certificate.npz", "lowest.npz")}
    second = cf.run(instance, tmp_path, limits=cf.Limits(0.1))
    assert second.bound is not None
    assert second.bound >= first.bound
    assert second.best.field.energy().total <= first.best.field.energy().total * (1 + 1e-9)
    if second.best.method == "earlier run":
        assert {name: contents(tmp_path)[name] for name in kept} == kept
