"""The oblique impact of a flexible robotic finger on rough ground.

>>> import oblique
>>> impact = oblique.solve(H=1, mu=0.4, e=1)
>>> round(impact.fn_peak_N, 1), impact.mode
(4909.4, 'sC sR sC sR sC sR')

Values are in SI units; names end with the unit: ``fn_peak_N``, ``duration_s``.

* :func:`solve` solves one point, :func:`solve_many` many points on all cores, with arrays for
  parameters and results. :func:`trace` returns the time histories of one point.
* :func:`map` finds the borders between modes on a plane.
* :func:`fit` finds the parameters that fit measured outputs.
* :func:`sensitivity` shows which inputs matter, :func:`uncertainty` how the outputs of a sampled
  study are distributed.
* :class:`Database` queries the results of studies, also while a server writes them.

All functions are thread-safe and let other threads run. Falls are cached for later calls, in at
most an eighth of the free memory.

The module cannot be used in the child of a fork, where calls raise RuntimeError. Start processes
with ``multiprocessing.set_start_method("spawn")``; ``subprocess`` is not affected.
"""

from __future__ import annotations

from ._database import Answer, Database, Study
from ._solving import solve, solve_many, trace
from .explore import Fit, Map, fit, map, sensitivity, uncertainty
from ._results import Energy, Errors, ManyResults, Result, Solver, Trace, _core

DatabaseError, SolveError = _core.DatabaseError, _core.SolveError

for _error, _meaning in (
    (SolveError, "A point has no answer; the message gives the reason."),
    (DatabaseError, "A file is not a database of results, or cannot be read."),
):
    _error.__module__, _error.__doc__ = __name__, _meaning

__version__: str = _core.version()

__all__ = [
    "Answer",
    "Database",
    "DatabaseError",
    "Energy",
    "Errors",
    "Fit",
    "ManyResults",
    "Map",
    "Result",
    "SolveError",
    "Solver",
    "Study",
    "Trace",
    "fit",
    "map",
    "sensitivity",
    "solve",
    "solve_many",
    "trace",
    "uncertainty",
]
