"""Make the generated pages and pictures of docs/, or one of them by name: `python docs/make.py`."""

from __future__ import annotations

import csv
import io
import re
import shlex
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import crossfield as cf
from crossfield.export.bundle.starts import STARTS
from crossfield.export.cli.tables import smallest_problems
from crossfield.export.solvers_table import PROGRAMS, SOLVERS, suitability
from crossfield.models.errors import InputError
from crossfield.models.formulations.catalogue import A_WHOLE, FORMULATIONS
from crossfield.models.formulations.choice import declare
from crossfield.models.formulations.latex import aligned, domain, expression, objective_and_rows
from crossfield.models.formulations.problem import Problem
from crossfield.models.formulations.symbols import VARIABLES, A, B, R, beta, kappa, p1, p2

DOCS = Path(__file__).resolve().parent


def markdown(columns: tuple[str, ...], rows: list[list[str]]) -> str:
    """A Markdown table."""
    lines = [columns, ("---",) * len(columns), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def csv_text(rows: list[dict[str, Any]]) -> str:
    """Rows as CSV, with a column per name in the order in which names first appear."""
    buffer = io.StringIO(newline="")
    columns = list(dict.fromkeys(name for row in rows for name in row))
    writer = csv.DictWriter(buffer, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue()


def write_rows(path: str, rows: list[dict[str, Any]]) -> None:
    """Write rows to a CSV file of docs/."""
    (DOCS / path).write_text(csv_text(rows), encoding="utf-8")


def read_rows(path: str) -> list[dict[str, str]]:
    """The rows of a CSV file of docs/."""
    with (DOCS / path).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_formulations() -> None:
    """Write docs/formulations.md: every formulation as mathematics, its size, formats and solvers."""
    parts = [
        "# Formulations",
        INTRODUCTION,
        "![Columns, rows, integers and nonlinear terms of each formulation](pictures/formulation_sizes.svg)",
        "## Variables and data",
        SYMBOLS,
        "\n".join(map(variable_line, VARIABLES)),
    ]
    for name, recipe in FORMULATIONS.items():
        facts = [f"`{recipe.short}`", recipe.kind, recipe.source]
        summary = f"{'; '.join(facts)}. {recipe.summary[0].upper()}{recipe.summary[1:]}."
        parts += [f"## `{name}`", summary + options_of(name)]
        parts += [] if name in {**SQUARED, **EXPANDED} else [formulas_of(name)]
    optima: dict[str, list[str]] = {}
    for name, recipe in FORMULATIONS.items():
        optima.setdefault(recipe.minimises, []).append(f"`{name}`")
    equal = "\n".join(f"- {energy}: {', '.join(names)}" for energy, names in optima.items() if names[1:])
    parts += ["## Formats and solvers", EQUAL, equal, SUPPORT]
    parts += ["## Differences from the paper", DIFFERENCES, misprints()]
    (DOCS / "formulations.md").write_text("\n\n".join(parts) + "\n")
    write_rows("formulations/solvers.csv", list(map(solvers_of, smallest_problems())))
    write_rows("formulations/refusals.csv", list(refusals()))


def solvers_of(problem: Problem) -> dict[str, str]:
    """The solvers that take a formulation."""
    return {"formulation": problem.name} | {
        solver.title: suitability(problem, name).answer for name, solver in SOLVERS.items()
    }


def refusals() -> Iterator[dict[str, str]]:
    """The reasons for which solvers do not take a formulation, or answer without proof."""
    for solver in SOLVERS.values():
        for trait, refusal in solver.refusals.items():
            yield {"solver": solver.title, "trait": trait, "reason": refusal.reason}


def options_of(name: str) -> str:
    """Sentence on the options of a formulation, or on its difference from another one."""
    if name in SQUARED:
        return f" It is `{SQUARED[name]}` with both norms 2, without rows (22) to (25)."
    if name in EXPANDED:
        return f" It is `{EXPANDED[name]}` with its squares multiplied out, and p1 in place of p1^2."
    options = sorted(FORMULATIONS[name].option_names - {"relax"})
    return f" Options: {', '.join(f'`{option}`' for option in options)}." if options else ""


def formulas_of(name: str) -> str:
    """Objective and rows of a formulation, with short names for long expressions."""
    formulas = aligned(objective_and_rows(declare(name)))
    for text, short in SHORT.items():
        formulas = formulas.replace(rf"\left({text}\right)", short).replace(text, short)
    one_line = formulas.replace(" \\\\\n\\quad & +", " +")
    return f"$$\n{one_line}\n$$"


SQUARED = {"miqcp-bilinear": "miqcp-bilinear-l1", "miqp-mccormick": "milp-mccormick"}
"""Formulations with squares of stroke and skew terms, and those printed, which have absolute values."""
EXPANDED = {"minlp-cubic": "minlp-quartic"}
"""A formulation whose terms are those of another one, expanded."""
JUMP = p1 + 2 * p2
SUMS = {
    r"\text{strokes}_1": r"\sum_{i \in S_c} w_{\mathrm{strokes}} \, w_i \, \gamma_i",
    r"\text{strokes}_2": r"\sum_{i \in S_c} w_{\mathrm{strokes}} \, w_i \, R_i^{2}",
    r"\text{skew}_1": r"\sum_{i \in I} w_{\beta} \, \psi_i",
    r"\text{skew}_2": r"\sum_{i \in I} w_{\beta} \, \beta_i^{2}",
}
SHORT = {
    expression(A - kappa): "A_{ij}",
    expression(A_WHOLE - kappa): "A_{ij}",
    expression(JUMP): "p_{ij}",
    expression(B): "B_{ij}",
    expression(R): "R_i",
    expression(R - beta): "R_i",
} | {text: name for name, text in SUMS.items()}
"""Expressions that the page on formulations writes once, and their names."""
NAMED = "\n".join(
    f"- ${name} = {text}$"
    for name, text in {
        "p_{ij}": expression(JUMP),
        "A_{ij}": expression(A_WHOLE),
        "B_{ij}": expression(B),
        "R_i": expression(R),
        **SUMS,
    }.items()
)


def variable_line(name: str) -> str:
    """Name, domain and meaning of a variable."""
    variable, users = VARIABLES[name], [user for user in map(declare, FORMULATIONS) if name in user.variables]
    domains = dict.fromkeys(domain(user.variable(name), user) for user in users)
    return f"- `{name}`, {' or '.join(f'${text}$' for text in domains)}: {variable.meaning}"


INTRODUCTION = rf"""The problem of [a cross field](cross-field.md) in {len(FORMULATIONS)} formulations; those
named `-orthogonal` and `-cycle` are for orthogonal crosses only ($\beta = 0$). Sections
and numbers in brackets are the paper's. Sizes for the sketch `mouse` at 24 pixels:"""

SYMBOLS = rf"""[The mathematics](mathematics.md) defines the pixels $I$, the stroke pixels $S_c$ with
$\theta_i$ and $w_i$, the pairs $E$, and the [windows](mathematics.md#4-gauges-and-windows) of $\alpha$, from
which $p^{{\min}}$ and $p^{{\max}}$ follow. $C$ is a basis of the [cycles](mathematics.md#13-cycles) of
pairs and strokes. $H_c$ is the sum of the turns $\pm\kappa_{{ij}}$ along a cycle, plus $\theta_i - \theta_j$
for a walk from stroke to stroke. Between pixels, $\kappa_{{ij}} = 0$. Expressions:

{NAMED}

Prescribed [indices](mathematics.md#12-surfaces) of an instance fix $k_c$ along rings. Options:

- `limits` replaces $d^{{\max}} = q^{{\max}} = \pi/4$ by
  [smaller ones](mathematics.md#14-limits-of-residuals).
- `facet=printed` replaces row (26) by the paper's bound $z \ge -\pi/4$.
- `stroke_norm` and `beta_norm`, 1 or 2, are the indices of $\text{{strokes}}$ and $\text{{skew}}$.
- `relax` makes integers continuous, except in `qp-fixed`.

Variables:"""

EQUAL = "These minimise the same, and points carry over by name:"

SUPPORT = """`.nl` and GAMS files hold every formulation, and LP and MPS files all except `minlp-parity`:
`minlp-quartic` and `minlp-cubic` *lifted*, with one column and four rows for each product of an integer and a
continuous variable, without loss unless relaxed. [Which solver takes which](formulations/solvers.csv)
(`local`: without proof), and [why not](formulations/refusals.csv)."""


DIFFERENCES = """\
- (26) reads z >= -pi/4; here it is z >= -(pi/4) p1, a facet (`export --facet printed`: as printed).
- (1) restricts alpha to [0, pi/2]; here [windows](mathematics.md#4-gauges-and-windows) of strokes are centred
  on their direction (`instance --gauge box`: as printed).
- w_beta is in (6) and in the total, and missing in (21); here it counts once.
- All pixels have gamma rows; here only stroke pixels, where theta exists.
- p2 may be any integer; here it has bounds, which contain every optimum."""


def misprints() -> str:
    """The effects of both misprints, from the rows of their tables."""
    facets, gauges = (read_rows(f"formulations/{name}.csv") for name in ("facets", "gauges"))
    energy = {(row["seed"], row["facet"]): float(row["energy of its field"]) for row in facets}
    optimum = {(row["seed"], row["facet"]): float(row["optimum"]) for row in facets}
    seeds = dict.fromkeys(seed for seed, _ in optimum)
    lower = sum(optimum[seed, "printed"] < optimum[seed, "hull"] - 1e-6 for seed in seeds)
    worst = max(energy[seed, "printed"] / optimum[seed, "hull"] for seed in seeds)
    boxes = [row for row in gauges if row["gauge"] == "box"]
    changed = sum(row["optimum"] != row["rotated sketch"] for row in boxes)
    return f"""With the printed facet, the optimum is too low on {lower} of {len(seeds)} random grids of 4 x 4
pixels, and its field has up to {worst:.1f} times the minimum 1-norm energy: where p1 = 0, z is free in an
interval ([facets.csv](formulations/facets.csv)). With the box, a rotation by 90 degrees changes the optimum
of {changed} of {len(boxes)} random grids of 2 x 3 pixels ([gauges.csv](formulations/gauges.csv)). HiGHS and
Bonmin proved these optima (`python docs/make.py errata` at commit 99c0d92d)."""


def write_gallery() -> None:
    """Write docs/gallery.md: drawing, field and surface of each sample."""
    import sample_gallery

    sample_gallery.write_page()


def draw_tutorials() -> None:
    """Draw the fields and the surface of docs/tutorials/solver.md and drawing.md."""
    from crossfield.models.smooth.bend import surface_field

    problem, pictures = cf.formulate(cf.sample("ellipsoid", 5), "milp-mccormick"), DOCS / "pictures"
    milp = cf.solve(problem, solver="highs").field
    cf.draw(milp, pictures / "ellipsoid_milp.png", kind="overview", force=True)
    page = (DOCS / "tutorials" / "drawing.md").read_text()
    with tempfile.TemporaryDirectory() as name:
        drawing = Path(name) / "pebble.svg"
        drawing.write_text(re.findall(r"```xml\n(.*?)```", page, re.DOTALL)[0])
        field = surface_field(cf.read_sketch(drawing, size=48))
        cf.draw(field, pictures / "pebble_field.png", kind="overview", force=True)
        cf.write_surface(cf.surface(field), name, drawing=drawing, side=1000)
        shutil.copy(Path(name) / "overlay.png", pictures / "pebble_surface.png")


def write_drawings() -> None:
    """Write docs/guides/drawings.csv: what `crossfield instance` reports of drawings of many programs."""
    folder = DOCS.parent / "tests" / "data" / "drawings"
    table = tomllib.loads((folder / "drawings.toml").read_text())["drawing"]
    write_rows("guides/drawings.csv", [drawing_row(folder, row) for row in table])


def drawing_row(folder: Path, row: dict[str, Any]) -> dict[str, str]:
    """The drawing, its options, and the reader's warnings or refusal."""
    path = folder / row["file"]
    options = {key: row[key] for key in ("size", "curvature") if key in row}
    try:
        reported = " ".join(f"{line}." for line in cf.read_sketch(path, **options).reading.warnings)
    except InputError as error:
        reported = f"error: {error}".replace(f"{path}: ", "")
    texts = {key: value if key == "size" else shlex.join(value) for key, value in options.items()}
    set_by = " ".join(f"--{key} {text}" for key, text in texts.items())
    facts = {"drawing": row["file"], "program": row["program"], "content": row["shows"]}
    return {**facts, "options": set_by, "reported": reported}


def write_programs() -> None:
    """Replace the table of programs and the list of starts inside docs/guides/solvers.md."""
    rows = read_rows("guides/solvers/programs.csv")
    programs = {program.title: program for program in PROGRAMS.values()}
    cells = [
        [row["program"], f"`{program.install}`", row["version"], row["agree"], program.free]
        for row in rows
        for program in [programs[row["program"]]]
    ]
    heads = ("program", "installation", "version", "files read as meant", "largest model of the free edition")
    replace_between(DOCS / "guides" / "solvers.md", "programs", markdown(heads, cells))
    starts = (f"- {SOLVERS[name].title}: `{start.use}`" for name, start in STARTS.items())
    replace_between(DOCS / "guides" / "solvers.md", "starts", "\n".join(starts))


def write_claims() -> None:
    """Write docs/files/claims.csv: the table of statuses, which code reads from the package."""
    shutil.copyfile(DOCS.parent / "export" / "statuses.csv", DOCS / "files" / "claims.csv")


def draw_figures() -> None:
    """Draw docs/pictures/first_*.svg and math_*.svg: docs/cross-field.md and docs/mathematics.md."""
    import diagrams

    diagrams.draw(DOCS / "pictures")


def write_studies() -> None:
    """Replace the numbers of finished studies in their pages, from the CSV files beside them."""
    import studies

    for page, name, text in studies.texts():
        replace_between(DOCS / page, name, text)


def write_library() -> None:
    """Replace the counts of the library that ships in docs/library.md."""
    import shipped_library

    shipped_library.replace_counts()


def draw_proof() -> None:
    """Draw docs/pictures/proof_levels.png."""
    import proof_pictures

    proof_pictures.draw_levels()


def draw_surfaces() -> None:
    """Draw the pictures of docs/surface.md."""
    import surface_pictures

    surface_pictures.draw_pictures()


def draw_strokes() -> None:
    """Draw docs/pictures/stroke_*.png: good and bad strokes, for docs/guides/drawing.md."""
    import stroke_pictures

    stroke_pictures.draw_pictures()


def write_architecture() -> None:
    """Write docs/architecture.svg and its table, as they are now."""
    import rooms

    (DOCS / "architecture.svg").write_text(rooms.picture(DOCS.parent))
    (DOCS / "architecture" / "rooms.csv").write_text(csv_text(rooms.table(DOCS.parent)))


def replace_between(page: Path, name: str, text: str) -> None:
    """Insert a generated table between its two markers in a page."""
    head, begin, rest = re.split(rf"(<!-- {name}: .*? -->\n)", page.read_text(), maxsplit=1)
    page.write_text(f"{head}{begin}{text}\n{rest[rest.index(f'<!-- end of {name} -->') :]}")


PAGES: dict[str, Callable[[], None]] = {
    "formulations": write_formulations,
    "gallery": write_gallery,
    "drawings": write_drawings,
    "tutorials": draw_tutorials,
    "figures": draw_figures,
    "surfaces": draw_surfaces,
    "strokes": draw_strokes,
    "proof": draw_proof,
    "architecture": write_architecture,
    "programs": write_programs,
    "claims": write_claims,
    "library": write_library,
    "studies": write_studies,
}


def main() -> None:
    """Make the pages named on the command line, or all."""
    for name in sys.argv[1:] or PAGES:
        PAGES[name]()


if __name__ == "__main__":
    main()
