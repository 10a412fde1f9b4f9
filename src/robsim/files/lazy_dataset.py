"""Datasets with variables and attributes that are computed at the first access."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from threading import RLock
from typing import Any, Self, TypeVar, cast

import xarray as xr

T = TypeVar("T")
SingleMaker = Callable[[str], "xr.DataArray | None"]
_SLOTS = tuple(name for name in xr.Dataset.__slots__ if name != "__weakref__")


class LazyDataset(xr.Dataset):  # type: ignore[no-untyped-call]  # of xarray's __init_subclass__
    """A Dataset that computes its variables and attributes at the first access.

    Until then its slots are unset, so that Python calls `__getattr__` for them. Results are stored,
    and the functions that made them are released.
    """

    __slots__ = ("_lock", "_makers", "_single")

    _single: SingleMaker

    @classmethod
    def of(
        cls,
        dataset: Callable[[], xr.Dataset],
        attrs: Callable[[], Mapping[str, Any]],
        single: SingleMaker | None = None,
    ) -> Self:
        """Return a Dataset with the variables of `dataset()` and the attributes `attrs()`.

        Each function is called once, by the first thread that needs it, and again only if it
        raised. `single(name)` returns one variable with its coordinates, or None. It is called for
        a variable that is read by name before all variables are computed. The data of the variable
        must be those in `dataset()`.
        """
        lazy = object.__new__(cls)
        lazy._lock = RLock()
        lazy._makers = {
            "_variables": lambda: _get_slots(dataset()),
            "_attrs": lambda: {"_attrs": dict(attrs())},
        }
        lazy._single = single or _return_none
        return lazy

    def __getattr__(self, name: str) -> Any:
        if name in _SLOTS and _has_slot(self, "_makers"):
            self._make("_attrs" if name == "_attrs" else "_variables")
            if _has_slot(self, name):
                return object.__getattribute__(self, name)
        single = None if name.startswith("_") else self._read_single(name)
        return super().__getattr__(name) if single is None else single

    def _construct_dataarray(self, name: Hashable) -> xr.DataArray:
        """Return a variable with its coordinates; xarray calls it for `dataset[name]`."""
        single = self._read_single(name) if isinstance(name, str) else None
        return super()._construct_dataarray(name) if single is None else single

    def _read_single(self, name: str) -> xr.DataArray | None:
        """Return one variable with its coordinates, or None if all variables are computed."""
        if not _has_slot(self, "_single"):
            return None
        with self._lock:
            if "_variables" not in self._makers or _has_slot(self, "_variables"):
                return None
            return _convert_lookup_errors(lambda: self._single(name))

    def __getstate__(self) -> Any:
        """Return the state for pickling, which computes all variables and attributes."""
        _, slots = cast("tuple[None, dict[str, Any]]", super().__getstate__())
        return None, {name: slots[name] for name in slots if name not in LazyDataset.__slots__}

    def _make(self, what: str) -> None:
        """Compute variables or attributes, unless another thread has; assigned slots are kept."""
        with self._lock:
            slots = _convert_lookup_errors(self._makers.get(what, dict))
            for name in slots:
                if not _has_slot(self, name):
                    setattr(self, name, slots[name])
            self._makers.pop(what, None)
            if what == "_variables":
                self._single = _return_none


def _return_none(name: str) -> xr.DataArray | None:
    """Return None: the variable cannot be computed alone."""
    return None


def _get_slots(dataset: xr.Dataset) -> dict[str, Any]:
    """Return the slots of a Dataset that are set, without the attributes."""
    names = (name for name in _SLOTS if name != "_attrs" and _has_slot(dataset, name))
    return {name: getattr(dataset, name) for name in names}


def _has_slot(dataset: xr.Dataset, slot: str) -> bool:
    """Return whether a slot is set, without calling `__getattr__`."""
    try:
        object.__getattribute__(dataset, slot)
    except AttributeError:
        return False
    return True


def _convert_lookup_errors(maker: Callable[[], T]) -> T:
    """Call a function, and convert errors that look like a missing name to RuntimeError."""
    try:
        return maker()
    except (AttributeError, LookupError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise RuntimeError(f"the content of this Dataset could not be made: {reason}") from error
