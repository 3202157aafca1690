"""Tables on a terminal: they fit its width, and no word is broken."""

import pytest
from crossfield.export.cli.output import WIDTH, show_table

STATUS = ["two-stage", "optimal-local", "limit-without-point"]
NUMBER = "0.0001046478218"
SENTENCE = "its optimum is 1.25, and another program has 1.5 for the same problem"


@pytest.mark.parametrize(
    "columns, row",
    [
        (
            ("solver", "status", "claimed", "objective", "bound", "reason"),
            [*STATUS, NUMBER, NUMBER, SENTENCE],
        ),
        (tuple(f"column{number}" for number in range(8)), ["12345678"] * 8),
        (tuple(f"column{number}" for number in range(12)), ["1234567890"] * 12),
        (("file", "result"), ["x" * 90, SENTENCE]),
        (("name", "summary"), ["", " ".join([SENTENCE] * 5)]),
    ],
)
@pytest.mark.parametrize("header", [True, False])
def test_words_stay_whole_within_80_columns(capsys, columns, row, header):
    show_table("title", columns, [row, row], numbers=columns[1:], header=header)
    shown = capsys.readouterr().out
    assert all(len(line) <= WIDTH or len(line.split()) == 1 for line in shown.splitlines())
    for cell in row:
        for word in cell.split():
            assert shown.split().count(word) >= 2, word
