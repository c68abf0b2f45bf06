"""Results of studies, queried as by ``oblique query`` and ``oblique sql``."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any, Optional, Sequence, Union

import numpy as np

from ._results import Arrays, Named, _core

if TYPE_CHECKING:
    import pandas


class Study(Named):
    """A study of a database and its progress."""

    study_id: int
    name: str
    state: str
    points: int
    solved: int
    failed: int
    created_at: str
    solver_version: str


class Answer(Arrays):
    """Columns by name, ``answer["fn_peak_N"]`` or ``answer.fn_peak_N``. Integers are int64 arrays,
    other numbers float64 arrays with NaN for NULL, texts object arrays with None. ``units`` has the
    known SI units; ``len()`` is the number of rows."""

    def __init__(self, columns: list[tuple[str, str, Any]]) -> None:
        named: dict[str, Any] = {"_units": {}}
        for name, unit, values in columns:
            unique, number = name, 2
            while unique in named:
                unique, number = f"{name}_{number}", number + 1
            named[unique] = np.array(values, dtype=object) if isinstance(values, list) else values
            named["_units"][unique] = unit
        super().__init__(**named)

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column; empty if it has none."""
        return dict(self.__dict__["_units"])

    def keys(self) -> list[str]:
        """Names of the columns, in order."""
        return list(self)

    def __len__(self) -> int:
        return len(self[next(iter(self))]) if self.units else 0

    def __repr__(self) -> str:
        return f"<{len(self)} rows: {', '.join(self)}>"

    def to_pandas(self) -> "pandas.DataFrame":
        """The columns as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(self._asdict())


class Database:
    """A database of results, opened for reading only, also while a server or a run writes it.
    Raises FileNotFoundError if the file does not exist, and DatabaseError if it is not a database
    of results.

        db = oblique.Database("oblique.db")
        friction = db.query("friction", where="e = 1", select="mu, fn_peak_N")
        friction.to_pandas().plot(x="mu", y="fn_peak_N")
    """

    def __init__(self, file: Union[str, "os.PathLike[str]"] = "oblique.db") -> None:
        self.file = os.fspath(file)
        self._database = _core.Database(self.file)

    def __repr__(self) -> str:
        return f"oblique.Database({self.file!r})"

    def __reduce__(self) -> tuple[Any, ...]:  # a copy opens the file again
        return type(self), (self.file,)

    def query(
        self,
        study: str,
        where: str = "",
        select: Union[str, Sequence[str]] = "",
        group: Union[str, Sequence[str]] = "",
        order: Union[str, Sequence[str]] = "",
        limit: Optional[int] = None,
    ) -> Answer:
        """All results of a study, as by ``oblique query STUDY --where ...``.

        Texts are SQL over the columns that ``oblique columns`` lists, in SI units. ``select`` is by
        default the axes that vary and the main outputs; "*" is all columns. Raises ValueError for a
        wrong name, with the nearest ones.
        """
        if limit is not None and limit < 0:
            raise ValueError(f"limit = {limit} is not allowed: limit must be >= 0")
        try:
            columns = self._database.query(
                study, where, _joined(select), _joined(group), _joined(order), limit
            )
        except ValueError as error:  # names flags of the program
            text = re.sub(r"--(where|select|group|order|limit)\b", r"\1", str(error))
            raise ValueError(text) from None
        return Answer(columns)

    def sql(self, statement: str) -> Answer:
        """The answer to an SQL statement that only reads, as by ``oblique sql``."""
        return Answer(self._database.sql(statement))

    def studies(self) -> list[Study]:
        """All studies, oldest first."""
        return [Study(**study) for study in self._database.studies()]


def _joined(names: Union[str, Sequence[str]]) -> str:
    return names if isinstance(names, str) else ", ".join(names)
