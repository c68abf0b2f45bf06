"""Functions that solve points in this process."""

from __future__ import annotations

import math
import operator
import warnings
from typing import Any, Callable, Optional, Sequence, SupportsIndex, Union

import numpy as np
import numpy.typing as npt

from ._results import ManyResults, Result, Trace, _core

Number = Union[float, int, "np.floating[Any]", "np.integer[Any]"]
#: A number, or an expression of other keys, such as "A^2 / (4 * pi)".
Value = Union[Number, str]

_falls = _core.Falls()  # shared by all calls: a model's fall is solved once
#: Maximum number of threads per call.
MOST_THREADS = 1024


def solve(
    H: Value,
    mu: Value,
    e: Value,
    *,
    preset: str = "standard",
    lengths: Optional[Sequence[Number]] = None,
    errors: bool = False,
    **model: Value,
) -> Result:
    """One impact, with the same bits as from ``oblique solve --json``.

    H [m] is the drop of the tip, mu the coefficient of friction, e Stronge's coefficient of
    restitution. The model is a preset ("standard", "paper", "printed" or "converged"); single keys
    override it, as on the command line: ``E``, ``A``, ``I``, ``rho``, ``g``, ``k``, ``eta2``,
    ``tip_mass``, ``links``, ``length``, ``length1``, ``elements_per_link``, ``integrator``, ``dt``,
    ``dt_fall``, ``tolerance``, ...; ``lengths`` has one length a link. A value may be an expression
    of other keys. ``errors`` also estimates errors.

    The first point of a model takes about half a second for its fall, which is cached; further
    points take about 10 ms. One call of :func:`solve_many` is ten times as fast for many points.

    Raises ValueError, with key, value and range, for a wrong argument, and SolveError for a point
    without an answer. Warns of a value that is probably in another unit.

    >>> import oblique
    >>> impact = oblique.solve(H=1, mu=1.2, e=0.8)
    >>> impact.major_mode, round(impact.duration_s * 1e6)
    ('SC SR sR sC sR sC sR', 382)
    >>> oblique.solve(H=1, mu=0.4, e=1, tip_mas=0.1)
    Traceback (most recent call last):
      ...
    ValueError: unknown key `tip_mas` (did you mean `tip_mass`?): ...
    """
    keys, _ = _keys({"H": H, "mu": mu, "e": e, **model}, preset, lengths, one_for="solve")
    return Result(ManyResults(_core.solve(_falls, keys, errors), ()))


def trace(
    H: Value,
    mu: Value,
    e: Value,
    *,
    preset: str = "standard",
    lengths: Optional[Sequence[Number]] = None,
    fall: bool = False,
    shape: bool = False,
    **model: Value,
) -> Trace:
    """The time histories of one impact, from touch to separation; see :func:`solve`.

    ``fall`` adds the fall before touch, at negative times; ``shape`` adds the positions of nodes.

    >>> import oblique
    >>> contact = oblique.trace(H=1, mu=0.4, e=1)
    >>> round(float(contact.fn_N.max()), 1), str(contact.state[0])
    (4909.4, 'sC')
    """
    keys, _ = _keys({"H": H, "mu": mu, "e": e, **model}, preset, lengths, one_for="trace")
    result, headings, numbers, states = _core.trace(_falls, keys, fall, shape)
    rows = iter(np.ascontiguousarray(numbers.reshape(len(states), -1).T))
    names = np.array(_core.trace_states())
    columns = {name: names[states] if name == "state" else next(rows) for name in headings}
    return Trace(**columns, result=Result(ManyResults(result, ())))


