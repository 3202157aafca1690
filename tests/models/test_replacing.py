"""Only files that crossfield wrote and nobody changed are replaced or removed, all together at the end."""

import errno
import os
import subprocess
import sys
import tempfile
from contextlib import nullcontext
from itertools import count
from pathlib import Path

import crossfield as cf
import pytest
from crossfield.models import storage
from crossfield.models.storage import (
    remove_unfinished,
    replace_results,
    replacing,
    temporary_folder,
    write_bytes,
)
from crossfield.models.written_files import LIST, is_unchanged
from folders import contents, interrupt_call

pytestmark = pytest.mark.smoke


def write_results(folder, files, planned=None, **options):
    """Write files by name into a folder, together."""
    with replace_results(folder, files if planned is None else planned, **options) as new:
        for name, data in files.items():
            path = new.path / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)


@pytest.mark.parametrize("name", ["sub/a.json", "line\nend", "back\\slash", "ä", "\udcff"])
def test_a_file_of_any_name_is_crossfields_until_it_is_edited(tmp_path, name):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    for write in (lambda: write_bytes(path, b"new"), lambda: write_results(tmp_path, {name: b"new"})):
        path.unlink(missing_ok=True)
        write()
        assert is_unchanged(path)
        write()
        path.write_bytes(b"edited")
        with pytest.raises(cf.OutputError, match="--force"):
            write()
        assert contents(tmp_path) == {name: b"edited"}


@pytest.mark.parametrize("force", [False, True])
def test_links_are_not_followed_and_folders_stay(tmp_path, force):
    user, folder, link = tmp_path / "user", tmp_path / "out", tmp_path / "out" / "link"
    user.write_bytes(b"user's")
    (folder / "folder").mkdir(parents=True)
    link.symlink_to(user)
    with pytest.raises(cf.OutputError, match="is a folder"):
        write_bytes(folder / "folder", b"new", force=force)
    with nullcontext() if force else pytest.raises(cf.OutputError, match="--force"):
        write_bytes(link, b"new", force=force)
    assert user.read_bytes() == b"user's"


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.unlink(),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(path.read_bytes()[:-30]),
        lambda path: path.write_bytes(b"\xff\0" * 1000),
        lambda path: path.write_bytes(path.read_bytes().replace(b"  a", b"  ../a")),
    ],
)
def test_a_damaged_list_makes_no_file_crossfields(tmp_path, damage):
    write_bytes(tmp_path / "a", b"old")
    damage(tmp_path / LIST)
    with pytest.raises(cf.OutputError, match="--force"):
        write_bytes(tmp_path / "a", b"new")
    assert (tmp_path / "a").read_bytes() == b"old"
    for data in (b"1", b"2"):  # and the list goes on
        write_bytes(tmp_path / "b", data)
    assert (tmp_path / "b").read_bytes() == b"2"


