"""Explorations: the commands of the program, as arrays."""

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
        H=0.9, mu="0.1:1.8", e="0.5:1", preset="paper", points=16, interval=9, of="fn_peak_N"
    )
    assert found.inputs == ["mu", "e"]
    assert found.points == 64
    indices = found.outputs["fn_peak_N"]
    assert indices.rows == 16
    assert indices.total["value"].shape == (2,)
    assert (indices.first["from"] <= indices.first["to"]).all()


def test_wrong_flags_are_a_value_error(folder):
    with pytest.raises(ValueError, match="no value is drawn"):
        oblique.sensitivity(H=1, mu=0.4, e=1)


def test_uncertainty_gives_arrays_over_parts_of_the_points(folder):
    run_oblique(
        "run", "--H", "0.9", "--mu", "0.1:1.8", "--e", "0.8", "--preset", "paper", "--quiet",
        "--sample", "random:100", "--name", "spread",
    )
    found = oblique.uncertainty("spread", of="mu,major_mode")
    mu = found.outputs["mu"]
    assert mu.points.tolist() == [12, 25, 50, 100]
    assert mu.statistics["quantile 0.5"]["value"][-1] == pytest.approx(0.95, abs=0.35)
    modes = found.outputs["major_mode"].statistics
    assert sum(modes[mode]["value"][-1] for mode in modes) == pytest.approx(1)
    assert np.isfinite(mu.statistics["mean"]["to"]).all()


def test_a_map_is_that_of_the_program(tmp_path):
    flags = {
        "x": "mu=0.1:1", "y": "H=0.5:1", "e": 1, "preset": "paper", "cells": 4, "bracket": 1e-3,
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
