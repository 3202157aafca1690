"""GLPK's MathProg as a second implementation of AMPL: it evaluates every expression of a .mod.

It solves linear models only, but prints the value of any expression once variables are parameters.
"""

import re
import subprocess

import numpy as np


def glpsol(*arguments):
    """The output of GLPK."""
    done = subprocess.run(["glpsol", *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    return done.stdout


def difference(path, problem, point):
    """What GLPK finds in a .mod at a point that the problem has not; bounds to the bit."""
    text, meaning = _as_parameters(path.read_text())
    path.with_suffix(".parameters").write_text(text)
    data = path.with_suffix(".dat").read_text().removesuffix("end;\n") + _as_data(problem, point)
    path.with_suffix(".values").write_text(data)
    out = glpsol("-m", path.with_suffix(".parameters"), "-d", path.with_suffix(".values"), "--check")
    printed = {name: [] for name in meaning}
    for number, value in re.findall(r"^(\d+) (\S+)$", out, re.MULTILINE):
        printed[meaning[int(number)]].append(float(value))
    expected = {"objective": ([problem.objective_value(point)], 1e-9)}
    for family in problem.rows:
        sense = family.family.sense.replace("==", "=")
        expected[f"{family.family.tag} {sense}"] = family.values(point), 1e-9
    for block in problem.blocks.values():
        for sign, ends in ((">=", block.lower), ("<=", block.upper)):
            if block.count and np.isfinite(ends).all():
                expected[f"{sign} {block.name}"] = ends, 0
    extra = {name for name in printed.keys() ^ expected.keys() if printed.get(name) or name in expected}
    wrong = [
        name
        for name in expected.keys() - extra
        if not np.allclose(printed[name], expected[name][0], rtol=expected[name][1], atol=expected[name][1])
    ]
    integer = {*re.findall(r"^var (\w+)\{[^}]*\} integer", path.read_text(), re.MULTILINE)}
    integer ^= {block.name for block in problem.blocks.values() if block.integer and block.count}
    return ", ".join(sorted([*extra, *wrong, *integer]))


def _as_parameters(text):
    """The model with variables as parameters, which prints `number value`, and what each number means."""
    meaning, ends = ["objective"], []

    def printed(label, domain, expression):
        meaning.append(label)
        return f'printf{domain}: "{len(meaning) - 1} %.17g\\n", {expression};\n'

    def row(match):
        tag, domain, left, sense, right = match.groups()
        return printed(f"{tag} {sense}", domain, f"({left}) - ({right})")

    def variable(match):
        name, domain, attributes = match.groups()
        parts = re.split(r", (?=[<>]=)|(?<=integer), ", attributes.strip())
        ends.extend((name, domain, end[:2], end[3:]) for end in parts if end[:1] in set("<>"))
        return f"param {name}{domain};"

    text = re.sub(r"[ ]*#.*", "", text)
    text = re.sub(r"^var (\w+)(\{[^}]*\})(.*);$", variable, text, flags=re.MULTILINE)
    goal = r"minimize energy:(.*?);\n"
    text = re.sub(goal, lambda match: f'printf "0 %.17g\\n", {match[1]};\n', text, flags=re.DOTALL)
    text = re.sub(r"subject to (\w+)(\{.*?\}):\s*(.*?) ([<>]?=) (.*?);\n", row, text, flags=re.DOTALL)
    bounds = [printed(f"{sign} {name}", domain, end) for name, domain, sign, end in ends]
    return text + "".join(bounds) + "end;\n", meaning


def _as_data(problem, point):
    """The values of all columns in the style of a .dat."""
    names, lines = problem.column_names, []
    for block in filter(lambda block: block.count, problem.blocks.values()):
        lines.append(f"param {block.name} :=")
        for name, value in zip(names[block.slice], point[block.slice].tolist(), strict=True):
            place = re.sub(r"_0*(\d)", r" \1", name.removeprefix(block.name)).replace("_", " ")
            lines.append(f"{place} {value:.17g}")
        lines.append(";")
    return "\n".join([*lines, "end;\n"])
