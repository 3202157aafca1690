"""Code that loads an entry in common programs: a few lines each, with the entry's own files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from ....models.formulations.catalogue import FORMULATIONS
from ....models.formulations.problem import Problem
from ...solvers_table import takes

_NO_NAMES: Final = (
    "JuMP reads no names with .nl files: line i of the .col file names variable i. Without the option it"
    " builds a legacy nonlinear block"
)


@dataclass(frozen=True)
class Way:
    """A program, the lines that load an entry there (empty if it cannot), and a note."""

    title: str
    text: str
    note: str = ""


def ways(entry: dict[str, Any], problem: Problem) -> Iterator[Way]:
    """Yield the lines that load an entry in HiGHS, Gurobi, Pyomo, JuMP, GAMS and AMPL."""
    model, support = _first(entry, "mps", "lp"), takes(problem, "highs")
    if model and support.answer != "no":
        text = f'import highspy\nhighs = highspy.Highs()\nhighs.readModel("{model}"); highs.run()'
        yield Way("HiGHS, in Python", text, "pip install highspy brings no highs command.")
    elif support.reason:
        yield Way("HiGHS", "", support.reason)
    if model:
        text = f'import gurobipy\nmodel = gurobipy.read("{model}")\nmodel.optimize()'
        yield Way("Gurobi, in Python", text)
    yield _pyomo(entry)
    if name := _first(entry, *(("mps", "lp", "nl") if entry["class"] in ("LP", "MILP") else ("nl",))):
        nl = name.removesuffix(".gz").endswith(".nl")
        options, note = ("; use_nlp_block = false", _NO_NAMES) if nl else ("", "")
        yield Way("JuMP, in Julia", f'using JuMP\nmodel = read_from_file("{name}"{options})', note)
    if name := _first(entry, "gms"):
        command, (name,) = _unpacked(name)
        yield Way("GAMS", f"{command}gams {name}")
    files = [each["name"] for each in entry["files"] if each["format"] == "mod"]
    if files:
        command, names = _unpacked(*sorted(files, key=lambda name: ".dat" in name))
        lines = " ".join(f"{'data' if '.dat' in name else 'model'} {name};" for name in names)
        yield Way("AMPL", f"{lines} solve;", f"In a shell before: {command.strip()}" if command else "")


def _first(entry: dict[str, Any], *formats: str) -> str:
    """The name of its first model file in one of these formats; empty where it has none."""
    found = (each["name"] for form in formats for each in entry["files"] if each["format"] == form)
    return next((name for name in found if ".row" not in name and ".col" not in name), "")


def _unpacked(*names: str) -> tuple[str, tuple[str, ...]]:
    """The command that unpacks packed files, with its line's end, and the unpacked names."""
    packed = [name for name in names if name.endswith(".gz")]
    command = f"gunzip -k {' '.join(packed)}\n" if packed else ""
    return command, tuple(name.removesuffix(".gz") for name in names)


def _pyomo(entry: dict[str, Any]) -> Way:
    """Pyomo reads no model files: the model is made from the instance."""
    settings = [repr(entry["formulation"]), *_settings(entry)]
    lines = [
        "import crossfield as cf",
        f"instance = cf.read_instance({entry['instance']['file']!r})",
        f"model = cf.to_pyomo(cf.formulate(instance, {', '.join(settings)}))",
    ]
    if entry["jumps"] is not None:
        lines[:1] = ["import json", "import crossfield as cf", "import numpy as np"]
        lines[-1:] = [
            "p = np.zeros(len(instance.grid.first), dtype=int)",
            f"for pair, jump in json.load(open('{entry['name']}.json'))['jumps']: p[pair] = jump",
            lines[-1].replace("))", ", p=p))"),
        ]
    return Way("Pyomo", "\n".join(lines), "Pyomo reads no model files: crossfield makes the model.")


def _settings(entry: dict[str, Any]) -> list[str]:
    """The options of an entry that are not the defaults of its formulation, as arguments."""
    declared = FORMULATIONS[entry["formulation"]]
    return [
        f"{key}={value!r}"
        for key, value in entry["options"].items()
        if key in declared.settable and value != getattr(declared.defaults, key)
    ]
