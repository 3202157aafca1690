"""The table of text layouts: files with one name and one value per line, and what stands around them."""

from __future__ import annotations

from .grammar import NUMBER, RESERVED, TextLayout

OUR_NAME = rb"(?:[a-z]\w*_\d{2,4}_\d{2,4}(?:_[ru])?|(?:alpha|beta|gamma|psi|p[12]?|[stzduqk])_\d{2,7})\b"
"""A column by row and column of a pixel, or by the number of a face, a pair or a cycle."""

FEW_LINES = rb"(?:[^\n]*\n){0,9}?"

HIGHS = TextLayout(
    "highs",
    "HiGHS, solution style 0 (raw) or 4 (sparse)",
    signature=rb"Model status[ \t]*\n",
    forms=("name value", "name value number"),
    claims=(
        rb"Model status[ \t]*\n\s*(?P<status>\S.*?)",
        rb"# Primal solution values[ \t]*\n\s*(?P<none>None)",
        rb"# Primal solution values[ \t]*\n\s*(?P<primal>\S.*?)",
        rb"Objective\s+(?P<objective>\S+)",
        rb"Objective_bound\s+(?P<bound>\S+)",
    ),
    begin=rb"# Columns\s+(?P<count>\S+)(?P<sparse>\s+sparse)?",
    end=rb"# Rows(?:\s+(?P<rows>\S+))?",
    needs=(("status", "model status"), ("begin", "list of columns"), ("objective", "objective")),
)
r"""As HiGHS 1.16.0 writes it (HighsModelUtils.cpp, writeModelSolution):

    Model status
    Time limit reached              words with blanks
                                    an empty line
    # Primal solution values
    Feasible                        or Infeasible; or None, and then no point follows
    Objective -14.4                 with the constant of the objective
    Objective_bound -14.5           since 1.16, of problems with integers: the dual bound
    MIP_rel_gap 0.007               likewise
    # Columns 5                     style 4: `-3 sparse`, with the number of columns that are not zero
    x 10                            name and value; style 4: and the column's number
    ...
    # Rows 2                        only style 0; rows, dual values and a basis follow, not needed here

Values below 1e-13 in size are written as 0. Before 1.16, a sparse file of the point 0 had `# Columns 0` too.
HiGHS reports `Optimal` for local points of non-convex quadratic problems, which are outside its documented
classes. The caller checks the class of the problem."""

SCIP = TextLayout(
    "scip",
    "SCIP .sol",
    signature=(
        rb"solution status:(?:[^\n]*\n(?:\s*#[^\n]*\n)*\s*(?:objective value:|no solution available))?"
        rb"|(?-i:objective value:)|no solution available"
    ),
    forms=("name value word", "name value"),
    claims=(rb"solution status:\s*(?P<status>.*?)", rb"(?P<none>no solution available)"),
    refusals=(
        (
            rb"objective value:\s+unknown",
            "this is a partial solution, with columns of unknown value; let the solver write the file again",
        ),
    ),
    needs=(("objective", "objective"),),
    omits_zeros=True,
    silent="SCIP's command `write solution` states it; --bound X states the dual bound (getDualbound)",
)
r"""As SCIP 10.0 writes it (SCIPprintStatus has the words):

    solution status: optimal solution found          the shell writes this line, the library does not
    objective value:                                -14.4
    b                                                   1 \t(obj:-3)

The columns are in no particular order and those at 0 are omitted, unless write/printzeros is set. Values may
be +infinity or -infinity; a partial solution has the value `unknown`. SCIP adds columns of its own (nlobjvar,
quadobjvar, qmatrixvar, objconstvar). Without a status a point counts as feasible."""

XPRESS = TextLayout(
    "xpress-slx",
    "Xpress .slx",
    signature=rb"NAME\b[^\n]*\n\s*(?:[A-Z] |ENDATA)|\A\s*ENDATA[ \t]*(?:\n|\Z)",
    forms=("C name value",),
    claims=(rb"(?P<none>ENDATA)",),
    begin=rb"NAME(?: .*)?",
    end=rb"ENDATA",
    needs=(("end", "line ENDATA"),),
    silent="Xpress writes none; --bound X states the dual bound (attribute bestbound)",
)
"""As Xpress 9.9.1 writes it:

    NAME          mip                          NAME .. ENDATA for each solution
      C x                       10
    ENDATA                                     only ENDATA: there was no solution

There is no status: the point counts as feasible. Without an integer solution Xpress writes the relaxation,
which the recomputed violation reveals. .prt has six decimals, .hdr no columns: they are not read."""

CBC = TextLayout(
    "cbc",
    "CBC, the file of its command solution",
    signature=rb"[A-Z][^\n]{2,100}? - objective value",
    forms=("index name value number",),
    claims=(
        rb"(?P<none>(?P<status>[A-Z][^\n]{2,100}?) - objective value +1e\+50)",
        rb"(?P<status>[A-Z][^\n]{2,100}?) - objective value +(?P<objective>\S+)",
    ),
    end=rb"Total time .*",
    pointless=rb"(?:integer |linear relaxation )?(?:infeasible|unbounded)|.*continuous used",
    omits_zeros=None,
    rewrites=((b"**", rb"(?m)^([ \t]*)\*\*", rb"\1  "),),
)
"""As CBC 2.10.8 writes it:

    Optimal - objective value -14.40000000
          0 x                     10                    -1.9      number, name, value, reduced cost
    **    3 y                    200                       0      ** before values out of their bounds

Values have 8 significant digits, so violations up to about 1e-7 of a value's size are due to the file.
`printingOptions all` or `rows` puts the rows before the columns. Their numbers then start again, and names
before that must not be columns. Some versions and options omit columns at 0; a file with a value of 0 does
not. A file of an infeasible problem looks the same, and a file of a search without result holds the
relaxation, (no integer solution - continuous used): both hold no point. Stopped before it has any, CBC
writes the objective 1e+50 and no columns."""

