"""Submissions of a single file or run to a library, and better points to submit."""

import highspy
from crossfield.export.formats.registry import write
from crossfield.export.library.contributions.submit import RunFacts, submit
from crossfield.export.library.documents.documents import problem_of, read_sidecar
from crossfield.models.field.file import read_field
from crossfield.models.formulations.problem import with_integers_fixed


def submit_one(library, *files, entry=None, **facts):
    """Submit one file or run and return its result; raise the error of a refused one."""
    (result,) = submit(library, files, entry=entry, facts=RunFacts(**facts))
    if result.error is not None:
        raise result.error
    return result


def better_point(library, entry, path):
    """Write HiGHS's solution file with the best angles for the jumps of the best field; the objective."""
    problem = problem_of(library, read_sidecar(library / f"{entry}.json"))
    field = read_field(library / f"{entry.rpartition('_')[0]}.field.json")
    write(with_integers_fixed(problem, field), path.with_suffix(".mps"))
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.setOptionValue("primal_feasibility_tolerance", 1e-10)
    highs.readModel(str(path.with_suffix(".mps")))
    highs.run()
    highs.writeSolution(str(path), 0)
    return highs.getInfo().objective_function_value
