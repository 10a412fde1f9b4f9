"""The values of JointState messages by the names of the joints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import TimedMessage
from robsim.logs.message_types import Message
from robsim.run.log import Stream

Part = Literal["position", "velocity", "effort"]


class JointStateFields(NamedTuple):
    """Values of joints in the fields of a JointState message."""

    name: Sequence[str]
    position: Sequence[float] = ()
    velocity: Sequence[float] = ()
    effort: Sequence[float] = ()


class JointValues:
    """The last positions, velocities or efforts of joints, from messages of some of the joints.

    Parameters
    ----------
    log_names : sequence of str
        Names of the joints in the messages, in the order of the values.
    part : {"position", "velocity"}
        Field of the messages.
    every : bool, default True
        Whether `take` returns values only when all of them are known. Otherwise unknown values are
        zero.

    Attributes
    ----------
    others : dict
        Names in the messages that are not in `log_names`.
    """

    def __init__(self, log_names: Sequence[str], part: Part, every: bool = True) -> None:
        self.part, self.others = part, dict[str, None]()
        self._rows = {name: i for i, name in enumerate(log_names)}
        self._values = np.full(len(log_names), np.nan if every else 0.0)
        self._alike: list[str] = []  # names of the last message, and their rows
        self._alike_rows, self._alike_places = np.empty(0, int), np.empty(0, int)

    @property
    def missing(self) -> list[str]:
        """The names that have not occurred in any message."""
        return [name for name, i in self._rows.items() if np.isnan(self._values[i])]

    def take(self, what: str, each: TimedMessage) -> Array | None:
        """Return the values (n,) after a message, or None.

        The result is None if the message has no values of this part, or if `every` is true and a
        value is not known yet. FileError is raised for a name that occurs twice, or a number that
        is not finite.
        """
        if self._take_alike(each.message):
            return None if np.isnan(self._values).any() else self._values.copy()
        known = self._read_values(what, each)
        if not known:
            return None
        self._remember_names(list(known))
        for name in known.keys() & self._rows.keys():
            self._values[self._rows[name]] = known[name]
        self.others |= dict.fromkeys(name for name in known if name not in self._rows)
        return None if np.isnan(self._values).any() else self._values.copy()

    def _take_alike(self, message: Message) -> bool:
        """Take the finite values of a message with the names of the last one, which is faster."""
        if not self._alike or list(message.name) != self._alike:
            return False
        values = np.asarray(getattr(message, self.part), dtype=np.float64)
        if len(values) != len(self._alike) or not np.isfinite(values).all():
            return False
        self._values[self._alike_rows] = values[self._alike_places]
        return True

    def _remember_names(self, names: list[str]) -> None:
        """Store the names of a valid message, and the places of those that are known."""
        places = [i for i, name in enumerate(names) if name in self._rows]
        self._alike, self._alike_places = names, np.array(places, dtype=np.int64)
        self._alike_rows = np.array([self._rows[names[i]] for i in places], dtype=np.int64)

    def _read_values(self, what: str, each: TimedMessage) -> dict[str, float]:
        """Return the values of a message by name, empty if the message has none."""
        names = list(each.message.name)
        values = np.asarray(getattr(each.message, self.part)).tolist()
        if not values:
            return {}
        if len(names) != len(values):
            raise FileError(
                f"{what}: {len(names)} names but {len(values)} values of {self.part}, {each.when}"
            )
        known = dict(zip(names, values, strict=True))
        if len(known) < len(names):
            repeated = next(name for name in names if names.count(name) > 1)
            raise FileError(f"{what}: joint {repeated} occurs twice, {each.when}")
        if not np.isfinite(values).all():
            invalid = next(name for name, value in known.items() if not np.isfinite(value))
            raise FileError(
                f"{what}: {self.part} of joint {invalid} is {known[invalid]}, {each.when}"
            )
        return known


def read_joint_stream(
    what: str, messages: Iterable[TimedMessage], joints: JointValues
) -> Stream | None:
    """Return the values (n, width) of messages, from the time at which all are known, or None."""
    values = ((each.time, joints.take(what, each)) for each in messages)
    return stack_stream(what, values)


def stack_stream(what: str, timed_rows: Iterable[tuple[int, Array | None]]) -> Stream | None:
    """Return rows with their times as a stream, without rows of None; None without rows."""
    rows = [(time, row) for time, row in timed_rows if row is not None]
    if not rows:
        return None
    times, values = zip(*rows, strict=True)
    return Stream(what, np.array(times, dtype=np.int64), np.array(values))