GAMS = TextLayout(
    "gams-csv",
    "GAMS, the CSV that our models write with --RESULTS",
    signature=rb"model_status[ \t]*,",
    separator=b",",
    reserved=RESERVED + rb"|(?:model_status|solver_status|problem|objective)[ \t]*,",
    claims=(
        rb"model_status\s*,\s*(?P<status>\d{1,3})",
        rb"solver_status\s*,\s*(?P<solver>\d{1,3})",
        rb"problem\s*,\s*(?P<problem>\S*)",
        rb"objective\s*,\s*(?P<objective>\S+)",
    ),
    pointless=rb"(?!(?:1|2|7|8)\Z)",
    needs=(("status", "model_status"), ("solver", "solver_status"), ("objective", "objective")),
    rewrites=((b"EPS", rb"(?m),[ \t]*EPS(?=[ \t]*$)", b",0"),),
)
"""As our own GAMS files write it (`gams x.gms --RESULTS=x.csv`), with GAMS 54.6.1:

    model_status,1
    solver_status,1
    problem,sha256_1a2b3c4d5e6f               older files have no such line
    objective, 5.565360828459345E-01
    alpha_00_00, 1.146018366025520E-01        every column in order

EPS is a zero, +INF and -INF occur, NA and UNDF are not values. GAMS's numbers of the two states are in the
manual under modelStat and solveStat. If the model status promises no point, GAMS keeps the start in the
levels: values are then not read. A listing (.lst) has four decimals, too few for a point, and is not read."""

BARON = TextLayout(
    "baron-res",
    "BARON results (res.lst)",
    signature=rb"\A\s*=+\n\s*BARON version ",
    forms=("name number value number",),
    claims=(
        rb"\*\*\* (?P<status>[^*\n]{3,100}?) \*\*\*",
        rb"eps(?:a +=\s+(?P<epsa>%b)|r +=\s+(?P<epsr>%b))" % (NUMBER, NUMBER),
        rb"(?P<early>first(?:feas|loc) +=\s+1|deltaterm +=\s+1|target +=(?!\s+-0\.1000E\+52).*)",
        rb">>> (?P<point>Objective value is):.*",
    ),
    begin=rb"The best solution found is:?[ \t]*\n\s*variable\b.*",
    end=rb"The above solution has an objective value of:\s+(?:(?P<none>-?[\d.]+E\+0?5\d)|(?P<objective>\S+))",
    needs=(("status", "end of the search"), ("end", "objective")),
    refusals=(
        (
            rb"Best solution found at node:.*",
            "this is the summary of BARON, which holds no values; give its results, res.lst",
        ),
    ),
    rewrites=((b"unbounded ray:", rb"(?<=objective value of:).*", b" -1E+51"),),
)
"""As BARON 26.5.27 writes it (codes: BARON.jl and Pyomo's reader):

    ...                                      log of all points found, by number; not read
                *** Normal completion ***    how the search ended
    The best solution found is:

      variable        xlo     xbest    xup
      x               0       10       10    name, lower bound, value, upper bound, until an empty line

    The above solution has an objective value of:  -14.4

Normal completion proves an optimum within the gaps that the file states, infeasibility without a table,
unboundedness when a ray follows it. It proves nothing when an option may have ended the search earlier
(FirstFeas, FirstLoc, DeltaTerm, Target): then the point counts as feasible. sum.lst begins like res.lst and
has no values: it is refused."""

MIPLIB = TextLayout(
    "miplib",
    "MIPLIB .sol",
    signature=rb"=(?:obj|infeas)=",
    heads=False,
    needs=(("objective", "objective"),),
    omits_zeros=True,
)
"""MIPLIB's .sol: a line `=obj= value`, and columns, of which those at 0 may be omitted. `=infeas=` instead
denotes an infeasible instance (MIPLIB's solution checker). There is no other status: a point counts as
feasible."""

LIST = TextLayout(
    "gurobi",
    "Gurobi .sol, or any list of names and values",
    signature=(
        rb"\A(?:[ \t]*(?:#[^\n]*)?\n)*(?:[ \t]*# ?(?:Solution for model|Objective value|MIP start)\b"
        rb"|%b[ \t]*%b[ \t]+\S+[ \t]*(?:\n|\Z)"
        rb"|%b[ \t]*(?![#=]|[\d.+\-]*[\0- ])[^\0- ]+[ \t]+%b[ \t]*(?:\n|\Z))"
    )
    % (FEW_LINES, OUR_NAME, FEW_LINES, NUMBER),
    silent="Gurobi states it in a .json (write)",
    refusals=(
        (
            rb"# ?MIP (?:start|hints)\b.*",
            "this is a MIP start (.mst), which Gurobi reads and does not write as an answer; write the .sol",
        ),
    ),
)
"""Gurobi's .sol, the .sol of COPT, and plain lists: name and value of every column, zeros too.

    # Solution for model obj               comment lines, which vary; the first may be missing
    # Objective value = -1.44e+01
    x 10

There is no status: the point counts as feasible. A MIP start (.mst) looks like one, and Gurobi's holds only
the integer columns. Layout: Gurobi 13.0.3."""

LAYOUTS = (HIGHS, SCIP, XPRESS, CBC, GAMS, BARON, MIPLIB, LIST)
"""The first whose signature is found has the text; a plain list has none, and is last."""