def test_a_list_that_is_a_link_is_not_followed(tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_bytes(b"user's\n")
    (tmp_path / LIST).symlink_to(elsewhere)
    with pytest.raises(cf.OutputError):
        write_bytes(tmp_path / "a", b"new")
    assert elsewhere.read_bytes() == b"user's\n"
    assert not (tmp_path / "a").exists()


def test_earlier_files_that_are_no_longer_part_of_the_result_go(tmp_path):
    planned = ["a", "b", "c", "d"]
    write_results(tmp_path, {"a": b"1", "b": b"1", "c": b"1"}, planned)
    (tmp_path / "other").write_bytes(b"user's")
    with replace_results(tmp_path, planned) as new:
        (new.path / "a").write_bytes(b"2")
        (new.path / "c").write_bytes(b"2")
        new.kept.add("c")
    assert contents(tmp_path) == {"a": b"2", "c": b"1", "other": b"user's"}


def test_a_failure_changes_nothing_and_names_files_in_the_folder(tmp_path):
    write_results(tmp_path, {"a": b"1"})

    def fail():
        with replace_results(tmp_path, ["a", "b"]) as new:
            (new.path / "b").write_bytes(b"2")
            raise cf.InputError("is bad", file=new.path / "b")

    with pytest.raises(cf.InputError) as failure:
        fail()
    assert str(failure.value) == f"{tmp_path / 'b'}: is bad"
    assert contents(tmp_path) == {"a": b"1"}


def test_results_are_not_lost_to_a_file_that_came_meanwhile(tmp_path):
    def write_slowly():
        with replace_results(tmp_path, ["a", "b"]) as new:
            for name in "ab":
                (new.path / name).write_bytes(b"new")
            (tmp_path / "b").write_bytes(b"user's")

    with pytest.raises(cf.OutputError, match="new-results"):
        write_slowly()
    assert contents(tmp_path) == {"b": b"user's", "new-results/a": b"new", "new-results/b": b"new"}


def test_a_file_that_came_during_the_work_is_not_replaced(tmp_path):
    def write_slowly():
        with replacing(tmp_path / "a") as stream:
            stream.write(b"new")
            (tmp_path / "a").write_bytes(b"user's")

    with pytest.raises(cf.OutputError, match="is not crossfield's"):
        write_slowly()
    assert contents(tmp_path) == {"a": b"user's"}


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("step", [11, pytest.param(3, marks=pytest.mark.slow)])
def test_ctrl_c_at_any_moment_leaves_all_earlier_files_or_all_new_ones(step, tmp_path):
    earlier, later = {"a": b"1", "gone": b"1"}, {"a": b"2", "come": b"2"}
    planned, ends = [*earlier, *later], set()
    for number in count(1, step):
        write_results(tmp_path, earlier, planned)
        sys.setprofile(interrupt_call(number))
        try:
            write_results(tmp_path, later, planned)
        except KeyboardInterrupt:
            sys.setprofile(None)
            remove_unfinished()
        else:
            break
        finally:
            sys.setprofile(None)
        found = contents(tmp_path)
        assert found in (earlier, later)
        ends.add(found == later)
    assert ends == {False, True}


HOLD = """
import sys, time
from crossfield.models.storage import replace_results, replacing
with replacing(sys.argv[1] + "/a") as stream, replace_results(sys.argv[1], ["b"]) as new:
    stream.write(b"half")
    (new.path / "b").write_bytes(b"half")
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="takes locks of POSIX")
@pytest.mark.parametrize(
    "container", [(), pytest.param(("unshare", "-Upfr", "--kill-child"), marks=pytest.mark.needs("unshare"))]
)
def test_unfinished_files_stay_while_their_process_lives_also_in_another_container(tmp_path, container):
    """Two containers can have one host name, and processes of the same numbers."""
    command = [*container, sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            unfinished = contents(tmp_path)
            assert len(unfinished) == 2
            storage.remove_dead.cache_clear()
            write_bytes(tmp_path / "c", b"mine")
            assert contents(tmp_path) == unfinished | {"c": b"mine"}
        finally:
            process.kill()
    process.wait()
    for _ in range(600):  # the process in the container ends a little after its parent
        storage.remove_dead.cache_clear()
        write_bytes(tmp_path / "c", b"mine")
        if len(contents(tmp_path)) == 1:
            break
    assert contents(tmp_path) == {"c": b"mine"}


def test_temporary_files_of_other_programs_stay(tmp_path):
    others = {".x.part": b"", ".x.crossfield-0123.part": b"", ".x.0123abcd-17-0123abcd.part": b""}
    for name, data in others.items():
        (tmp_path / name).write_bytes(data)
    storage.remove_dead.cache_clear()
    write_bytes(tmp_path / "a", b"")
    assert contents(tmp_path) == others | {"a": b""}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is always full")
@pytest.mark.parametrize("is_linked", [False, True])
def test_a_full_disk_of_temporary_files_is_named_with_a_remedy(is_linked, tmp_path, monkeypatch):
    """The folder of temporary files may be a link, and what a copy reads lies elsewhere."""
    (tmp_path / "temporary").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / ("link" if is_linked else "temporary")))

    def copy():
        with temporary_folder() as folder:
            # As shutil.copyfile ends on a full disk: it names its source first.
            raise OSError(errno.ENOSPC, "full", str(tmp_path / "source"), None, str(folder / "copy"))

    def write(path):
        with temporary_folder() as folder:
            (folder / "full").symlink_to("/dev/full")
            (path or folder / "full").write_bytes(b"x")

    with pytest.raises(cf.OutputError, match=r"no room for temporary files.* set TMPDIR to another folder"):
        write(None)
    with pytest.raises(cf.OutputError, match=r"no room for temporary files"):
        copy()
    with pytest.raises(FileNotFoundError):
        write(tmp_path / "none" / "file")
