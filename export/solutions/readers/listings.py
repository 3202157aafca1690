"""The table of layouts that programs print, and of lists of names and values with a sign between them.

docs/files/answers.csv states the program and version that wrote the test file of each.
"""

from __future__ import annotations

import re

from .grammar import BLANK, NUMBER, TextLayout
from .layouts import LAYOUTS, OUR_NAME

_SOLVED = rb"(?:CPLEX> )?(?:MIP|Barrier|Primal simplex|Dual simplex) - "
_QUOTES = (b'"', rb'"', b" ")
_PAIR = rb'"?[^\s=:,;#"]{1,63}"?[ \t]*[%b][ \t]*"?%b"?[ \t]*[,;]?[ \t]*(?:\n|\Z)'
_OURS = rb'"?' + OUR_NAME + rb'"?[ \t]*[%b]'
_REMARKS = rb"(?:%b*(?:#[^\n]*)?\n)*" % BLANK
_HEADING = rb"(?:[^\s\d,;=:][^\d\n,;=:]{0,99})?[,;][^\d\n,;=:]{0,99}0?\n"
_PROSE = rb"(?![ \t]*(?:#|%b[ \t]|\S+[ \t]+%b[ \t]*\n))" % (OUR_NAME, NUMBER)


def _quotient(match: re.Match[bytes]) -> bytes:
    """An exact fraction as the nearest number."""
    above, _, below = match[0].partition(b"/")
    return repr(int(above) / int(below)).encode()


def _list_of(name: str, title: str, separator: bytes, value: bytes) -> TextLayout:
    """Pairs with a sign between, after a heading or none; in other text, five or more of them."""
    pair = _PAIR % (separator, value)
    return TextLayout(
        name,
        f"names and values with {title} between",
        signature=rb"(?!model_status)(?P<answer>\A%b(?:%b)?%b*(?:%b|%b)|(?:%b)?%b(?:[ \t]*%b){4})"
        % (_REMARKS, _HEADING, BLANK, pair, _OURS % separator, _HEADING, pair, pair),
        separator=separator,
        rewrites=(
            _QUOTES,
            (separator[-1:], rb"\A(\s*)" + _HEADING, rb"\1\n"),
            (b"", rb"(?m)[,;][ \t]*$", b""),
            (b";", rb"(?m)(?<=\d),(?=\d)|(?<=[; ]),(?=\d)", b"."),
        ),
    )


