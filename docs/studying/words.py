"""Text of docs/study.md around its tables and plots."""

from __future__ import annotations

from typing import Final

QUESTION: Final = """The paper that this project began with leaves a question: "It remains to be seen if any
of these can find practical use." So: which of its formulations can be solved, does it matter, and what is to
be used? Every number here comes from runs; their rows lie in `docs/studying/data`."""

SOLVERS_TEXT: Final = {
    "head": """## Formulations and solvers

Thirty instances on each rung of a ladder of sizes: samples as a whole, squares cut out of samples, squares
with straight strokes at random, and squares with random directions. The coefficients are the paper's, 1 and
1e-6. Every solver that can be had for free gets the file of every [formulation](formulations.md) it takes, in
the format that it reads best, on one thread, without a starting point: 6 s each, a relative gap of 1e-6,
tolerances of 1e-9 where they can be set. Seconds are those of reading and solving. A run counts as proven
when the solver says so, or when its bound is within 1e-6 of the objective, which is recomputed at its point.

Proven of how many, and the shifted geometric mean of the seconds, runs without a proof counted with their
limit. Sizes are pixels of the longer side. *Too large*: for the free edition. A dash: fewer than a tenth was
proven on the rung before, so the pair was not run. The last rows are `crossfield prove` (20 s), which reads
no file: it knows that the energy is one of [crosses on a strip](proofs.md).""",
    "profiles": """![Performance profiles for each problem](pictures/study_profiles.svg)

Performance profiles (Dolan and More, 2002): the share of instances that are proven within a multiple of the
quickest solver's time; the curve of the best solver is up and to the left. One panel for each problem, since
formulations of one problem have one optimum. Only the best pairs are shown, on instances that all of them
have, those that nobody proves included. A curve that ends low may have met the size limit of a free
edition.""",
    "growth": """![Share of proofs and seconds by size](pictures/study_growth.svg)

Each formulation at the solver that proves most of it. Where a pair was not run on a rung, or an instance is
too large, it counts as proving nothing; seconds are those of instances that are not too large.""",
    "kinds": """### Are random instances like drawings?

Instances that at least one solver proves, by problem and by where they come from.""",
    "open": """### What is left where nothing is proven

Of the runs without a proof so many have a point; how far its objective is above the best that is known
(median): by `prove`, or by any solver for the mixed problem; and the solver's own gap (median, 100 % where it
has no bound). Here and in the next table what is above an optimum is relative to it, or to 1 where it is
less.""",
    "variants": """### Starts, facets and windows

The same pairs and instances with one thing changed. *From the greedy field*: the complete point of that field
is handed over. *In the windows of a proof*: those that a [certificate](files.md#certificates) of `prove`
leaves, its seconds not counted. *With facet (26) as printed*: the paper's misprint, a relaxation, whose
optimum may be lower than any field's energy. Cells as above.""",
    "beside": """The same beside the cold runs, on the instances of which both were run. The last column:
objective above the optimum of the correct problem, mean over the instances of which both have a point.""",
    "claims": "### Are the claims true?",
}

QUALITY_TEXT: Final = {
    "head": """## Does optimality matter?

A designer draws some curvature lines and wants the others. So one curve of a drawing is hidden, a field is
made from the rest, and the error is the mean angle between the curve and the nearer line of the crosses; at
random it would be 22.5 degrees. Surfaces with a known answer have the mean angle to the true crosses, without
noise on the strokes and with 3 and 8 degrees of it. Fields of many energies are made from each instance by
[all methods](mathematics.md#10-ways-to-a-field): greedy, improved, of smooth fields, local optima round
random crosses (*perturbed*), searches of 1 s and 3 s, and the best that `prove` finds in 10 s, in both norms.
The weights are the default, 20 and 1e-6, but where others are named.""",
    "plot": """![Error beside the gap to the proven optimum](pictures/study_quality.svg)

Each point is a field: its energy (2-norm) above the optimum, and its error less that of the field of least
energy of the same instance. Below zero it is better than the optimum.""",
    "changes": """### What buys a better field

The error after a change less the error before it, on the same instances: mean over drawings or surfaces, and
its standard error. Less is better. Bold: beyond two standard errors.""",
    "weights": """![Error by the weights of strokes and skew](pictures/study_weights.svg)

Means over drawings or surfaces, with standard errors; *best* is what `prove` finds under that weight.""",
}

