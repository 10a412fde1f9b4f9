"""The numbers of JointState messages, by the names of the joints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.logs.bag_files import TimedMessage
from robsim.run.log import Stream

Part = Literal["position", "velocity"]


class JointStateFields(NamedTuple):
    """Numbers by name, as a JointState has them."""

    name: Sequence[str]
    position: Sequence[float] = ()
    velocity: Sequence[float] = ()


class JointValues:
    """Positions or velocities by name, of messages each of which may hold some.

    called  the names in the messages, in the order of the values
    every   whether all of them must be known before there are any; else what is not named is zero
    others  names of which nothing is known
    """

    def __init__(self, called: Sequence[str], part: Part, every: bool = True) -> None:
        self.part, self.others = part, dict[str, None]()
        self._rows = {name: i for i, name in enumerate(called)}
        self._now = np.full(len(called), np.nan if every else 0.0)

    @property
    def lacking(self) -> list[str]:
        """The names that no message has had."""
        return [name for name, i in self._rows.items() if np.isnan(self._now[i])]

    def take(self, what: str, each: TimedMessage) -> Array | None:
        """Return the values (n,) after a message; None where it has none, or not all are known.

        FileError: a name that is there twice, or a number that is not finite.
        """
        known = self._known(what, each)
        if not known:
            return None
        for name in known.keys() & self._rows.keys():
            self._now[self._rows[name]] = known[name]
        self.others |= dict.fromkeys(name for name in known if name not in self._rows)
        return None if np.isnan(self._now).any() else self._now.copy()

    def _known(self, what: str, each: TimedMessage) -> dict[str, float]:
        """Return the numbers of a message by name; none if it leaves them out."""
        names = list(each.message.name)
        values = np.asarray(getattr(each.message, self.part)).tolist()
        if not values:
            return {}
        if len(names) != len(values):
            raise FileError(
                f"{what}: {len(names)} names and {len(values)} of {self.part}, {each.said}"
            )
        known = dict(zip(names, values, strict=True))
        if len(known) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise FileError(f"{what}: joint {twice} is there twice, {each.said}")
        if not np.isfinite(values).all():
            odd = next(name for name, value in known.items() if not np.isfinite(value))
            raise FileError(f"{what}: {self.part} of joint {odd} is {known[odd]}, {each.said}")
        return known


def read_joint_stream(
    what: str, found: Iterable[TimedMessage], joints: JointValues
) -> Stream | None:
    """Return the values (n, width) of messages, once all are known; None if they never are."""
    taken = ((each.time, joints.take(what, each)) for each in found)
    return stack_stream(what, taken)


def stack_stream(what: str, every: Iterable[tuple[int, Array | None]]) -> Stream | None:
    """Return rows with their times as a stream, without those that are none; None without any."""
    rows = [(time, row) for time, row in every if row is not None]
    if not rows:
        return None
    times, values = zip(*rows, strict=True)
    return Stream(what, np.array(times, dtype=np.int64), np.array(values))
