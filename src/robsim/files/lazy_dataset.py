"""Datasets whose variables and attributes are each made when they are first read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from threading import RLock
from typing import Any, Self, cast

import xarray as xr

_SLOTS = tuple(name for name in xr.Dataset.__slots__ if name != "__weakref__")


class LazyDataset(xr.Dataset):  # type: ignore[no-untyped-call]  # of xarray's __init_subclass__
    """A Dataset that may be told later what it holds; it is one in all else.

    Until then its slots are not set, so that Python asks `__getattr__` for them. What has been
    made is kept, and what made it forgotten.
    """

    __slots__ = ("_lock", "_makers")

    @classmethod
    def of(cls, dataset: Callable[[], xr.Dataset], attrs: Callable[[], Mapping[str, Any]]) -> Self:
        """Return a Dataset with the variables of `dataset()` and the attributes `attrs()`.

        Each is called once, by the first thread that needs it; once more only if it raised.
        """
        made = object.__new__(cls)
        made._lock = RLock()
        made._makers = {
            "_variables": lambda: _get_slots(dataset()),
            "_attrs": lambda: {"_attrs": dict(attrs())},
        }
        return made

    def __getattr__(self, name: str) -> Any:
        if name in _SLOTS and _has_slot(self, "_makers"):
            self._make("_attrs" if name == "_attrs" else "_variables")
            if _has_slot(self, name):
                return object.__getattribute__(self, name)
        return super().__getattr__(name)

    def __getstate__(self) -> Any:
        """Return what is pickled, all of which is made by then."""
        _, slots = cast("tuple[None, dict[str, Any]]", super().__getstate__())
        return None, {name: slots[name] for name in slots if name not in LazyDataset.__slots__}

    def _make(self, what: str) -> None:
        """Make variables or attributes, unless another thread has; what was assigned stays."""
        with self._lock:
            found = _convert_lookup_errors(self._makers.get(what, dict))
            for name in found:
                if not _has_slot(self, name):
                    setattr(self, name, found[name])
            self._makers.pop(what, None)


def _get_slots(dataset: xr.Dataset) -> dict[str, Any]:
    """Return what the slots of a Dataset hold that are set, without the attributes."""
    names = (name for name in _SLOTS if name != "_attrs" and _has_slot(dataset, name))
    return {name: getattr(dataset, name) for name in names}


def _has_slot(dataset: xr.Dataset, slot: str) -> bool:
    """Return whether a slot is set, without asking `__getattr__`."""
    try:
        object.__getattribute__(dataset, slot)
    except AttributeError:
        return False
    return True


def _convert_lookup_errors(maker: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Return what is made; errors that look like a missing name become RuntimeError."""
    try:
        return maker()
    except (AttributeError, LookupError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise RuntimeError(f"the content of this Dataset could not be made: {reason}") from error
