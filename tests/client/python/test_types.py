"""Type hints of the module, checked with mypy; skipped if mypy is not installed."""

import os
import pathlib
import subprocess
import sys

import pytest

import oblique

USE = """
import numpy as np
import oblique

impact = oblique.solve(H=1, mu=0.4, e=1, k=2.7e7)
force: float = impact.fn_peak_N
loss: float = impact.energy.friction_J
sweep = oblique.solve_many(1.0, np.linspace(0.1, 2, 4), [1.0], E=[70e9], threads=2)
largest: np.float64 = np.max(sweep.fn_peak_N)
answer = oblique.Database("oblique.db").query("sweep", where="mu > 1", limit=10)
rows: int = len(answer)
"""


def strictly_typed(cache, *words):
    mypy = pytest.importorskip("mypy.api")
    os.environ["MYPYPATH"] = str(pathlib.Path(oblique.__file__).parent.parent)
    output, errors, code = mypy.run(["--strict", "--cache-dir", str(cache), *words])
    assert code == 0, output + errors


def test_a_program_that_uses_the_module_is_typed_strictly(tmp_path):
    (tmp_path / "use.py").write_text(USE)
    strictly_typed(tmp_path, str(tmp_path / "use.py"))


@pytest.mark.full
def test_the_module_itself_is_typed_strictly(tmp_path):
    # Debian 12's pandas has no type annotations.
    strictly_typed(tmp_path, "--ignore-missing-imports", "-p", "oblique")
