"""Files are written under another name and renamed; leftovers of others do not interfere."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from crossfield.models.storage import write_bytes
from folders import contents

pytestmark = pytest.mark.smoke

NOBODY = 65534
AS_NOBODY = f"""
import os, sys
from crossfield.models.storage import write_bytes
os.chdir(sys.argv[1])
os.setegid({NOBODY})
os.seteuid({NOBODY})
write_bytes("a.json", b"mine")
"""


def left_by_the_dead(path):
    """The name of a temporary file beside a path whose process has ended."""
    code = """import sys
from itertools import count
from pathlib import Path
from crossfield.models.storage import neighbour
print(neighbour(Path(sys.argv[1])))"""
    output = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, check=True
    ).stdout
    return Path(output.strip())


@pytest.mark.skipif(os.name == "nt" or os.geteuid() != 0, reason="acts as two users, which only root can")
def test_a_dead_file_of_another_user_does_not_block_a_shared_folder(tmp_path):
    tmp_path.chmod(0o1777)
    dead = left_by_the_dead(tmp_path / "a.json")
    dead.write_bytes(b"half")
    subprocess.run([sys.executable, "-c", AS_NOBODY, str(tmp_path)], check=True)
    assert dead.read_bytes() == b"half"
    assert (tmp_path / "a.json").read_bytes() == b"mine"
    assert write_bytes(tmp_path / "b.json", b"root's").exists()
    subprocess.run([sys.executable, "-c", AS_NOBODY, str(tmp_path)], check=True)


@pytest.mark.parametrize("letter", ["a", "ß", "字", "🙂"])
def test_a_name_as_long_as_the_disk_takes_can_be_written(tmp_path, letter):
    path = tmp_path / (letter * (255 // len(letter.encode())))
    assert write_bytes(path, b"mine").read_bytes() == b"mine"
    assert contents(tmp_path) == {path.name: b"mine"}
