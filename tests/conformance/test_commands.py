"""Every command on every kind of instance succeeds, or names in one line what it does not take."""

import crossfield as cf
import pytest
from command_line import examples, invoke, listed
from instance_kinds import SMALL, crossed, first_field, is_provable, kind, on_mesh

METHODS = [row["name"] for row in listed()["methods"]]
COMMANDS = {
    "instance": "instance {instance} -o {folder}/again.npz",
    "instance mask": "instance {instance} -o {folder}/mask.png",
    "instance crosses": "instance {instance} --crosses orthogonal --gauge strokes -o {folder}/again.json",
    "export": "export {instance} -o {folder} --start {field} --gzip",
    "export formats": "export {instance} -o {folder} --format lp --format mod --format osil --relax",
    "read": "read {answer} --manifest {manifest} -o {folder}/read.npz",
    "draw field": "draw {field} --kind crosses -o {folder}/field.png",
    "draw instance": "draw {instance} -o {folder}/instance.svg",
    "shade": "shade {field} -o {folder} --side 16",
    "prove": "prove {instance} -o {folder} --gap 1",
    "verify": "verify {models} --program scip",
    "run": "run {instance} -o {folder} --time-limit 0.1",
    **{f"solve {name}": f"solve {{instance}} -m {name} -o {{folder}} --time-limit 0.1" for name in METHODS},
    "solve -f": "solve {instance} -f qp -o {folder} --time-limit 2",
}
"""Command lines; `solve` has one for each method of the table."""
del COMMANDS["solve prove"]  # a command of its own
SLOW = {"verify": SMALL[::8], "run": SMALL[8::16], "solve -f": SMALL[::8], "solve two-stage": SMALL[::8]}
"""Those that start processes, and the kinds that they get; a run draws for ten seconds."""
ELSEWHERE = {"list", "studio", "library"}
"""Commands that take no instance, or have tests of their own."""


def refuses(command, instance):
    """What a command states about an instance that it does not take; None where it has to take it."""
    if command == "instance mask":
        return "has no page"
    if command == "shade":
        return "on the faces of a mesh" if on_mesh(instance) else None
    if command in {"solve polyvector", "solve bend"}:
        return "finds no fields on the" if on_mesh(instance) or instance.orthogonal else None
    if command == "prove" and not is_provable(instance):
        return "on the faces of a mesh" if instance.pair_weights is None else "has weights of pairs"
    return None


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A function that returns the files of a kind, written once."""
    known = {}

    def files(name):
        if name not in known:
            folder = tmp_path_factory.mktemp("kind")
            instance, field = kind(name), first_field(kind(name))
            problem = cf.formulate(instance, "qp-fixed", p=field.p)
            cf.write(problem, folder / "models", formats=["nl", "lp"], start=field)
            known[name] = {
                "instance": cf.write_instance(instance, folder / "kind.json"),
                "field": cf.write_field(field, folder / "field.npz"),
                "models": folder / "models",
                "manifest": folder / "models" / "kind.qp-fixed.manifest.json",
                "answer": folder / "answer.csv",
            }
            names = problem.to_arrays().column_names.tolist()
            rows = zip(names, problem.point(field).tolist(), strict=True)
            known[name]["answer"].write_text("".join(f"{key},{value!r}\n" for key, value in rows))
        return known[name]

    return files


def test_every_command_is_crossed():
    used = {line.split()[0] for line in COMMANDS.values()}
    assert used | ELSEWHERE == {name.split()[0] for name, _ in examples()}


@pytest.mark.parametrize(
    "command, name",
    [
        *crossed([command for command in COMMANDS if command not in SLOW], SMALL[2::3], every=3),
        *(pytest.param(command, name, marks=pytest.mark.slow) for command in SLOW for name in SLOW[command]),
    ],
)
def test_a_command_succeeds_or_names_what_it_does_not_take(command, name, prepared, tmp_path, capsys):
    folder = tmp_path / "out"
    folder.mkdir()
    arguments = COMMANDS[command].format(folder=folder, **prepared(name)).split()
    capsys.readouterr()
    code = invoke(arguments)
    error, reason = capsys.readouterr().err, refuses(command, kind(name))
    assert "internal error" not in error
    if reason is None:
        assert code == 0, error
        assert command == "verify" or any(folder.iterdir())
    else:
        assert code == 1
        assert reason in error
        assert error.count("\n") == 1
        assert not any(folder.iterdir())


@pytest.mark.parametrize("name", crossed([name for name in SMALL if on_mesh(kind(name))], every=7))
@pytest.mark.parametrize("command", ["instance", "export", "solve greedy", "prove"])
def test_a_mesh_file_is_taken_like_an_instance(command, name, prepared, tmp_path):
    mesh = kind(name).domain
    text = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    text += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    (tmp_path / "part.obj").write_text("\n".join(text) + "\n")
    files = prepared(name) | {"instance": tmp_path / "part.obj", "folder": tmp_path / "out"}
    (tmp_path / "out").mkdir()
    line = COMMANDS[command].replace(" --start {field}", "")
    assert invoke(line.format(**files).split()) == 0
    assert any((tmp_path / "out").iterdir())