PRACTICE_TEXT: Final = {
    "head": """## Practical use

Every way to a field on every drawing, whole and without one of its three longest curves, on grids of 24 to
256 pixels; one thread, default weights. The [methods](mathematics.md#10-ways-to-a-field) are those of
`crossfield solve --method`, `power` and `polyvector` with the best angles for their jumps. `two-stage` is
section 5 of the paper: HiGHS on the MILP, then Ipopt on the convex QP. It, `search` and `prove`
begin at a field that is improved already, so that their answer is no worse. Hidden curves: mean over drawings
and standard error. The least energy is that of any way here.""",
    "plot": """![Error to hidden curves beside seconds, by size](pictures/study_practice.svg)

The lower left is fast and accurate, the upper right slow and inaccurate.
Bars: standard error over drawings.""",
}

THREATS: Final = """## What may be wrong with this

- **Drawings.** {drawings} drawings and {surfaces} surfaces are few, the samples among them were made for this
  project, and curves of one drawing are alike: hence standard errors over drawings. What the main changes do
  on drawings by others is told below their table; `--sketches FOLDER` adds others to all. Of thirty instances
  for solvers on a rung twenty or fewer come from the samples; the others are random and look like no drawing.
- **Hidden curves** measure what designers draw, not the surface that they mean. The surfaces with
  known answers are smooth and simple.
- **Free editions.** {free} They say nothing of what the full programs do with larger files.
- **Short limits.** A few seconds for each run; a proof that takes a minute is not seen here.
  [Proven optima](proofs.md) has runs of a minute.
- **Proven optima only.** Gaps are known where `prove` closes an instance in 10 s: not the hardest ones.
- **One run of each.** How long a solver takes varies with its seed; each run is done once, with the default.
- **Tolerances** are tighter than the defaults of most solvers, which costs them time; all have the same.
- **Formats.** A solver gets one format for a formulation; another may suit it better.
- **One machine.** {machine}
- **`prove`** belongs to this project, and is what the others are judged by. Its bounds come with
  [certificates](proofs.md) that a program of one file checks, and claims of other solvers are held against it
  above.
"""

ROWS: Final = """## The rows

`proofs.csv`, `solvers.csv`, `quality.csv` and `practice.csv` in `docs/studying/data`, a line for each run.
What was asked: `part`, `instance`, `size`, `way` (formulation or method), `solver`, `start` (cold, greedy),
`facet`, `windows` (gauge, proof), `norm`, `w_strokes`, `w_beta`, `hidden` (number of the curve, -1 for none),
`noise` (degrees), `limit` (seconds), `seed`. What was found: `version`, `format`, `status` as the solver
claims it (`unknown` where its point contradicts that, `not run` for a pair that proved too little before, and
the instance is then `*`), `objective` recomputed from the declaration at the point, `bound`, `energy_2` and
`energy_1` of the field, `violation`, `error` to the hidden curve or the true field and `off` from the strokes
shown (degrees), `seconds`, `nodes`, numbers of `pixels`, `pairs`, `columns` and `rows`, `note`, `machine`,
and the `load` average.

`python docs/study.py` does the runs that have no row; killed, it goes on where it was. `--plan` counts them,
`--scheduler ADDRESS` hands them to dask workers, `--quick --data FOLDER` is a small study of two minutes.
Instances are made by `docs/studying/instances.py` from samples and seeds."""
