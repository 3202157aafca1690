"""The banner that HiGHS 1.16 prints with the first model of a process is in no output of crossfield."""

import json
import subprocess
import sys

import pytest

PROGRAM = """
import json, runpy, sys, crossfield as cf
problem = cf.formulate(cf.sample("skew", 4), "milp-mccormick")
model = problem.to_highs()
model.run()
print(json.dumps({"status": problem.solution(model).status}), flush=True)
sys.argv[1:] = ["solve", "skew", "--size", "4", "-f", "milp-mccormick", "--json", "-o", sys.argv[1]]
runpy.run_module("crossfield", run_name="__main__")
"""


@pytest.mark.slow
def test_a_model_in_memory_and_a_solve_print_their_result_alone(tmp_path):
    command = [sys.executable, "-c", PROGRAM, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    first, second = done.stdout.split("\n", 1)
    assert [json.loads(text)["status"] for text in (first, second)] == ["optimal-global"] * 2
    assert done.stderr == ""
