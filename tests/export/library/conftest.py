"""Fixtures of several tests of libraries."""

import json
import shutil

import pytest


@pytest.fixture(scope="session")
def short_searches():
    """Builds use one round of search, because the quality of their fields does not matter here."""
    from crossfield.export.library.building import fields

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fields, "_ROUNDS", 1)
        yield


@pytest.fixture(scope="session")
def opened(short_searches, tmp_path_factory):
    """A library without proofs whose points are greedy fields, which are not optimal; not to be changed."""
    from libraries import OPEN, library_of

    folder = tmp_path_factory.mktemp("open")
    for path in library_of(folder, OPEN, "points").folder.glob("*.about.json"):
        about = json.loads(path.read_text())
        about["fields"] = dict.fromkeys(about["fields"], about["fields"]["baseline"])
        path.write_text(json.dumps(about))
    return library_of(folder, 'points = "points"\n' + OPEN).folder


@pytest.fixture
def lib(opened, tmp_path):
    """A copy of that library, which a test may change."""
    return shutil.copytree(opened, tmp_path / "lib")
