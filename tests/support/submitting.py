"""Submissions of a single file or run to a library."""

from crossfield.export.library.contributions.submit import RunFacts, submit


def submit_one(library, *files, entry=None, **facts):
    """Submit one file or run and return its result; raise the error of a refused one."""
    (result,) = submit(library, files, entry=entry, facts=RunFacts(**facts))
    if result.error is not None:
        raise result.error
    return result
