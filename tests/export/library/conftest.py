"""What several tests of libraries share."""

import pytest


@pytest.fixture(scope="module")
def short_searches():
    """Libraries are built with one round of search: how good their fields are does not matter here."""
    from crossfield.export.library.ledger import points

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(points, "_ROUNDS", 1)
        yield
