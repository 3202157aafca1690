"""Any commands in any order, interrupted at any file, in a folder that also has files of the user.

Nothing of the user's changes, nothing better is lost, no file is half written, and all can be repeated.
"""

import json
import os
import signal
import tempfile
from functools import cache
from pathlib import Path

import crossfield as cf
import pytest
from command_line import invoke
from crossfield.models.written_files import MARK, is_unchanged
from folders import contents
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from interruption import run_command
from PIL import Image
from writing_commands import COMMANDS, words, write_inputs

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks processes")

WRITING = sorted(COMMANDS.keys() - {"run", "solver"})  # those take seconds


@cache
def inputs():
    """A folder with the inputs of the commands, which lie beside the folder that they write to.

    Each command has run once, so that forked processes load nothing.
    """
    folder = write_inputs(Path(tempfile.mkdtemp(prefix="crossfield-test-")))
    (folder / "warm").mkdir()
    for name in WRITING:
        assert invoke(words(name, folder / "warm", folder, "--force")) == 0
    return folder


NAMES = [
    *("tiny.json", "mask.png", "f.npz", "f.obj", "f.sings", "overlay.svg", "drawing.png", "surface.json"),
    *("normals.png", "tiny.instance.json", "tiny.milp-mccormick.lp", "tiny.milp-mccormick.highs.start.sol"),
    *("tiny.proof.certificate.npz", "tiny.proof.field.npz", "tiny.greedy.field.npz", "tiny.proof.json"),
    *("notes.txt", ".x.part", ".files.part", "tiny.milp-mccormick.highs.sol"),
]
"""Names of files of the user; crossfield writes most of them, too."""

ENDS = st.none() | st.tuples(st.sampled_from([signal.SIGINT, signal.SIGKILL]), st.integers(1, 80))
ONE_IN_FOUR = st.sampled_from([False, False, False, True])


def is_unfinished(name):
    """A killed command left this file unfinished, or the folder that holds it."""
    return bool(MARK.fullmatch(name.split("/")[0]))


def quality(path):
    """What a file holds and how good it is, greater is better; None for files without a measure."""
    if path.name.endswith("certificate.npz"):
        certificate = cf.read_certificate(path)
        return certificate.field.instance.sha256, certificate.bound
    if path.suffix == ".npz":
        field = cf.read_field(path)
        return field.instance.sha256, -field.energy().total
    return None


def check_whole(path):
    """A file of crossfield can be read."""
    if path.suffix == ".npz":
        quality(path)
    elif path.suffix == ".json":
        json.loads(path.read_text("utf-8"))
    elif path.suffix == ".png":
        with Image.open(path) as picture:
            picture.load()
    else:
        assert path.read_bytes()


class Folder(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.place = tempfile.TemporaryDirectory(prefix="crossfield-test-")
        self.folder = Path(self.place.name)
        self.user = {}
        self.given = set()

    @rule(name=st.sampled_from(NAMES), data=st.binary(max_size=9))
    def write(self, name, data):
        self.user[name] = data
        (self.folder / name).write_bytes(data)

    @precondition(lambda self: contents(self.folder))
    @rule(data=st.data())
    def edit(self, data):
        name = data.draw(st.sampled_from(sorted(contents(self.folder))))
        if not is_unfinished(name):
            self.user[name] = (self.folder / name).read_bytes() + b" "
            (self.folder / name).write_bytes(self.user[name])

    @precondition(lambda self: contents(self.folder))
    @rule(data=st.data())
    def delete(self, data):
        name = data.draw(st.sampled_from(sorted(contents(self.folder))))
        (self.folder / name).unlink()
        self.user.pop(name, None)

    @rule(name=st.sampled_from(WRITING), ends=ENDS, force=ONE_IN_FOUR)
    def command(self, name, ends, force):
        self.given.add(name)
        before = contents(self.folder)
        good = {
            one: quality(self.folder / one)
            for one in before
            if one not in self.user and not is_unfinished(one)
        }
        arguments = words(name, self.folder, inputs(), *["--force"] * force)
        code = run_command(arguments, self.folder, *(ends or ()))
        after = contents(self.folder)
        if force:
            self.user = {one: data for one, data in self.user.items() if after.get(one) == data}
        else:
            for one, was in good.items():
                if was is not None and one in after:
                    now = quality(self.folder / one)
                    assert now[0] != was[0] or now[1] >= was[1] - 1e-9 * abs(was[1]), one
        parts = {one for one in after if is_unfinished(one)}
        if code != -signal.SIGKILL:
            assert not parts - before.keys()
        if code == 0:
            assert not parts
        elif code == 1 and ends is None:  # refused
            assert not force
            assert after == before
            assert self.user
        elif ends is not None:
            assert code in (1, 130, -signal.SIGKILL)

    @invariant()
    def files_of_the_user_stay(self):
        assert {name: (self.folder / name).read_bytes() for name in self.user} == self.user

    @invariant()
    def all_other_files_are_whole_and_known(self):
        for name in contents(self.folder).keys() - self.user.keys():
            if not is_unfinished(name):
                assert is_unchanged(self.folder / name), name
                check_whole(self.folder / name)

    def teardown(self):
        """Without the user's files, every command can be repeated, and leaves nothing unfinished."""
        with self.place:
            for name in self.user:
                (self.folder / name).unlink()
            self.user.clear()
            for name in sorted(self.given):
                self.command(name, None, force=False)


@pytest.mark.slow
def test_commands_in_any_order_lose_nothing_and_write_nothing_by_halves():
    """A failure is shown as it was found: to shrink it would take minutes."""
    inputs()
    phases = [Phase.explicit, Phase.reuse, Phase.generate]
    chosen = settings(max_examples=6, stateful_step_count=15, phases=phases)
    run_state_machine_as_test(Folder, settings=chosen)
