"""Archives of arrays: what NumPy and crossfield write is read, everything else is refused."""

import numpy as np
import pytest
from archives import forged, of_numpy
from crossfield.models.errors import InstanceError
from crossfield.models.field.file import read_field, write_field
from crossfield.models.instance.file import read_instance, write_instance
from crossfield.models.instance.instance import Instance
from crossfield.models.search.greedy import greedy_field

INSTANCE = Instance.on_pixels("tiny", np.ones((2, 2), bool), [[0, 0], [1, 1]], [0.3, 1.2], [1.0, 0.5])
KINDS = {
    "field": ("alpha", read_field, lambda path: write_field(greedy_field(INSTANCE), path)),
    "instance": ("theta", read_instance, lambda path: write_instance(INSTANCE, path)),
}


@pytest.fixture(params=KINDS)
def kind(request, tmp_path):
    """The name of an array of doubles, the reader, and the path of a good file."""
    name, read, write = KINDS[request.param]
    return name, read, write(tmp_path / "it.npz")


def test_what_numpy_writes_is_read(kind):
    _, read, path = kind
    good = path.read_bytes()
    for save in (np.savez, np.savez_compressed):
        path.write_bytes(of_numpy(good, save))
        content = read(path)
        assert getattr(content, "instance", content).sha256 == INSTANCE.sha256


def test_forged_archives_are_refused(kind, subtests):
    name, read, path = kind
    good = path.read_bytes()
    for forgery, forge in forged(name).items():
        with subtests.test(forgery):
            path.write_bytes(forge(good))
            with pytest.raises(InstanceError, match=r"it\.npz: ") as refusal:
                read(path)
            assert "\n" not in str(refusal.value)


def test_an_array_too_many_is_named(kind):
    name, read, path = kind
    path.write_bytes(forged(name)["a member more"](path.read_bytes()))
    with pytest.raises(InstanceError, match="holds an array 'more' that does not belong in it"):
        read(path)


def test_numbers_of_half_precision_are_whole_or_refused_without_a_warning(recwarn):
    pixels = np.array([[0, 0], [1, 1]], dtype=np.float16)
    instance = Instance.on_pixels("tiny", np.ones((2, 2), bool), pixels, [0.3, 1.2], [1.0, 0.5])
    assert instance.sha256 == INSTANCE.sha256
    with pytest.raises(InstanceError, match="whole numbers of 32 bits"):
        Instance.on_pixels("tiny", np.ones((2, 2), bool), pixels + np.float16(0.5), [0.3, 1.2], [1.0, 0.5])
    assert not list(recwarn)