LISTINGS = (
    TextLayout("cuopt", "cuOpt .sol", signature=rb"# Status:", pointless=rb"infeasible|unbounded"),
    TextLayout(
        "python-mip",
        "python-mip .sol",
        signature=rb"Feasible solution - objective\b",
        forms=("index name value number",),
        claims=(rb"Feasible solution - objective .*",),  # 0.0 for every model
        omits_zeros=True,
    ),
    TextLayout(
        "gurobi-attr",
        "Gurobi .attr",
        signature=rb"# Attribute file for model\b",
        begin=rb"SECTION SOLUTION",
        end=rb"SECTION .*",
    ),
    TextLayout(
        "xpress-asc",
        "Xpress .asc",
        signature=rb'\d+,"[^"\n]*","[A-Z]",',
        forms=("number name C word value number number number number",),
        separator=b",",
        rewrites=((b'"', rb'(?m)^ *\d+,"[^"\n]*","[^C].*$', b""), _QUOTES),
    ),
    TextLayout(
        "lp_solve",
        "lp_solve, its output",
        signature=rb"Value of objective function:|This problem is (?:infeasible|unbounded)",
        claims=(
            rb"Value of objective function:\s+(?P<objective>\S+)",
            rb"This problem is (?P<none>(?P<status>\S+))",
        ),
        begin=rb"Actual values of the variables:",
        end=rb"Actual values of the constraints:",
        needs=(("begin", "list of variables"),),
        digits="lp_solve prints six and has no option for more",
    ),
    TextLayout(
        "symphony",
        "SYMPHONY, its output",
        signature=rb"\* [A-Z][\w ]+\*[ \t]*\n\*(?! +Copyright)",
        claims=(
            rb"\* (?:Problem |Relaxation )?(?:Found )?(?P<status>\w[\w ]*?) +\*",
            rb"Solution Cost:\s+(?P<objective>\S+)",
            rb"(?P<none>No Solution Found)",
        ),
        begin=rb"Column names and values of nonzeros in the solution[ \t]*\n\+*",
        pointless=rb"infeasible|unbounded",
        needs=(("status", "status"),),
        omits_zeros=True,
    ),
    TextLayout(
        "qsopt_ex",
        "QSopt_ex, esolver -O",
        signature=rb"status = [A-Z]+\n",
        separator=b"=",
        claims=(
            rb"status = (?P<status>OPTIMAL)",
            rb"(?P<none>status = (?P<status>\w+))",
            rb"Value = (?P<objective>\S+)",
        ),
        begin=rb"VARS:",
        end=rb"REDUCED COST:",
        needs=(("end", "line REDUCED COST"),),
        omits_zeros=True,
        rewrites=((b"/", rb"(?<!\S)-?\d+/[1-9]\d*(?!\S)", _quotient),),
    ),
    TextLayout(
        "mosek",
        "MOSEK .int, .bas or .sol",
        signature=rb"(?:NAME +:[^\n]*\n)?PROBLEM STATUS +:",
        forms=("index name word value word word", "index name word value word word word word"),
        claims=(
            rb"SOLUTION STATUS\s*:\s*(?:INTEGER_|PRIMAL_)?(?P<status>\S+)",
            rb"PRIMAL OBJECTIVE\s*:\s*(?P<objective>\S+)",
        ),
        begin=rb"VARIABLES[ \t]*\n\s*INDEX .*",
        end=rb"SYMMETRIC MATRIX VARIABLES",
        pointless=rb"infeasible|dual_infeasible",
    ),
    TextLayout(
        "cplex-display",
        "CPLEX, display solution variables -",
        signature=_SOLVED + rb"[^\n]*(?:Objective =|infeasible|no integer solution)",
        claims=(
            _SOLVED + rb"(?:Integer )?(?P<status>[^\n,:]+(?:, tolerance)?).*Objective =\s+(?P<objective>\S+)",
            _SOLVED + rb"(?:Integer )?(?P<none>(?P<status>[^\n,:]+)).*",
        ),
        begin=rb"Variable Name\s+Solution Value",
        end=rb"All other variables in the range .* are 0\..*",
        needs=(("end", "line `All other variables`"),),
        omits_zeros=True,
        digits="`write FILE.sol` in CPLEX writes all",
    ),
    TextLayout(
        "gams-listing",
        "GAMS listing (.lst)",
        signature=rb"\*\*\*\* SOLVER STATUS (?=(?:[^\n]*\n){0,2000}?---- VAR )",
        forms=("---- VAR name word value word word",),
        comment=b"",
        claims=(
            rb"\*\*\*\* SOLVER STATUS\s+(?P<solver>\d+).*",
            rb"\*\*\*\* MODEL STATUS\s+(?P<status>\d+).*",
        ),
        end=rb"\*\*\*\* REPORT SUMMARY.*",
        pointless=rb"(?!(?:1|2|7|8)\Z)",
        needs=(("solver", "SOLVER STATUS"), ("status", "MODEL STATUS")),
        rewrites=(
            (b"---- VAR", rb"(?m)^(?!---- VAR |\*\*\*\* (?:SOLVER|MODEL|REPORT) ).*$", b""),
            (b"---- VAR", rb"(?<=[ \t])(?:\.|EPS)(?=[ \t\n])", b"0"),
        ),
        digits="`gams MODEL --RESULTS=FILE.csv` writes all",
    ),
    TextLayout(
        "gams-display",
        "GAMS, display of levels",
        signature=rb"---- +\d+ VARIABLE [^\s.]+\.L +=",
        separator=b"=",
        rewrites=((b"VARIABLE", rb"(?m)^[-\d \t]*VARIABLE ([^\s.]+)\.L( *= *\S+).*$", rb"\1\2"),),
        digits="`option decimals = 8` in GAMS writes more, and --RESULTS=FILE.csv all",
    ),
    TextLayout(
        "ampl-display",
        "AMPL, display _varname, _var",
        signature=rb":\s+_varname\s+_var\s+:=",
        forms=("index name value",),
        begin=rb":\s+_varname\s+_var\s+:=",
        end=rb";",
        needs=(("end", "line `;`"),),
        rewrites=((b"'", b"'", b" "),),
        digits="`option display_precision 0` in AMPL prints all",
    ),
    TextLayout(
        "pyomo",
        "Pyomo results, YAML",
        signature=rb"# = Solver Results",
        claims=(
            rb"Termination condition: (?P<status>\S+)",
            rb"Lower bound: (?P<bound>\S*\d)",
            rb"Objective:[ \t]*\n\s*\S+ (?P<objective>\S+)",
        ),
        begin=rb"Variable:.*",
        end=rb"Constraint:.*",
        needs=(("end", "line Constraint"),),
        pointless=rb"infeasible|unbounded",
        omits_zeros=True,
        rewrites=((b"Variable:", rb"(?m)^ {4}(\S+):\n {6}Value: (\S+)\n", rb"\1 \2\n\n"),),
    ),
    TextLayout(
        "osrl",
        "OSrL, the results of Optimization Services",
        signature=rb"(?:<\?xml[^\n]*\n(?:[^\n]*\n){0,9}?[ \t]*)?<osrl\b",
        claims=(rb"STATUS (?P<status>\S+)", rb"OBJ (?P<objective>\S+)"),
        rewrites=(
            (b"<", rb">\s*<", b">\n<"),
            (
                b"<",
                rb"<solutionStatus|<status\b(?=[^\n]*(?:optimal|infeasible|unbounded|feasible))",
                b"<STATUS",
            ),
            (b"<STATUS", rb'<STATUS[^\n]*?type="(\w+)"[^\n]*', rb"STATUS \1"),
            (b"<obj", rb"<obj\b[^>]*>\s*([^<\s]+)\s*</obj>", rb"OBJ \1"),
            (b"<var", rb'<var\b[^>\n]*\bname="([^"\s]+)"[^>\n]*>\s*([^<\s]+)\s*</var>', rb"\1 \2"),
            (b"<", rb"(?m)^[ \t]*<.*$", b""),
        ),
    ),
    TextLayout(
        "data-frame",
        "CSV of pandas with an index, or of linopy",
        signature=rb'\A(?:"?\w*"?,"?\w+"?,"?\w+"?[ \t]*\n"?\d+"?,"?[A-Za-z]|"?labels"?,"?lower"?,"?upper"?,)',
        forms=("number name value", "name number number value"),
        separator=b",",
        begin=rb'"?[A-Za-z_]*"?,.*',
        rewrites=(_QUOTES,),
    ),
    TextLayout(
        "assignments",
        "assignments of Python, Julia, AMPL or GAMS",
        signature=rb"\A\s*(?:\{'|Dict\b|\"?\w+\"?[ \t]*=>|let[ \t]+\w+[ \t]*:=|\w+\.l[ \t]*=)",
        separator=b"=:",
        rewrites=(
            (b"", rb"\A\s*(?:Dict[^\n(]*\(?|\{)|[)}]\s*\Z", b""),
            (b"", rb"(?m)['\"]|^[ \t]*let\b|;[ \t]*$", b" "),
            (b"=", rb":=|=>", b"="),
            (b"=", rb"(?mi)\.l(?=[ \t]*=)", b""),
            (b",", rb",[ \t]*\n?", b"\n"),
        ),
    ),
    TextLayout(
        "list-in-text",
        "names and values in other text",
        signature=rb"\A\s*%b(?:%b[^\n]*\n)+?(?P<answer>(?:[ \t]*(?:ONE|%b)\w*[ \t]+%b[ \t]*\n){5})"
        % (_PROSE, _PROSE, OUR_NAME, NUMBER),
    ),
    _list_of("pairs", "=, : or a comma", b"=:,", NUMBER),
    _list_of("pairs-semicolon", "a semicolon", b";", rb"[-+]?\d*[.,]?\d*(?:e[-+]?\d+)?"),
)
"""The last three have no mark of a program, and count only where nothing else is found."""

TEXT_LAYOUTS = (*LAYOUTS[:-1], *LISTINGS, LAYOUTS[-1])
"""All text layouts: the first whose signature is found has the text, and the plain list is the last."""
