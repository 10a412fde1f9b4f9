"""Messages at times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal, NamedTuple

from robsim.logs.bag_files import Timed
from robsim.run.log import NANO

Clock = Literal["header", "log"]


class At(NamedTuple):
    """A message at a time in nanoseconds."""

    time: int
    message: Any

    @property
    def said(self) -> str:
        """The time, for messages of errors."""
        return f"at {self.time / NANO:.9g} s"


def at_times(messages: Sequence[Timed], clock: Clock) -> Iterator[At]:
    """Yield messages with their times: those of the headers, where these have any."""
    stamped = clock == "header" and any(each.stamped for each in messages)
    for each in messages:
        time = each.stamped if stamped else None
        yield At(each.logged if time is None else time, each.message)
