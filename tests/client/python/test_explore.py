"""Explorations: results of the commands, as arrays."""

import json

import numpy as np
import pytest

import oblique
from conftest import run_oblique


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_sensitivity_gives_arrays_in_the_order_of_the_inputs(folder):
    found = oblique.sensitivity(
        H=0.9, mu="0.1:1.8", e="0.5:1", preset="paper", rows=16, interval=9, of="fn_peak_N"
    )
    assert found.inputs == found.input.tolist() == ["mu", "e"]
    assert found.points == 64
    assert found.rows.tolist() == [16, 16]
    assert found.total.dtype == np.float64
    assert (found.first_from <= found.first_to).all()


def test_values_may_be_lists_tuples_ranges_arrays_and_numpy_scalars(folder):
    flags = {"H": np.float64(0.9), "preset": "paper", "rows": np.int64(4), "interval": 9}
    of_text = oblique.sensitivity(mu="0.1,0.4", e="0.5,1", of="fn_peak_N,duration_s", **flags)
    assert of_text.inputs == ["mu", "e"]
    for kind in (list, tuple, np.array, iter):
        found = oblique.sensitivity(
            mu=kind([0.1, 0.4]), e=kind([0.5, 1.0]), of=kind(["fn_peak_N", "duration_s"]), **flags
        )
        assert found.study == of_text.study, kind
        np.testing.assert_array_equal(found.total, of_text.total)
    varied = oblique.sensitivity(mu=range(1, 3), e=1, of="mu", no_reuse=np.True_, **flags)
    assert varied.total.tolist() == [1.0]
    several = oblique.sensitivity(mu=[0.1, 0.4], e=1, lengths=(0.4, 0.4, 0.39), **flags)
    assert several.points == 12


@pytest.mark.parametrize("mu", [[], "", np.zeros((2, 2)), [[0.1, 0.4]], ["0.1", ""]])
def test_empty_values_and_several_dimensions_are_a_value_error(folder, mu):
    with pytest.raises(ValueError, match="mu: the value"):
        oblique.sensitivity(H=1, mu=mu, e="0.5:1")


def test_wrong_flags_are_a_value_error(folder):
    with pytest.raises(ValueError, match="no value is drawn"):
        oblique.sensitivity(H=1, mu=0.4, e=1)


def test_an_empty_value_is_refused_before_anything_is_solved(folder):
    for flags in ({"db": ""}, {"of": ["fn_peak_N", ""]}, {"study": ""}):
        with pytest.raises(ValueError, match="the value is empty"):
            oblique.map(**{"x": "mu=0.1:1", "y": "H=0.5:1", "e": 1, "no_reuse": True, **flags})
    assert list(folder.iterdir()) == []


def test_uncertainty_gives_arrays_with_an_entry_for_each_statistic(folder):
    run_oblique(
        "run", "--H", "0.9", "--mu", "0.1:1.8", "--e", "0.8", "--preset", "paper", "--quiet",
        "--sample", "random:100", "--name", "spread",
    )
    found = oblique.uncertainty("spread", of=["mu", "major_mode"], quantiles=np.array([0.25, 0.5]))
    assert found.points == 100
    median = found.value[found.statistic == "quantile 0.5"]
    assert median == pytest.approx([0.95], abs=0.35)
    assert found.value[found.output == "major_mode"].sum() == pytest.approx(1)
    assert np.isfinite(found.value_to[found.statistic == "mean"]).all()


def test_a_map_is_that_of_the_program(tmp_path):
    flags = {
        "x": "mu=0.1:1", "y": "H=0.5:1", "e": 1, "preset": "paper", "cells": 4, "bracket": 1e-2,
        "db": str(tmp_path / "map.db"),
    }  # fmt: skip
    found = oblique.map(**flags)
    words = [f"--{name}={value}" for name, value in flags.items()]
    of_program = json.loads(run_oblique("map", "--format", "json", *words))
    assert found.x.dtype == found.width.dtype == np.float64 and len(found.x) > 5
    for name, member in (("x", "x"), ("y", "y"), ("region_from", "from"), ("along", "along")):
        assert found[name].tolist() == [vertex[member] for vertex in of_program["vertices"]]
    assert [curve.tolist() for curve in found.curves] == of_program["curves"]
    assert found.regions == of_program["regions"] and found.x_key == "mu"
