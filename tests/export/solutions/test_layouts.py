"""Layouts of answers as people have them: lists, listings, documents, prints, and answers in other text."""

import json
import re

import crossfield as cf
import pandas as pd
import pytest
from answers import TINY, listed
from crossfield.export.solutions.readers import grammar
from crossfield.export.solutions.readers.registry import parse_raw, read_raw, recognising_readers
from crossfield.models.text_rows import plain_text
from loops import for_each


def text(file):
    return (TINY / file).read_bytes()


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


def printed(form):
    return "".join(form.format(name, value) for name, value in PAIRS)


PRINTED = {
    "CSV with an index": FRAME.to_csv(),
    "CSV": FRAME.to_csv(index=False),
    "CSV without a heading": FRAME.to_csv(index=False, header=False),
    "CSV of a series": pd.Series(VALUES, NAMES).to_csv(),
    "CSV, quoted": '"name","value"\n' + printed('"{}","{}"\n'),
    "CSV, blanks": "\n\n" + printed("{} , {}\n"),
    "CSV with semicolons": printed("{};{}\n"),
    "German": ("Name;Wert\r\n" + printed("{};{}\r\n")).replace(".", ","),
    "German, quoted": "\ufeff" + printed('"{}";"{}"\n').replace(".", ","),
    "equals": printed("{} = {}\n"),
    "equals, semicolons": printed("{}={};\n").replace("=0.", "=."),
    "colon": printed("{}: {}\n"),
    "linopy": "labels,lower,upper,solution\n" + printed("{},0,1,{}\n"),
    "dictionary": json.dumps(dict(PAIRS)),
    "nested": json.dumps({"solution": dict(PAIRS), "status": "feasible"}),
    "nested variables": json.dumps({"variables": dict(PAIRS)}),
    "flat": json.dumps({"status": "feasible", **dict(PAIRS)}),
    "records": FRAME.to_json(orient="records"),
    "columns": FRAME.to_json(),
    "split": FRAME.to_json(orient="split"),
    "series": pd.Series(VALUES, NAMES).to_json(),
    "Python": str(dict(PAIRS)),
    "Julia": "Dict(" + ", ".join(f'"{name}" => {value}' for name, value in PAIRS) + ")\n",
    "Julia, shown": "Dict{String, Float64} with 3 entries:\n" + printed('  "{}" => {}\n'),
    "arrows": printed("{} => {}\n"),
    "AMPL": printed("let {} := {};\n"),
    "GAMS": printed("{}.l = {};\n"),
    "OSrL": OSRL % printed('<var idx="0" name="{}">{}</var>\n'),
}


@for_each("program", PRINTED)
def test_what_programs_and_people_print_is_read(program):
    data = PRINTED[program].encode()
    raw = parse_raw(data)
    assert listed(raw) == {name.encode(): value for name, value in PAIRS}
    optimal = ("optimal-local", 3.5) if program == "OSrL" else ("feasible", None)
    assert (raw.status, raw.objective, raw.omits_zeros) == (*optimal, False)
    assert len(recognising_readers(plain_text(data))) == 1


@for_each("data, fault", [
        (b"a,1\nb,one\nc,3\n", "line 2: 'one' is not a number"),
        (b"a;1\nb;1.5,2\n", "line 2: '1.5.2' is not a number"),
        (b"a = 1\nb = nan\n", "line 2: 'nan' is not a number"),
        (b"a = 1\nb", "line 2: the file is cut off in the middle of this line"),
        (b'{"a": 1, "a": 2}', "an object has a key twice"),
        (b'{"a": 1, "b": "2"}', r"\('b', '2'\)\" is not a name with a value"),
        (b'{"a": 1, "b": NaN}', "b has no value"),
        (b'{"a": 1, "b": true}', "is not a name with a value"),
        (b'{"variables": {}}', "is not a name with a value"),
        (b'{"variables": 3}', "is not a name with a value"),
        (b'{"a": 1,', "line 1: the JSON is damaged or cut off at column 9"),
        (b"once upon a time\n", r"in Python: for name, value in values\.items\(\): print"),
    ])  # fmt: skip
