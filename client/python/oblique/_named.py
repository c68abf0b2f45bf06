"""What all that has named fields shares."""

from __future__ import annotations

from typing import Any, Iterator


class Named:
    """Named values, as attributes, as ``result["fn_peak_N"]`` and by ``_asdict()``."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.__dict__.update(values)

    def _asdict(self) -> dict[str, Any]:
        """All values by name, groups as dicts of their own."""
        return {
            name: value._asdict() if isinstance(value, Named) else value
            for name, value in self.__dict__.items()
            if not name.startswith("_")
        }

    def __getitem__(self, name: str) -> Any:
        if not isinstance(name, str):
            raise TypeError(
                f"a {type(self).__name__} has fields, not places: take one by its name, "
                "as [\"fn_peak_N\"], and then its elements"
            )
        if name.startswith("_") or name not in self.__dict__:
            raise KeyError(f"no field {name!r}: there are {', '.join(self)}")
        return getattr(self, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._asdict())

    def __repr__(self) -> str:
        values = ", ".join(
            f"{name}={value!r}" for name, value in self.__dict__.items() if not name.startswith("_")
        )
        return f"{type(self).__name__}({values})"


class Plain(Named):
    """Named values that are no arrays, and may be compared."""

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self.__dict__ == other.__dict__

    __hash__ = None  # type: ignore[assignment]
