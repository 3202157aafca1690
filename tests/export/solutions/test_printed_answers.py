"""Lists of names and values as data frames, dictionaries and scripts print them."""

import pandas as pd
import pytest
from crossfield.export.solutions.readers.registry import parse_raw
from crossfield.models.errors import SolutionError
from loops import for_each

NAMES, VALUES = ["alpha_00_00", "beta_00_00", "p1_00_00_u"], [0.5, -1e-3, 1.0]
FRAME = pd.DataFrame({"name": NAMES, "value": VALUES})
PAIRS = list(zip(NAMES, VALUES, strict=True))
OSRL = """<?xml version="1.0"?>
<osrl xmlns="os.optimizationservices.org">
<general><generalStatus type="normal"/></general>
<optimization numberOfSolutions="1"><solution targetObjectiveIdx="-1"><status type="optimal"/>
<variables><values numberOfVar="3">
%s</values></variables><objectives><values numberOfObj="1"><obj idx="-1">3.5</obj></values></objectives>
</solution></optimization></osrl>
"""
PRINTED = {
    "CSV with an index": FRAME.to_csv(),
    "linopy": "labels,lower,upper,solution\n" + "".join(f"{name},0,1,{value}\n" for name, value in PAIRS),
    "records": FRAME.to_json(orient="records"),
    "columns": FRAME.to_json(),
    "split": FRAME.to_json(orient="split"),
    "series": pd.Series(VALUES, NAMES).to_json(),
    "Python": str(dict(PAIRS)),
    "Julia": "Dict(" + ", ".join(f'"{name}" => {value}' for name, value in PAIRS) + ")\n",
    "Julia, shown": "Dict{String, Float64} with 3 entries:\n"
    + "".join(f'  "{name}" => {value}\n' for name, value in PAIRS),
    "arrows": "".join(f"{name} => {value}\n" for name, value in PAIRS),
    "AMPL": "".join(f"let {name} := {value};\n" for name, value in PAIRS),
    "GAMS": "".join(f"{name}.l = {value};\n" for name, value in PAIRS),
    "OSrL": OSRL % "".join(f'<var idx="0" name="{name}">{value}</var>\n' for name, value in PAIRS),
}


@for_each("program", PRINTED)
def test_what_programs_print_is_read(program):
    raw = parse_raw(PRINTED[program].encode())
    assert raw.names.tolist() == [name.encode() for name in NAMES]
    assert list(raw.values) == VALUES
    assert (raw.status, raw.objective) == (
        ("optimal-local", 3.5) if program == "OSrL" else ("feasible", None)
    )


def test_an_unknown_text_states_how_python_writes_an_answer():
    with pytest.raises(SolutionError, match=r"in Python: for name, value in values\.items\(\): print"):
        parse_raw(b"once upon a time\n")
