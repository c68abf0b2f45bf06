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
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence

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

    ``tip_mass=0.1`` is ``--tip-mass 0.1``; a list, tuple, range or array ``mu=[0.1, 0.4]`` is
    ``--mu 0.1,0.4``. A list for ``fit`` repeats the flag. True is a flag without a value; None and
    False leave it out. Raises ValueError for wrong usage and RuntimeError for other failures, with
    the sentences of the program.
    """
    words = [program(), verb, *([] if study is None else [study]), "--format", "json", "--quiet"]
    for name, value in flags.items():
        flag = "--" + name.replace("_", "-")
        for each in value if name == "fit" else [_plain(name, value)]:
            if each is True:
                words.append(flag)
            elif each is not None and each is not False:
                words += [flag, str(each)]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        raise (ValueError if ended.returncode == 2 else RuntimeError)(ended.stderr.strip())
    return json.loads(ended.stdout)


def _plain(name: str, value: Any) -> Any:
    """A single value as a Python object; several values as a text, separated by commas."""
    if isinstance(value, Iterable) and not isinstance(value, (str, np.ndarray)):
        value = list(value)
    values = np.asarray(value, dtype=object)
    if values.size == 0 or "" in values.ravel():
        raise ValueError(f"{name}: the value is empty")
    if values.ndim > 1:
        raise ValueError(f"{name}: the values must be in one row")
    return np.asarray(value).item() if values.ndim == 0 else ",".join(str(each) for each in values)


def _column(rows: List[Dict[str, Any]], name: str, kind: Any = float) -> Any:
    """The values of that name as an array; numbers are NaN for null."""
    return np.array([row[name] for row in rows], dtype=kind)


class Map(Named):
    """Borders on a plane. The arrays ``x``, ``y``, ``width``, ``region_from``, ``region_to`` and
    ``along`` have an entry for each vertex; ``curves`` are arrays of vertex numbers; ``regions``
    and ``shifts`` are lists of dicts as in the JSON of ``oblique map``."""


def map(study: Optional[str] = None, **flags: Any) -> Map:
    """``oblique map``: ``oblique.map(x="mu=0.05:2", y="H=0.3:1.05", e=1, preset="paper")``."""
    found = run("map", study, **flags)
    vertices = found.pop("vertices")
    return Map(
        x=_column(vertices, "x"),
        y=_column(vertices, "y"),
        width=_column(vertices, "width"),
        region_from=_column(vertices, "from", object),
        region_to=_column(vertices, "to", object),
        along=_column(vertices, "along", object),
        curves=[np.array(curve, dtype=np.int64) for curve in found.pop("curves")],
        x_key=found.pop("x"),
        y_key=found.pop("y"),
        **found,
    )


def _with_columns(found: dict[str, Any]) -> Named:
    """The rows of a table as one array for each column, beside the other members."""
    rows = found.pop("rows")
    kinds = {name: object if isinstance(value, str) else float for name, value in rows[0].items()}
    return Named(**found, **{name: _column(rows, name, kind) for name, kind in kinds.items()})


def sensitivity(**flags: Any) -> Named:
    """Which inputs matter, as ``oblique sensitivity``: ``sensitivity(H=1, mu="0.05:1.9", e="0.5:1",
    of="fn_peak_N", preset="paper").total``.

    The arrays ``output``, ``input``, ``first``, ``first_from``, ``first_to``, ``total``, ... (with
    ``method="morris"`` ``mu_star``, ``sigma`` and ``mu``) have an entry for each output and input.
    """
    return _with_columns(run("sensitivity", **flags))


def uncertainty(study: str, **flags: Any) -> Named:
    """How the outputs of a sampled study are distributed, as ``oblique uncertainty``:
    ``found = uncertainty("spread", of="e"); found.value[found.statistic == "mean"]``.

    The arrays ``output``, ``statistic``, ``value``, ``value_from``, ``value_to``, ``half``,
    ``quarter`` and ``eighth`` have an entry for each statistic of each output.
    """
    return _with_columns(run("uncertainty", study, **flags))


class Fit(Named):
    """A fit. The list ``names`` and the arrays ``value``, ``sd``, ``lower_95`` and ``upper_95``
    (NaN for what the data do not determine) have an entry for each unknown; ``correlation`` is a
    matrix. The arrays ``fitted`` and ``residuals`` (in standard deviations) have an entry for each
    measured number; ``rows`` are its dicts in the JSON of ``oblique fit``. ``notes`` are sentences
    about what the data leave open."""


def fit(measured: str, unknowns: Mapping[str, Sequence[float]], **flags: Any) -> Fit:
    """``oblique fit``: ``oblique.fit("measured.csv", {"k": (1e7, 1e8)}, sd="1%", preset="paper")``.
    An unknown has its bounds, and perhaps its start."""
    texts = [f"{key}={':'.join(repr(float(v)) for v in ends)}" for key, ends in unknowns.items()]
    found = run("fit", measured, fit=texts, **flags)
    of_unknowns, rows = found.pop("unknowns"), found.pop("residuals")
    return Fit(
        names=[each["unknown"] for each in of_unknowns],
        value=_column(of_unknowns, "value"),
        sd=_column(of_unknowns, "sd"),
        lower_95=_column(of_unknowns, "lower_95"),
        upper_95=_column(of_unknowns, "upper_95"),
        correlation=np.array(found.pop("correlation"), dtype=float),
        fitted=_column(rows, "fitted"),
        residuals=_column(rows, "residual_sd"),
        rows=rows,
        **found,
    )
