"""Fits: results equal those of the program and are arrays."""

import json

import numpy as np
import pytest

import oblique
from conftest import run_oblique


def test_a_fit_is_that_of_the_program(tmp_path):
    measured = tmp_path / "measured.csv"
    measured.write_text("H,mu,fn_peak_N\n1,0.4,5000\n0.9,0.4,4600\n")
    flags = {"sd": "1%", "e": 1, "preset": "paper", "db": str(tmp_path / "fit.db")}
    found = oblique.fit(str(measured), {"k": (1e7, 1e8)}, **flags)
    words = [f"--{name}={value}" for name, value in flags.items()]
    of_program = json.loads(
        run_oblique("fit", str(measured), "--fit=k=1e7:1e8", "--format", "json", *words)
    )
    assert found.names == ["k"]
    assert found.value.tolist() == [of_program["unknowns"][0]["value"]]
    assert found.lower_95[0] < found.value[0] < found.upper_95[0]
    assert found.correlation.shape == (1, 1) and found.residuals.shape == (2,)
    assert found.chi2 == of_program["chi2"]
    with pytest.raises(ValueError, match="kk"):
        oblique.fit(str(measured), {"kk": (1, 2)}, **flags)
