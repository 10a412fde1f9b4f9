"""Imperfections: what every kind of them declares, and those of a run that act."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, is_any_nonzero
from robsim.base.value import construct_unchecked
from robsim.declare import DeclaredValue, fields_of

Statement = tuple[str, dict[str, float]]  # a sentence and its numbers
P = TypeVar("P", bound="Imperfection")


class RunFacts(NamedTuple):
    """The facts of a run from which an imperfection states its part in it.

    dt       control period in seconds
    gain     largest gain of the task, per second; NaN for a user's own kind of task
    robust   whether the task has robust weights
    columns  numbers of the commanded velocities among those of the scene
    wanted   commanded velocities (T, nv) of the scene, and `moved` the actual ones
    floor    clause on the error that does not vanish, "" if that is not what happened
    numbers  the numbers of that clause
    """

    dt: float
    gain: float
    robust: bool
    columns: NDArray[np.int64]
    wanted: Array
    moved: Array
    floor: str
    numbers: Mapping[str, float]

    def lasting(self, what: str, **numbers: float) -> Statement:
        """Return the statement of what keeps the error from vanishing, with its final size."""
        return f"{what}{self.floor}.", {**numbers, **self.numbers}

    def in_periods(self, seconds: float) -> str:
        """Return a time as a number of control periods, with the noun."""
        count, whole = seconds / self.dt, round(seconds / self.dt)
        text = str(whole) if abs(count - whole) < 1e-6 else f"{count:.3g}"
        return f"{text} control period{'s' * (text != '1')}"


class Imperfection(DeclaredValue):
    """A kind of imperfection, of the images or of the joints, as far as sentences go.

    own       a user's object without this base class, for which this stands
    called    the method in Python that is called, of an effect that adds no stages
    stream    the first of two streams of random numbers, in the short form
    title     its noun, such as "pixel noise"
    left_out  noun for `advise` if it has no part in the linear loop and its noise; "" for none
    """

    own: Any = None
    called: ClassVar[str]
    stream: ClassVar[int] = 0
    title: ClassVar[str]
    changed: ClassVar[str]  # the subject of a plain statement, with its verb
    left_out: ClassVar[str] = "effects of your own"

    @classmethod
    def wrap(cls, given: Any) -> Self:
        """Return an imperfection with this base class, also where it is a user's own object."""
        if isinstance(given, cls):
            return given
        made = cls()
        made.own = given
        return made

    @property
    def label(self) -> str:
        """The name of the class, for sentences and errors."""
        return type(self.own or self).__name__

    def add_stages(self, rows: Any) -> None:
        """Add the stages of the effect to a program; by default a method in Python is called."""
        call = getattr(self if self.own is None else self.own, self.called, None)
        if call is None:
            raise NotImplementedError(f"{self.label} needs `{self.called}` or `add_stages`")
        rows.call(call, self.label)

    def stated(self, facts: RunFacts) -> Statement:
        """Return a sentence on its part in a run, and the numbers."""
        return facts.lasting(f"{self.changed} changed by {self.label}")

    def cause(self, dt: float) -> str:
        """Return the phrase for its part in the timing of the loop, as a limit of the gain."""
        return self.title

    def caveats(self, robust: bool, noise: float) -> Iterator[str]:
        """Yield what advice misses of it, beside the noise (px) that robust weights leave."""
        yield from ()


@dataclass(frozen=True, eq=False)
class ActiveImperfection(Generic[P]):
    """An imperfection that acts, and the field of `Sensing` or `Actuation` that holds it.

    `stream` is the first of its two streams of random numbers, and `listed` says whether the field
    is a list with `given` in it.
    """

    effect: P
    stream: int
    field: str
    given: Any
    listed: bool

    def removed(self, holder: Any) -> Any:
        """Return a `Sensing` or `Actuation` without this imperfection."""
        left = type(holder).__dataclass_fields__[self.field].default
        if self.listed:
            left = tuple(one for one in getattr(holder, self.field) if one is not self.given)
        return replace(holder, **{self.field: left})


def list_active_imperfections(
    holder: Any, parts: Sequence[Any], base: type[P], first: int
) -> list[ActiveImperfection[P]]:
    """Return the imperfections of a `Sensing` or `Actuation` that act.

    `parts` are kinds whose fields stand in the holder, and names of lists of effects, of which
    each has two streams of random numbers, from the first on.
    """
    found = []
    for part in parts:
        if isinstance(part, str):
            for i, each in enumerate(getattr(holder, part)):
                found.append(ActiveImperfection(base.wrap(each), first + 2 * i, part, each, True))
            continue
        given = {each.name: getattr(holder, each.name) for each in fields_of(part)}
        name = next(iter(given))
        if is_any_nonzero(given[name]):
            found.append(
                ActiveImperfection(
                    construct_unchecked(part, **given), part.stream, name, given[name], False
                )
            )
    return found
