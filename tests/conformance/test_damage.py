"""Damaged files of every kind: an error of crossfield that names the file, whatever the bytes."""

import crossfield as cf
import numpy as np
import pytest
from archives import forged, of_numpy
from instance_kinds import kind

PIXELS, FACES, RIGHT = (cf.greedy_field(kind(name)) for name in ("hole", "cube-skewed-box", "cube"))
PROBLEM = cf.formulate(PIXELS.instance, "milp")


def write_answers(folder):
    """The starting points of all solvers, which are read as answers, and lists of names and values."""
    cf.write(PROBLEM, folder, formats=["nl", "mps"], start=PIXELS)
    names, values = PROBLEM.to_arrays().column_names.tolist(), PROBLEM.point(PIXELS).tolist()
    for suffix, between in {"csv": ",", "txt": " = "}.items():
        lines = (f"{name}{between}{value!r}\n" for name, value in zip(names, values, strict=True))
        (folder / f"answer.{suffix}").write_text("".join(lines))
    return sorted([*folder.glob("*.sol"), *folder.glob("*.slx"), *folder.glob("answer.*")])


def write_mesh(path, mesh):
    """A mesh in another format, as trimesh writes it."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)
    return [path]


def write_lines(path, *lines):
    path.write_text("\n".join(lines) + "\n")
    return [path]


def write_certificate(folder):
    cf.write_certificate(cf.prove(kind("full"), work=4000, jobs=1), folder / "it.npz")
    return [folder / "it.npz"]


def read_directions(path):
    """The strokes of a file of directions or edges, on a square of two triangles."""
    corners = ("v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0")
    write_lines(path.with_suffix(".obj"), *corners, "f 1 2 3", "f 3 4 1")
    return cf.read_mesh(path.with_suffix(".obj"), directions=path)


def fields_as(suffix, *fields):
    """A function that writes fields with a suffix."""
    return lambda folder: [
        cf.write_field(field, folder / f"{number}{suffix}") for number, field in enumerate(fields)
    ]


def instances_as(suffix):
    """A function that writes an instance on pixels and one on faces with a suffix."""
    return lambda folder: [
        cf.write_instance(field.instance, folder / f"{number}{suffix}")
        for number, field in enumerate((PIXELS, FACES))
    ]


FILES = {
    "instance.json": (instances_as(".json"), cf.read_instance),
    "instance.npz": (instances_as(".npz"), cf.read_instance),
    "field.json": (fields_as(".json", PIXELS, FACES), cf.read_field),
    "field.npz": (fields_as(".npz", PIXELS, FACES), cf.read_field),
    "rawfield of pixels": (
        fields_as(".rawfield", PIXELS),
        lambda path: cf.read_field(path, on=PIXELS.instance),
    ),
    "rawfield of faces": (fields_as(".rawfield", FACES), lambda path: cf.read_field(path, on=FACES.instance)),
    "rosy": (fields_as(".rosy", RIGHT), lambda path: cf.read_field(path, on=RIGHT.instance)),
    "certificate": (write_certificate, lambda path: cf.read_certificate(path, on=kind("full"))),
    "answers": (write_answers, lambda path: cf.read_solution(path, PROBLEM)),
    "directions": (
        lambda folder: write_lines(folder / "d.csv", "face,x,y,z", "0,1,0,0", "1,2,2,3"),
        read_directions,
    ),
    "sharp": (lambda folder: write_lines(folder / "a.sharp", "2", "1,0,1", "0,1,2"), read_directions),
    "obj": (
        lambda folder: write_lines(folder / "a.obj", "v 0 0 0", "v 1 0 0", "v 1 1 0", "f 1 2 3", "l 1 2"),
        cf.read_mesh,
    ),
    **{
        suffix: (
            lambda folder, suffix=suffix: write_mesh(folder / f"a.{suffix}", FACES.instance.mesh),
            cf.read_mesh,
        )
        for suffix in ("ply", "off", "stl")
    },
}
"""By kind of file: the function that writes some into a folder, and the one that reads one of them."""
ALIKE = [
    {"ply", "off", "stl", "obj"},
    {"field.json", "field.npz", "rawfield of pixels", "rawfield of faces", "rosy"},
]
"""Kinds whose readers take files of each other."""
PIECES = [b"", b"-1", b"9" * 30, b"nan", b"\n", b" ", b"\0", b"\xff", b"{", b"1e999", b"0"]


def mutations(content, rng, count):
    """Copies of bytes with some of them cut out, replaced, or doubled, and with the end cut off."""
    for _ in range(count):
        changed = bytearray(content)
        for _ in range(rng.integers(1, 4)):
            at, width = rng.integers(len(changed) + 1), rng.integers(0, 9)
            changed[at : at + width] = PIECES[rng.integers(len(PIECES))]
        yield bytes(changed if rng.random() < 0.7 else changed[: rng.integers(len(changed) + 1)])


def complaint_about(read, path):
    """The error with which a file is refused; empty if it is read. No other error is allowed."""
    try:
        read(path)
    except cf.CrossfieldError as error:
        return str(error)
    return ""


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """The names and bytes of good files, by kind."""
    folders = {name: tmp_path_factory.mktemp("files") for name in FILES}
    return {
        name: {path.name: path.read_bytes() for path in write(folders[name])}
        for name, (write, _) in FILES.items()
    }


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.slow)])
def test_whatever_the_bytes_the_error_is_ours_and_names_the_file(name, count, examples, tmp_path):
    read, rng = FILES[name][1], np.random.default_rng(count)
    for path, whole in ((tmp_path / title, whole) for title, whole in examples[name].items()):
        path.write_bytes(whole)
        read(path)
        for content in (b"", b"\0" * 50, whole[:-1] * 2, *mutations(whole, rng, count)):
            path.write_bytes(content)
            complaint = complaint_about(read, path)
            assert not complaint or path.name in complaint
            assert "\n" not in complaint
        path.unlink()
        with pytest.raises(cf.CrossfieldError, match="cannot be read: no such file"):
            read(path)
        path.mkdir()
        with pytest.raises(cf.CrossfieldError, match=f"{path.name}.*cannot be read: is a directory"):
            read(path)


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_another_kind_is_refused(name, examples, tmp_path):
    _, read = FILES[name]
    for other, files in examples.items():
        if FILES[other][1] is read or any({name, other} <= group for group in ALIKE):
            continue
        for title, content in files.items():
            (tmp_path / title).write_bytes(content)
            with pytest.raises(cf.CrossfieldError, match=title):
                read(tmp_path / title)


ARCHIVES = {"instance.npz": "theta", "field.npz": "alpha"}
"""Archives, and the name of an array of doubles in each."""


@pytest.mark.parametrize("name", ARCHIVES)
def test_archives_that_readers_would_take_differently_are_refused(name, tmp_path, subtests):
    write, read = FILES[name]
    path, _ = write(tmp_path)
    good = path.read_bytes()
    for forgery, forge in forged(ARCHIVES[name]).items():
        with subtests.test(forgery):
            path.write_bytes(forge(good))
            with pytest.raises(cf.InstanceError, match=path.name) as refusal:
                read(path)
            assert str(refusal.value).isprintable()
            assert len(str(refusal.value)) < len(str(tmp_path)) + 200
    for save in (np.savez, np.savez_compressed):
        path.write_bytes(of_numpy(good, save))
        assert getattr(read(path), "instance", read(path)).sha256 == PIXELS.instance.sha256


OTHERS = {
    "a point": lambda field, other, _: cf.formulate(other, "milp").point(field),
    "fixed integers": lambda field, other, _: cf.formulate(other, "milp").with_integers_fixed(field),
    "a search": lambda field, other, _: cf.search(other, rounds=0, jobs=1, start=field),
    "a file": lambda field, other, folder: cf.write(
        cf.formulate(other, "milp"), folder / "a.nl", start=field
    ),
    "files": lambda field, other, folder: cf.write(
        cf.formulate(other, "milp"), folder, formats=["nl"], start=field
    ),
    "a solver": lambda field, other, _: cf.solve(cf.formulate(other, "milp"), "highs", start=field),
}
"""Calls that take a field of the same instance."""


@pytest.mark.parametrize("call", OTHERS)
def test_a_field_on_another_instance_is_refused(call, tmp_path):
    field = cf.greedy_field(kind("full"))
    others = [kind("square"), kind("cube-skewed-box")]
    if call != "a search":  # which takes one on the same sketch in the other gauge
        others.append(kind("full-box"))
    for other in others:
        with pytest.raises(cf.InstanceError, match=r"on another instance .kind: .* not on this one"):
            OTHERS[call](field, other, tmp_path)
    assert not any(tmp_path.iterdir())
