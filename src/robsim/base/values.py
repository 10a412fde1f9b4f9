"""Values that hold arrays: equal when all their fields are, hashable, and which never change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


class Value:
    """A base of frozen dataclasses with `eq=False`, compared and hashed with their arrays."""

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            _freeze(value)  # copies must be read-only too
        self.__dict__.update(state)

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    def _key(self) -> tuple[Any, ...]:
        compared = (f.name for f in fields(self) if f.compare)  # type: ignore[arg-type]
        return tuple(hashable(getattr(self, name)) for name in compared)


def _freeze(value: Any) -> None:
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    for part in value.values() if isinstance(value, dict) else ():
        _freeze(part)


def hashable(value: Any) -> Any:
    """Return a hashable stand-in of a value for comparisons: arrays by their shape and bytes."""
    if isinstance(value, dict):
        return tuple((key, hashable(part)) for key, part in sorted(value.items()))
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0.0).tobytes()  # -0.0 equals 0.0, and so do their bytes then
    return value


def unchanging(value: Any) -> bool:
    """Return whether nobody can change a value: numbers, texts, read-only arrays, and ours of them.

    What a user's class holds is not known, whatever it says.
    """
    if value is None or isinstance(value, str | int | float):
        return True
    if isinstance(value, np.ndarray):
        return not value.flags.writeable
    if isinstance(value, tuple):
        return all(map(unchanging, value))
    names = _names(value) if type(value).__module__.startswith("robsim.") else None
    return names is not None and all(unchanging(getattr(value, name)) for name in names)


def _names(value: Any) -> Sequence[str] | None:
    """Return the names of what a frozen dataclass holds, or of slots; None of anything else."""
    if not is_dataclass(value):
        return getattr(type(value), "__slots__", None)
    frozen = type(value).__dataclass_params__.frozen  # type: ignore[attr-defined]
    return [each.name for each in fields(value)] if frozen else None
