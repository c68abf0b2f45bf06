"""The oblique impact of a flexible robotic finger on rough ground.

>>> import oblique
>>> impact = oblique.solve(H=1, mu=0.4, e=1)
>>> round(impact.fn_peak_N, 1), impact.mode
(5057.6, 'sC sR sC sR sC sR')

Units are SI and stand at the end of names: ``fn_peak_N``, ``duration_s``.

* :func:`solve` solves one point, :func:`solve_many` any number of them on all cores, with arrays in
  and out, and :func:`trace` gives the time histories of one.
* :class:`Database` asks the results that studies have left, also while a server writes them.

All of it may be called from several threads at once and lets other threads run meanwhile. Nothing
stays behind a call but falls that later ones use again; after ``os.fork`` the child may go on,
unless another thread was in a call (``multiprocessing`` with "spawn" is safe always).
"""

from __future__ import annotations

from . import _core
from ._core import DatabaseError, SolveError
from ._database import Answer, Database, Study
from ._solving import solve, solve_many, trace
from ._results import Energy, Errors, ManyResults, Result, Solver, Trace

__version__: str = _core.version()

__all__ = [
    "Answer",
    "Database",
    "DatabaseError",
    "Energy",
    "Errors",
    "ManyResults",
    "Result",
    "SolveError",
    "Solver",
    "Study",
    "Trace",
    "solve",
    "solve_many",
    "trace",
]
