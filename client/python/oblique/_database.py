"""Results that studies have left, asked as ``oblique query`` and ``oblique sql`` ask."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any, Optional, Sequence, Union

import numpy as np

from ._results import Arrays, Named, _core

if TYPE_CHECKING:
    import pandas


class Study(Named):
    """A study of a database and where it stands."""

    study_id: int
    name: str
    state: str
    points: int
    solved: int
    failed: int
    created_at: str
    solver_version: str


class Answer(Arrays):
    """Columns by name, as ``answer["fn_peak_N"]`` or ``answer.fn_peak_N``: NumPy arrays, whole
    numbers as int64, others as float64 with NaN for NULL, texts as objects with None. ``units`` has
    their units (SI) as far as they are known, ``len()`` counts rows."""

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
        """Units (SI) by column; empty where there is none."""
        return dict(self.__dict__["_units"])

    def keys(self) -> list[str]:
        """Names of the columns, in order."""
        return list(self)

    def __len__(self) -> int:
        return len(self[next(iter(self))]) if self.units else 0

    def __repr__(self) -> str:
        return f"<{len(self)} rows: {', '.join(self)}>"

    def to_pandas(self) -> "pandas.DataFrame":
        """The same as a DataFrame; pandas is needed for this alone."""
        import pandas

        return pandas.DataFrame(self._asdict())


class Database:
    """A database of results, opened for reading only: it may be asked while a server or a run
    writes it. Raises FileNotFoundError where there is none, and DatabaseError where there is
    something else.

        db = oblique.Database("oblique.db")
        friction = db.query("friction", where="e = 1", select="mu, fn_peak_N")
        friction.to_pandas().plot(x="mu", y="fn_peak_N")
    """

    def __init__(self, file: Union[str, "os.PathLike[str]"] = "oblique.db") -> None:
        self.file = os.fspath(file)
        self._database = _core.Database(self.file)

    def __repr__(self) -> str:
        return f"oblique.Database({self.file!r})"

    def query(
        self,
        study: str,
        where: str = "",
        select: Union[str, Sequence[str]] = "",
        group: Union[str, Sequence[str]] = "",
        order: Union[str, Sequence[str]] = "",
        limit: Optional[int] = None,
    ) -> Answer:
        """Results of a study: the answer of ``oblique query STUDY --where ...`` in full.

        Texts are SQL over the columns that ``oblique columns`` lists, in SI units; ``select`` left
        out has the axes that vary in the study and the main outputs, "*" has all. Raises ValueError
        for a wrong name, with those that may have been meant.
        """
        if limit is not None and limit < 0:
            raise ValueError(f"limit = {limit} is not allowed: limit must be >= 0")
        try:
            columns = self._database.query(
                study, where, _joined(select), _joined(group), _joined(order), limit
            )
        except ValueError as error:  # which names the flags of the program
            text = re.sub(r"--(where|select|group|order|limit)\b", r"\1", str(error))
            raise ValueError(text) from None
        return Answer(columns)

    def sql(self, statement: str) -> Answer:
        """The answer to one statement of SQL that only reads, as of ``oblique sql``."""
        return Answer(self._database.sql(statement))

    def studies(self) -> list[Study]:
        """All studies, in the order in which they came."""
        return [Study(**study) for study in self._database.studies()]


def _joined(names: Union[str, Sequence[str]]) -> str:
    return names if isinstance(names, str) else ", ".join(names)
