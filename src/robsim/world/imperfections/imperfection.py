"""The base class of imperfections, and the imperfections that act in a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Generic, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, is_any_nonzero
from robsim.base.value import construct_unchecked
from robsim.declare import DeclaredValue, fields_of

Statement = tuple[str, dict[str, float]]  # a sentence and the numbers in it
P = TypeVar("P", bound="Imperfection")


class RunFacts(NamedTuple):
    """Data of a run with which an imperfection describes its effect in a message.

    Attributes
    ----------
    dt : float
        Control period in seconds.
    gain : float
        Largest gain of the task in 1/s. NaN if the kind of task is user-defined.
    robust : bool
        Whether the task has robust weights.
    columns : ndarray of int
        Indices of the commanded velocities among the velocities of the scene.
    wanted, moved : ndarray of shape (T, nv)
        Commanded and actual velocities of the scene.
    floor : str
        Clause on the final error, empty if the error vanishes.
    numbers : mapping of str to float
        Numbers in this clause.
    """

    dt: float
    gain: float
    robust: bool
    columns: NDArray[np.int64]
    wanted: Array
    moved: Array
    floor: str
    numbers: Mapping[str, float]

    def state_final_error(self, effect: str, **numbers: float) -> Statement:
        """Return a sentence on an effect, completed by the clause on the final error."""
        return f"{effect}{self.floor}.", {**numbers, **self.numbers}

    def in_periods(self, seconds: float) -> str:
        """Return a time as a text, such as "2 control periods"."""
        count, whole = seconds / self.dt, round(seconds / self.dt)
        text = str(whole) if abs(count - whole) < 1e-6 else f"{count:.3g}"
        return f"{text} control period{'s' * (text != '1')}"


class Imperfection(DeclaredValue):
    """Base class of the imperfections of images and joints.

    An imperfection changes images or motions, and states its effect in explanations and advice.

    Attributes
    ----------
    own : object
        User-defined object without this base class, wrapped by this instance.
    method_name : str
        Python method to call if the effect adds no stages.
    stream : int
        First of two streams of random numbers, for an imperfection with its own field.
    title : str
        Noun for the imperfection, such as "pixel noise".
    statement_subject : str
        Subject and verb of the default statement.
    left_out : str
        Name of the imperfection in the caveats of `advise`. Empty if the linear loop or its noise
        contains the imperfection.
    """

    own: object = None
    method_name: ClassVar[str]
    stream: ClassVar[int] = 0
    title: ClassVar[str]
    statement_subject: ClassVar[str]
    left_out: ClassVar[str] = "effects of your own"

    @classmethod
    def wrap(cls, effect: object) -> Self:
        """Return an imperfection with this base class; a user-defined object is wrapped."""
        if isinstance(effect, cls):
            return effect
        wrapper = cls()
        wrapper.own = effect
        return wrapper

    @property
    def label(self) -> str:
        """The name of the class, for sentences and errors."""
        return type(self.own or self).__name__

    def add_stages(self, rows: Any) -> None:  # Any: ImageRows or JointRows, see the base classes
        """Add the stages of the effect to a program; by default a Python method is called."""
        call = getattr(self if self.own is None else self.own, self.method_name, None)
        if call is None:
            raise NotImplementedError(f"{self.label} needs `{self.method_name}` or `add_stages`")
        rows.call(call, self.label)

    def stated(self, facts: RunFacts) -> Statement:
        """Return a sentence on the effect in a run, and its numbers."""
        return facts.state_final_error(f"{self.statement_subject} changed by {self.label}")

    def cause(self, dt: float) -> str:
        """Return a noun phrase for the effect, as a cause that limits the gain."""
        return self.title

    def caveats(self, robust: bool, noise: float) -> Iterator[str]:
        """Yield caveats of `advise`; `noise` (px) is the noise of the images under the weights."""
        yield from ()


@dataclass(frozen=True, eq=False)
class ActiveImperfection(Generic[P]):
    """An imperfection that is switched on, with its field of `Sensing` or `Actuation`.

    Attributes
    ----------
    effect : Imperfection
        The imperfection.
    stream : int
        First of its two streams of random numbers.
    field : str
        Name of the field.
    field_value : object
        Value of the field, or the item if the field is a list.
    is_listed : bool
        Whether the field is a list.
    """

    effect: P
    stream: int
    field: str
    field_value: Any
    is_listed: bool

    def remove_from(self, holder: Any) -> Any:
        """Return a `Sensing` or `Actuation` without this imperfection."""
        remaining = type(holder).__dataclass_fields__[self.field].default
        if self.is_listed:
            items = getattr(holder, self.field)
            remaining = tuple(item for item in items if item is not self.field_value)
        return replace(holder, **{self.field: remaining})


def list_active_imperfections(
    holder: Any, parts: Sequence[Any], base: type[P], first: int
) -> list[ActiveImperfection[P]]:
    """Return the imperfections of a `Sensing` or `Actuation` that are switched on.

    An item of `parts` is a class of imperfections, with fields of the same names as in the holder,
    or the name of a field that is a list of effects. Each effect of a list has two streams of
    random numbers, from `first` on.
    """
    active = []
    for part in parts:
        if isinstance(part, str):
            for i, each in enumerate(getattr(holder, part)):
                active.append(ActiveImperfection(base.wrap(each), first + 2 * i, part, each, True))
            continue
        values = {each.name: getattr(holder, each.name) for each in fields_of(part)}
        name = next(iter(values))
        if is_any_nonzero(values[name]):
            active.append(
                ActiveImperfection(
                    construct_unchecked(part, **values), part.stream, name, values[name], False
                )
            )
    return active
