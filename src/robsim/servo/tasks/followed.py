"""The rows of a trajectory that is the same for all runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.control import following
from robsim.kernels.machine.program import Blocks
from robsim.kernels.machine.rows import Rows
from robsim.servo.given import Given
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid

OURS = (Blends, Path, Quintic, Straight, Trapezoid)  # which are looked up in a table
LONGEST = 100_000  # periods of a table


class Followed(NamedTuple):
    """The rows of a trajectory: where it is now, then where it is a period later; how long it is.

    Each place is n numbers: coordinates, or the twelve of a pose.
    """

    here: Rows  # (2, n)
    seconds: Rows


def followed(given: Given, trajectory: Any, n: int, at: Callable[[Any], Array]) -> Followed:
    """Add the stages of a trajectory, which is `at(t)` (..., n) at times t (...), in seconds."""
    here, duration = given.program.rows(2, n), trajectory.duration
    if type(trajectory) in OURS and duration < LONGEST * given.seconds:
        times = np.arange(int(duration / given.seconds) + 3) * given.seconds
        table = np.ascontiguousarray(at(times))
        address = given.program.address(table)
        given.program.add(following.looked_up, table=address, here=here)
    else:

        def ask(blocks: Blocks, step: int) -> None:
            for later in range(2):
                there = np.broadcast_to(at((step + later) * given.seconds), (blocks.runs, n))
                blocks.put(here[later], there.T)

        given.program.call(ask)
    return Followed(here, given.program.constant(duration))
