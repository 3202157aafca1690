"""Fixtures of several tests of libraries."""

import pytest


@pytest.fixture(scope="module")
def short_searches():
    """Builds use one round of search, because the quality of their fields does not matter here."""
    from crossfield.export.library.ledger import points

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(points, "_ROUNDS", 1)
        yield
