"""A library that tests of contributions and of solvers share."""

import shutil

import pytest


@pytest.fixture(scope="session")
def opened(tmp_path_factory):
    """A library without proofs whose points are greedy fields, which are not optimal; not to be changed."""
    from libraries import OPEN, library_of

    return library_of(tmp_path_factory.mktemp("open"), OPEN).folder


@pytest.fixture
def lib(opened, tmp_path):
    """A copy of that library, which a test may change."""
    return shutil.copytree(opened, tmp_path / "lib")
