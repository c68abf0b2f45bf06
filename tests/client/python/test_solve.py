"""One point, and its time histories."""

import csv
import doctest
import importlib
import os
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest

import oblique
from conftest import run_oblique, solved_by_program, without_time


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"mu": 1.2, "e": 0.8, "errors": True, "elements_per_link": 2},
        {"preset": "printed", "elements_per_link": 2, "tip_mass": 0.01},
        {"integrator": "generalized-alpha", "elements_per_link": 1},
        {"lengths": [0.4, 0.5, 0.3], "elements_per_link": 2},
        {"length2": 0.5, "I": "A^2 / (4 * pi)", "elements_per_link": 2},
    ],
)
def test_a_point_has_all_fields_and_the_bits_of_solve_json(keys):
    keys = {"H": 1, "mu": 0.4, "e": 1, **keys}
    flags = []
    for key, value in keys.items():
        flags.append("--" + key.replace("_", "-"))
        if key == "lengths":
            value = ",".join(map(str, value))
        if value is not True:
            flags.append(str(value))
    assert without_time(oblique.solve(**keys)._asdict()) == solved_by_program(*flags)


def test_a_value_probably_in_another_unit_is_warned_of_once_per_key():
    with pytest.warns(UserWarning) as warned:
        oblique.solve_many(1, 0.4, 1, rho=[2.7, 2700], tip_mass=20, elements_per_link=1)
    assert [str(one.message) for one in warned] == [
        "rho = 2.7 kg/m^3 is outside the usual 100 to 25000 kg/m^3; 2700?",
        "tip_mass = 20 kg is outside the usual 1e-6 to 10 kg; 0.02?",
    ]
    assert {one.filename for one in warned} == {__file__}
    with pytest.warns(UserWarning, match="length = 400 m is outside the usual 0.001 to 100 m; 0.4"):
        oblique.solve(1, 0.4, 1, lengths=[0.4, 400], elements_per_link=1)


def test_results_show_what_they_are():
    impact = oblique.solve(1, 0.4, 1)
    assert repr(impact).startswith("Result(H=1.0, mu=0.4, e=1.0, fall_time_s=0.43")
    assert list(impact)[:4] == ["H", "mu", "e", "fall_time_s"]
    assert impact.energy.closure < 1e-6
    assert impact.phases[0]["kind"] == "compression"
    assert pickle.loads(pickle.dumps(impact)) == impact


@pytest.mark.parametrize(
    "keys, sentence",
    [
        ({"mu": -0.4}, "mu = -0.4 is not allowed: mu must be >= 0"),
        ({"H": 5}, "H = 5 m is not allowed: the tip drops at most the length of the chain, 1.2 m"),
        ({"tip_mas": 1}, "unknown key `tip_mas` (did you mean `tip_mass`?)"),
        ({"preset": "papr"}, 'preset = "papr" is not allowed: preset must be standard, paper, printed, converged'),
        ({"integrator": "euler"}, 'integrator = "euler" is not allowed'),
        ({"mu": None}, "mu = None is not allowed: mu must be a number"),
        ({"mu": [0.1, 0.2]}, "mu has 2 values: solve takes one; oblique.solve_many takes arrays"),
        ({"I": "A^2 / (4 * p)"}, 'I = "A^2 / (4 * p)": unknown key `p`'),
        ({"mu": 10**400}, "is not allowed: mu must be a number"),
        ({"mu": True}, "mu = True is not allowed: mu must be a number"),
        ({"H": ""}, "H = '' is not allowed: H must be a number"),
        ({"integrator": ""}, "integrator = '' is not allowed"),
        ({"preset": None}, "preset = None is not allowed"),
        ({"lengths": []}, "lengths must be the length of each link"),
        ({"lengths": [0.5], "links": "2"}, "lengths cannot be combined with links or length"),
        ({"mu": np.ma.masked}, "mu = nan is not allowed"),
    ],
)
def test_a_wrong_value_is_a_value_error_that_names_key_value_and_range(keys, sentence):
    with pytest.raises(ValueError) as error:
        oblique.solve(**{"H": 1, "mu": 0.4, "e": 1, **keys})
    assert sentence in str(error.value)


def test_a_point_without_an_answer_is_a_solve_error():
    with pytest.raises(oblique.SolveError, match="too short") as error:
        oblique.solve(1, 0.4, 1, dt=1e-25)
    assert error.type.__module__ == "oblique" and error.type.__doc__
    assert isinstance(pickle.loads(pickle.dumps(error.value)), oblique.SolveError)


def test_a_trace_has_the_columns_and_numbers_of_the_program(tmp_path):
    file = tmp_path / "trace.csv"
    run_oblique("solve", "--H", "1", "--mu", "0.4", "--e", "1", "--trace", str(file), "--trace-shape")
    with open(file, newline="") as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    trace = oblique.trace(1, 0.4, 1, shape=True)
    columns = {name: values for name, values in trace._asdict().items() if name != "result"}
    assert list(columns) == list(rows[0])
    assert len(trace) == len(rows)
    for name, values in columns.items():
        assert [str(v) if name == "state" else float(v) for v in values] == [
            row[name] if name == "state" else float(row[name]) for row in rows
        ]
    assert trace.fn_N.max() == pytest.approx(trace.result.fn_peak_N, rel=1e-3)


def test_a_trace_may_begin_with_the_fall():
    trace = oblique.trace(1, 0.4, 1, fall=True)
    assert trace.state[0] == "falling" and trace.t_s[0] < -0.4
    assert list(trace.to_pandas().columns)[:2] == ["t_s", "fn_N"]
    with pytest.raises(AttributeError, match="node0x_m"):
        trace.node0x_m


def test_threads_get_the_same_bits_as_one():
    expected = [oblique.solve(1, 0.1 * i, 1).fn_peak_N for i in range(8)]
    got = [0.0] * 8

    def solve(i):
        got[i] = oblique.solve(1, 0.1 * i, 1).fn_peak_N

    threads = [threading.Thread(target=solve, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert got == expected


@pytest.mark.parametrize("name", ["oblique", "oblique._solving", "oblique._results", "oblique._database"])
def test_examples_in_doc_strings_hold(name):
    module = importlib.import_module(name)
    assert doctest.testmod(module, optionflags=doctest.ELLIPSIS).failed == 0


def test_the_session_in_the_readme_is_correct():
    with open(os.environ["OBLIQUE_README"]) as file:
        text = file.read().replace("```", "")
    session = doctest.DocTestParser().get_doctest(text, {}, "README.md", "README.md", 0)
    assert doctest.DocTestRunner().run(session) == (0, 5)


def test_types_name_the_existing_fields():
    fields = {"": ["H", "mu", "e"], "energy": [], "errors": [], "solver": []}
    for name, group, *_ in oblique._core.fields():
        fields[group].append(name)
    groups = ["energy", "errors", "solver"]
    assert list(oblique.Result.__annotations__) == fields[""] + groups
    for kind in (oblique.Energy, oblique.Errors, oblique.Solver):
        assert list(kind.__annotations__) == fields[kind.__name__.lower()]
