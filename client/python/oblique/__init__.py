"""The oblique impact of a flexible robotic finger on rough ground.

>>> import oblique
>>> impact = oblique.solve(H=1, mu=0.4, e=1)
>>> round(impact.fn_peak_N, 1), impact.mode
(4909.4, 'sC sR sC sR sC sR')

Units are SI and stand at the end of names: ``fn_peak_N``, ``duration_s``.

* :func:`solve` solves one point, :func:`solve_many` any number of them on all cores, with arrays in
  and out, and :func:`trace` gives the time histories of one.
* :func:`fit` finds the parameters of measured numbers, by the program ``oblique``.
* :class:`Database` asks the results that studies have left, also while a server writes them.

All of it may be called from several threads at once and lets other threads run meanwhile. Falls
are kept for later calls, in an eighth of the free memory at most.

The child of a fork cannot use it: calls raise RuntimeError there. Start processes with
``multiprocessing.set_start_method("spawn")``; ``subprocess`` is not affected.
"""

from __future__ import annotations

from ._database import Answer, Database, Study
from ._solving import solve, solve_many, trace
from .explore import Fit, fit
from ._results import Energy, Errors, ManyResults, Result, Solver, Trace, _core

DatabaseError, SolveError = _core.DatabaseError, _core.SolveError

for _error, _meaning in (
    (SolveError, "A point that has no answer; the message says why."),
    (DatabaseError, "A file that is no database of results, or one that cannot be read."),
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
    "Result",
    "SolveError",
    "Solver",
    "Study",
    "Trace",
    "fit",
    "solve",
    "solve_many",
    "trace",
]
