"""Explorations: the commands ``oblique map``, ``sensitivity``, ``fit`` and ``uncertainty``.

They run the program ``oblique``, which solves the points as a study of a database or server: a call
that was stopped continues when it is made again.
"""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
from typing import Any, Dict, List, Mapping, Optional, Sequence

import numpy as np

from ._results import Named


def program() -> str:
    """The program ``oblique`` beside this module, as built or installed; else that of PATH."""
    here = pathlib.Path(__file__).resolve()
    for folder in (here.parents[2], here.parents[4]):
        beside = folder / "bin" / "oblique"
        if os.access(beside, os.X_OK):
            return str(beside)
    found = shutil.which("oblique")
    if found is None:
        raise FileNotFoundError("cannot find the program oblique: its folder must be in PATH")
    return found


def run(verb: str, study: Optional[str] = None, **flags: Any) -> Any:
    """The JSON that ``oblique VERB [STUDY] --flag value ... --format json`` prints.

    ``tip_mass=0.1`` is ``--tip-mass 0.1``, a list or tuple repeats the flag, True is a flag without
    a value; None and False leave it out. Raises ValueError for wrong usage and RuntimeError for
    other failures, with the sentences of the program.
    """
    words = [program(), verb, *([study] if study is not None else []), "--format", "json", "--quiet"]
    for name, value in flags.items():
        flag = "--" + name.replace("_", "-")
        for each in value if isinstance(value, (list, tuple)) else [value]:
            if each is True:
                words.append(flag)
            elif each is not None and each is not False:
                words.append(f"{flag}={each}")
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        raise (ValueError if ended.returncode == 2 else RuntimeError)(ended.stderr.strip())
    return json.loads(ended.stdout)


class Fit(Named):
    """A fit. ``names``, ``value``, ``sd``, ``lower_95`` and ``upper_95`` (NumPy arrays; NaN for what the data
    do not determine) have an entry for each unknown; ``correlation`` is a matrix; ``fitted`` and
    ``residuals`` (in standard deviations) have an entry for each measured number, and ``rows`` are dicts
    of these as in the JSON of ``oblique fit``. ``notes`` says what the data leave open."""


def fit(measured: str, unknowns: Mapping[str, Sequence[float]], **flags: Any) -> Fit:
    """``oblique fit``: ``oblique.fit("measured.csv", {"k": (1e7, 1e8)}, sd="1%", preset="paper")``. An
    unknown has its bounds, and perhaps its start."""
    texts = [f"{key}={':'.join(repr(float(end)) for end in ends)}" for key, ends in unknowns.items()]
    found = run("fit", measured, fit=texts, **flags)
    of_unknowns, rows = found.pop("unknowns"), found.pop("residuals")

    def column(objects: List[Dict[str, Any]], name: str) -> Any:
        return np.array([each[name] for each in objects], dtype=float)

    return Fit(
        names=[each["unknown"] for each in of_unknowns],
        value=column(of_unknowns, "value"),
        sd=column(of_unknowns, "sd"),
        lower_95=column(of_unknowns, "lower_95"),
        upper_95=column(of_unknowns, "upper_95"),
        correlation=np.array(found.pop("correlation"), dtype=float),
        fitted=column(rows, "fitted"),
        residuals=column(rows, "residual_sd"),
        rows=rows,
        **found,
    )
