"""Explorations: the same as the programs, as arrays."""

import json

import numpy as np
import pytest

import oblique
from conftest import run_oblique


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


def test_wrong_usage_is_a_value_error(tmp_path):
    with pytest.raises(ValueError, match="--of colour"):
        oblique.map(x="mu=0.1:1", y="H=0.5:1", e=1, of="colour", db=str(tmp_path / "map.db"))
