"""The values of the last calls, for pictures that are drawn again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")


class RecentValues(Generic[Result]):
    """Values that are expensive to build, of the last few keys.

    A key can contain identities of objects. The entry holds these objects, so that no other object
    has the same identity meanwhile.

    Parameters
    ----------
    most : int
        Number of values that are kept.
    """

    def __init__(self, most: int) -> None:
        self._most, self._lock = most, Lock()
        self._entries: OrderedDict[Hashable, tuple[Any, Result]] = OrderedDict()

    def find(self, key: Hashable, held: Any, build: Callable[[], Result]) -> Result:
        """Return the value of a key, and build it if it is not there."""
        with self._lock:
            if key in self._entries:
                self._entries.move_to_end(key)
                return self._entries[key][1]
        value = build()
        with self._lock:
            self._entries[key] = held, value
            while len(self._entries) > self._most:
                self._entries.popitem(last=False)
        return value
