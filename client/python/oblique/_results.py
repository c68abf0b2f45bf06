"""One result, many results, and time histories."""

from __future__ import annotations

from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Iterator, Optional

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas

_core: Any = import_module("._core", __package__)  # the extension has no types


class Named(SimpleNamespace):
    """Named values, as attributes, as ``result["fn_peak_N"]`` and by ``_asdict()``."""

    def __reduce__(self) -> tuple[Any, ...]:  # copies and pickles without __init__
        return SimpleNamespace.__new__, (type(self),), self.__dict__

    def _asdict(self) -> dict[str, Any]:
        """All values by name; groups are dicts."""
        return {
            name: value._asdict() if isinstance(value, Named) else value
            for name, value in self.__dict__.items()
            if not name.startswith("_")
        }

    def __getitem__(self, name: str) -> Any:
        if str(name).startswith("_") or name not in self.__dict__:
            raise KeyError(f"no field {name!r}: there are {', '.join(self)}")
        return getattr(self, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._asdict())


def text_array(texts: list[str], codes: npt.NDArray[np.int32]) -> npt.NDArray[np.object_]:
    """The text of each code; None for -1."""
    return np.array([*texts, None], dtype=object)[codes]


class Energy(Named):
    """Energy balance of a contact [J]; losses are positive."""

    kinetic_in_J: float
    friction_J: float
    restitution_J: float
    kinetic_change_J: float
    strain_change_J: float
    gravity_change_J: float
    exchanged_J: float
    closure: float


class Errors(Named):
    """Estimated errors as fractions of the output's scale; None unless requested."""

    mode_same: Optional[int]
    fn_peak: Optional[float]
    ft_peak: Optional[float]
    duration: Optional[float]
    stick_total: Optional[float]
    slide: Optional[float]
    impulse_n: Optional[float]
    impulse_t: Optional[float]
    v_out: Optional[float]


class Solver(Named):
    """How a result was computed."""

    integrator: str
    dt_s: float
    steps: int
    wall_s: float
    version: str


class Result(Named):
    """One impact, with the fields of ``oblique solve --json`` (``oblique columns`` lists them).

    SI units; times count from touch. Fields are attributes; ``_asdict()`` returns all of them.
    """

    H: float
    mu: float
    e: float
    fall_time_s: float
    impact_x_m: float
    vt_in_m_s: float
    vn_in_m_s: float
    duration_s: float
    fn_peak_N: float
    ft_peak_N: float
    fn_peaks_N: list[float]
    ft_peaks_N: list[float]
    major_peaks_N: list[float]
    major_peak_1_N: float
    major_peak_2_N: Optional[float]
    major_peak_3_N: Optional[float]
    major_peak_1_t_s: float
    major_peak_2_t_s: Optional[float]
    major_peak_3_t_s: Optional[float]
    impulse_n_Ns: float
    impulse_t_Ns: float
    slide_m: float
    vt_out_m_s: float
    vn_out_m_s: float
    mode: str
    major_mode: str
    margin: Optional[float]
    margin_event: Optional[str]
    stick_total_s: float
    stick_intervals_s: list[list[float]]
    phases: list[dict[str, Any]]
    reaction_peaks: list[dict[str, float]]
    energy: Energy
    errors: Errors
    solver: Solver

    def __init__(self, many: "ManyResults") -> None:
        values: dict[str, Any] = {key: many[key].item() for key in ("H", "mu", "e")}
        groups: dict[str, dict[str, Any]] = {group: {} for group in _GROUPS}
        for name, group, _, is_whole, list_name, _, _ in _core.fields():
            value = many[group][name] if group else many[name]
            if list_name:
                value = [
                    dict(zip(one.dtype.names, one.tolist())) if one.dtype.names else one.tolist()
                    for one in value.item()
                ]
            else:
                value = value.item()
                value = None if value != value else int(value) if is_whole else value
            (groups[group] if group else values)[name] = value
        super().__init__(**values, **{name: kind(**groups[name]) for name, kind in _GROUPS.items()})


_GROUPS: dict[str, type[Named]] = {"energy": Energy, "errors": Errors, "solver": Solver}


