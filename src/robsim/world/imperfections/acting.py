"""The imperfections that act: those of the short form, and those of a list of effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from robsim.base.arrays import is_any
from robsim.base.values import known
from robsim.declare import fields_of

E = TypeVar("E")
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Acting(Generic[E]):
    """An imperfection that acts, and how the field that holds it looks without.

    stream  the first of its two streams of random numbers
    field   the field of `Sensing` or `Actuation` that holds it
    off     the field without it; of `effects`, the one of them to leave out
    """

    effect: E
    stream: int
    field: str
    off: Any

    def removed(self, holder: T) -> T:
        """Return a `Sensing` or `Actuation` without this imperfection."""
        left = self.off
        if self.field == "effects":
            left = tuple(one for one in getattr(holder, "effects", ()) if one is not self.off)
        return replace(holder, **{self.field: left})  # type: ignore[type-var]


def acting(
    holder: Any, short: Mapping[type[E], int], own: Callable[[Any], E], first: int
) -> list[Acting[E]]:
    """Return the imperfections of a `Sensing` or `Actuation` that act, in the order of its fields.

    `short` are the kinds whose fields stand in the holder, each with the first of its streams;
    `own` makes one of them of an effect in the list, whose streams come from `first` on.
    """
    defaults = {each.name: each.default for each in fields_of(type(holder))}
    found = []
    for kind, stream in short.items():
        given = {each.name: getattr(holder, each.name) for each in fields_of(kind)}
        name = next(iter(given))
        if is_any(given[name]):
            found.append(Acting(known(kind, **given), stream, name, defaults[name]))
    for i, effect in enumerate(holder.effects):
        found.append(Acting(own(effect), first + 2 * i, "effects", effect))
    return found