def solve_many(
    H: Union[npt.ArrayLike, str],
    mu: Union[npt.ArrayLike, str],
    e: Union[npt.ArrayLike, str],
    *,
    preset: str = "standard",
    lengths: Optional[Sequence[Number]] = None,
    errors: bool = False,
    threads: Optional[SupportsIndex] = None,
    progress: Optional[Callable[[int, int], object]] = None,
    **model: Union[npt.ArrayLike, str],
) -> ManyResults:
    """Many impacts, on all cores (or ``threads``) and in all lanes of their vector registers.

    All keys may be expressions, or arrays, lists and single values, which are broadcast against
    each other. The results have the common shape and the same bits as from :func:`solve`. A point
    without an answer, or with a NaN or masked value, fails alone: see :class:`ManyResults`.

    ``progress(done, all)`` is called about every 50 ms; an exception in it stops the work, as
    Ctrl-C does. Other Python threads run meanwhile.

    >>> import numpy as np, oblique
    >>> mu, e = np.meshgrid(np.linspace(0.1, 2, 20), [0.6, 0.8, 1.0])
    >>> sweep = oblique.solve_many(H=1, mu=mu, e=e)
    >>> sweep.fn_peak_N.shape, sweep.mode[2, 3]
    ((3, 20), 'sC sR sC sR sC sR')
    >>> stiff = oblique.solve_many(H=1, mu=0.4, e=1, k=[1e7, 2e7, 4e7])
    >>> stiff.fn_peak_N.round(0)
    array([3545., 4450., 5581.])
    """
    keys, shape = _keys({"H": H, "mu": mu, "e": e, **model}, preset, lengths)
    count = 0 if threads is None else operator.index(threads)
    if threads is not None and not 1 <= count <= MOST_THREADS:
        raise ValueError(
            f"threads = {threads} is not allowed: threads must be from 1 to {MOST_THREADS}"
        )
    many = _core.solve_many(_falls, keys, math.prod(shape), count, errors, progress)
    return ManyResults(many, shape)


def _keys(
    values: dict[str, Any],
    preset: str,
    lengths: Optional[Sequence[Number]],
    one_for: Optional[str] = None,
) -> tuple[dict[str, Any], tuple[int, ...]]:
    """Arguments for the extension, which checks them: floats, texts and flat arrays, and their
    common shape. Warns of values that are probably in another unit. ``one_for`` is the name of a
    function that takes one value per key."""
    keys: dict[str, Any] = {**values, "preset": preset}
    arrays = {key: _array(key, v) for key, v in values.items() if not (isinstance(v, str) and v)}
    for key, array in arrays.items():
        if one_for and array.ndim:
            raise ValueError(
                f"{key} has {array.size} values: {one_for} takes one; "
                "oblique.solve_many takes arrays"
            )
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{key} {array.shape}" for key, array in arrays.items() if array.ndim)
        raise ValueError(f"these shapes cannot be broadcast together: {shapes}") from None
    for key, array in arrays.items():
        _warn_of_units(key, array)
        keys[key] = np.broadcast_to(array, shape).ravel() if array.ndim else array.item()
    if lengths is not None:
        array = _array("lengths", lengths)
        _warn_of_units("length", array)
        keys["lengths"] = array
    return keys, shape


def _warn_of_units(key: str, array: npt.NDArray[Any]) -> None:
    numbers = array[np.isfinite(array)] if array.dtype.kind == "f" else array[:0]
    for end in (numbers.min(), numbers.max()) if numbers.size else ():
        note: str = _core.note_on_value(key, end)
        if note:
            warnings.warn(note, stacklevel=4)
            break


def _without_masks(value: Any) -> Any:
    """Replaces masked values and the NA of pandas by NaN."""
    if isinstance(value, (list, tuple)) and any(isinstance(v, np.ma.MaskedArray) for v in value):
        value = np.ma.stack(np.broadcast_arrays(*value, subok=True))
    kind = getattr(value, "dtype", None)
    if hasattr(kind, "na_value") and getattr(kind, "kind", "") in tuple("iuf"):  # of pandas
        return value.to_numpy(dtype=np.float64, na_value=np.nan)
    if isinstance(value, np.ma.MaskedArray) and value.dtype.kind in "iuf":
        return np.ma.filled(value.astype(np.float64), np.nan)  # type: ignore[no-untyped-call]
    return value


def _array(name: str, value: Any) -> npt.NDArray[Any]:
    array = np.asarray(_without_masks(value))
    if name == "integrator" and array.dtype.kind == "U" and str(value):
        return array
    if array.dtype.kind == "O" and None not in array.ravel().tolist():
        try:
            array = array.astype(np.float64)
        except (TypeError, ValueError, OverflowError):
            pass
    if array.dtype.kind not in "iuf":
        text = " ".join(repr(value).split())
        text = text if len(text) <= 100 else text[:97] + "..."
        raise ValueError(f"{name} = {text} is not allowed: {name} must be a number or numbers")
    return array.astype(np.float64)