def test_faults_in_lists_and_documents_are_named(data, fault):
    with pytest.raises(cf.SolutionError, match=fault):
        parse_raw(data)


def test_exact_fractions_of_qsopt_are_numbers():
    third = b"1%b/3%b" % (b"0" * 400, b"0" * 400)
    head = b"status = OPTIMAL\nstatus OPTIMAL\n\tValue = -7/2\nVARS:\n"
    raw = parse_raw(head + b"x = 1/3\ny = -%b\nREDUCED COST:\nx = 5\n" % third)
    assert listed(raw) == {b"x": 1 / 3, b"y": -1 / 3}
    assert (raw.status, raw.objective, raw.omits_zeros) == ("optimal-global", -3.5, True)


# other text


@for_each("file, begin, end", [
        ("highs-1.15.1", b"Model status\n", b"# Dual"), ("scip-10.0", b"objective value:", None),
        ("cbc-2.10.8", b"Optimal - objective value", b"Total time"), ("glpk-5.0", b"c Problem:", None),
    ])  # fmt: skip
def test_text_before_and_after_changes_nothing(file, begin, end):
    data = text(f"{file}_milp_optimal_log.txt")
    alone = parse_raw(data[data.index(begin) : data.index(end) if end else len(data)])
    mail = b"Dear all,\nhere is the answer:\n\n" + data + b"\nBest wishes\nX.\n"
    for inside in (parse_raw(data), parse_raw(mail)):
        for attribute in ("reader", "status", "message", "objective", "bound", "rows", "omits_zeros"):
            assert getattr(inside, attribute) == getattr(alone, attribute)
        assert list(inside.values) == list(alone.values)


def test_claims_come_from_the_answer_only():
    """A log states `optimal`, and a mail anything: neither is a claim of the list of values."""
    for file, claim in (
        ("scip-10.0_milp_optimal_log.txt", b"problem is solved [optimal solution found]"),
        ("neos-by-layout_milp_optimal_ampl.txt", b"optimal solution; objective 0.55"),
    ):
        raw = read_raw(TINY / file)
        assert claim in text(file)
        assert (raw.status, raw.bound) == ("feasible", None)
    assert raw.objective is None
    raw = parse_raw(b"Status: optimal\nobjective = 7\n\n" + b"".join(b"x%d = 1\n" % at for at in range(6)))
    assert (raw.status, raw.objective, len(raw.values)) == ("feasible", None, 6)


def test_a_damaged_line_inside_a_text_is_an_error_with_its_place():
    data = text("scip-10.0_milp_optimal_log.txt")
    damaged = re.sub(rb"(?m)^(psi_01_00 +)\S+", rb"\1many", data)
    line = data.count(b"\n", 0, data.index(b"psi_01_00")) + 1
    for words in (b"", b"\nBest wishes\n"):
        with pytest.raises(cf.SolutionError, match=f"line {line}: 'many' is not a number"):
            parse_raw(damaged + words)


def test_long_lists_are_read_in_pieces_and_in_linear_time(monkeypatch):
    count = 120_000
    data = b"name,value\n" + b"".join(b"alpha_%d,%d.5\n" % (at, at) for at in range(count))
    assert listed(parse_raw(data)) == (expected := {b"alpha_%d" % at: at + 0.5 for at in range(count)})
    with pytest.raises(cf.SolutionError, match=f"line {count // 2 + 2}: 1 words stand where 2 should"):
        parse_raw(data.replace(b"alpha_60000,60000.5", b"alpha_60000="))
    remarks = "".join(f"# a remark\nalpha_{at:06d} {at}\n" for at in range(20_000))
    assert len(parse_raw(remarks.encode()).values) == 20_000
    for piece in (1, 40, 1 << 12):
        monkeypatch.setattr(grammar, "PIECE", piece)
        short = listed(parse_raw(data[: data.index(b"alpha_2000,")]))
        assert short == dict(list(expected.items())[:2000])