class Arrays(Named):
    """Named arrays: the groups ``energy``, ``errors`` and ``solver`` of many results."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"there is no `{name}` here: there are {', '.join(self.__dict__)}")


class ManyResults(Arrays):
    """Many impacts: the fields of :class:`Result`, each an array of the shape of the input; groups
    have arrays by the names of :class:`Energy`, :class:`Errors` and :class:`Solver`.

    If a point has no result, its numbers are NaN, its texts None, its lists empty, and ``error``
    contains the reason; ``failed`` marks such points. Lists are arrays of arrays (``fn_peaks_N``,
    ``stick_intervals_s``); lists with several members have names (``phases["t0_s"]``).
    :meth:`ragged` returns a list without an object for each point.

    >>> import oblique
    >>> sweep = oblique.solve_many(H=1, mu=[0.2, 0.4, -1], e=1)
    >>> sweep.fn_peak_N.round(1)
    array([5273.6, 4909.4,    nan])
    >>> sweep.error[2]
    'mu = -1 is not allowed: mu must be >= 0'
    """

    def __init__(self, values: dict[str, Any], shape: tuple[int, ...]) -> None:
        lists = values.pop("lists")

        def shaped(column: Any) -> Any:
            return (text_array(*column) if isinstance(column, tuple) else column).reshape(shape)

        named: dict[str, Any] = {key: shaped(values[key]) for key in ("H", "mu", "e")}
        for name, group, _, _, list_name, _, _ in _core.fields():
            if list_name:
                named[name] = None  # its place; the list is made on first use
            elif group:
                named.setdefault(group, {})[name] = shaped(values[group][name])
            else:
                named[name] = shaped(values[name])
        for group in _GROUPS:
            named[group] = Arrays(**named[group])
        named["error"] = shaped(values["error"])
        named["failed"] = np.asarray(named["error"] != None)  # noqa: E711  element by element
        named["_lists"] = lists
        named["_shape"] = shape
        super().__init__(**named)

    def __getattribute__(self, name: str) -> Any:
        value = super().__getattribute__(name)
        if value is None and not name.startswith("_"):
            value = self._list(name)
            self.__dict__[name] = value
        return value

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of every field."""
        shape: tuple[int, ...] = self.__dict__["_shape"]
        return shape

    def __len__(self) -> int:
        return self.shape[0] if self.shape else 1

    def _asdict(self) -> dict[str, Any]:
        for name in [name for name, value in self.__dict__.items() if value is None]:
            getattr(self, name)
        return super()._asdict()

    def __repr__(self) -> str:
        failed = f", {self.failed.sum()} failed" if self.failed.any() else ""
        names = ", ".join(name for name in self.__dict__ if not name.startswith("_"))
        return f"<{self.failed.size} results of shape {self.shape}{failed}: {names}>"

    def ragged(self, name: str) -> tuple[npt.NDArray[Any], npt.NDArray[np.int64]]:
        """A list of all points as one array: the elements of point i (of the flattened input) are
        ``values[offsets[i]:offsets[i + 1]]``.

        >>> import oblique
        >>> values, offsets = oblique.solve_many(H=1, mu=[0.4, 1.2], e=1).ragged("fn_peaks_N")
        >>> offsets.tolist(), len(values)
        ([0, 3, 7], 7)
        """
        for field, _, _, _, list_name, member, where in _core.fields():
            if field == name and list_name:
                break
        else:
            lists = ", ".join(field[0] for field in _core.fields() if field[4])
            raise ValueError(f"{name!r} is no list: lists are {lists}")
        packed = self.__dict__["_lists"][list_name]
        offsets: npt.NDArray[np.int64] = packed["offsets"]
        if not member:
            return _elements(list_name, packed), offsets
        values: npt.NDArray[Any] = packed[member]
        if not where:
            return values, offsets
        counted = packed[where] != 0
        before = np.concatenate([[0], np.cumsum(counted)])
        return values[counted], before[offsets]

    def _list(self, name: str) -> npt.NDArray[np.object_]:
        values, offsets = self.ragged(name)
        lists = np.empty(len(offsets) - 1, dtype=object)
        for i in range(len(lists)):
            lists[i] = values[offsets[i] : offsets[i + 1]]
        return lists.reshape(self.shape)

    def to_pandas(self) -> "pandas.DataFrame":
        """A pandas DataFrame with one row per point: H, mu, e and all scalar outputs, named as in a
        database, and ``error``."""
        import pandas

        columns: dict[str, npt.NDArray[Any]] = {"H": self.H, "mu": self.mu, "e": self.e}
        for name, group, column, _, list_name, _, _ in _core.fields():
            if not list_name:
                columns[column] = getattr(getattr(self, group) if group else self, name)
        columns["error"] = self.error
        return pandas.DataFrame({name: values.ravel() for name, values in columns.items()})


def _elements(list_name: str, packed: dict[str, Any]) -> npt.NDArray[Any]:
    """Elements with named members, or pairs if they have no names."""
    members = [name for name in packed if name not in ("offsets", "texts")]
    if list_name == "stick_intervals":
        return np.stack([packed[name] for name in members], axis=-1)
    size = len(packed["offsets"]) and len(packed[members[0]])
    texts = np.array(packed["texts"] or [""])
    elements = np.empty(
        size, dtype=[(name, texts.dtype if name == "kind" else np.float64) for name in members]
    )
    for name in members:
        elements[name] = texts[packed[name].astype(int)] if name == "kind" else packed[name]
    return elements


class Trace(Arrays):
    """Time histories of one contact: an array per column (``t_s``, ``fn_N``, ``x_m``, ...; forces
    on joints ``R0x_N`` ...; with ``shape`` also ``node0x_m`` ...), and the ``result``.

    ``state`` is SC, SR, sC or sR from each instant on, and "falling" before touch.
    """

    def __len__(self) -> int:
        return len(self.t_s)

    def to_pandas(self) -> "pandas.DataFrame":
        """A pandas DataFrame with one row per instant."""
        import pandas

        return pandas.DataFrame({k: v for k, v in self.__dict__.items() if k != "result"})
