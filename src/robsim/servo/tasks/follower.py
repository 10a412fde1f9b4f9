"""The common part of tasks that follow a trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, frozen, not_negative
from robsim.base.errors import InputError, said
from robsim.kernels.control import following
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.servo.controller import Controller
from robsim.servo.given import Given
from robsim.servo.shaping.shaped import Columns
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid
from robsim.trajectory.timing import ALIKE
from robsim.world.scene import Scene

OURS = (Blends, Path, Quintic, Straight, Trapezoid)  # which are looked up in a table
LONGEST = 100_000  # periods of a table


class Followed(NamedTuple):
    """The rows of a trajectory: where it is now, then where it is a period later; how long it is.

    Each place is n numbers: coordinates, or the twelve of a pose.
    """

    here: Rows  # (2, n)
    seconds: Rows


@dataclass(frozen=True, eq=False)
class Follower(Controller):
    """The controller of a task that follows a trajectory."""

    task: Any  # whose gain is per second; None for all of it in one period

    def gain_row(self, given: Given) -> Rows:
        """Return the row of the gain, which is infinite for all of a distance in one period."""
        gain = self.task.gain
        return given.program.constant(math.inf if gain is None else gain)

    def busy(self, given: Given, way: Followed) -> Rows:
        """Add the stage of whether the trajectory is not over, and return its row."""
        times = {"seconds": way.seconds, "duration": given.dt}
        return given.program.result(following.going, "out", **times)


def unseen(scene: Scene, frame: str, columns: Columns, s_goal: Array, task: Any) -> dict[str, Any]:
    """Return the fields of the controller of a task without a camera, with its goal s (k,)."""
    return {
        "scene": scene,
        "frame": frame,
        "sights": (),
        "columns": columns,
        "s_goal": frozen(s_goal[:, None]),
        "tolerances": np.full(len(s_goal), task.tolerance),
        "goal_pixels": np.empty((0, 2)),
        "pace": task.gain or 1.0,
        "task": task,
    }


def followed(given: Given, trajectory: Any, n: int, at: Callable[[Any], Array]) -> Followed:
    """Add the stages of a trajectory, which is `at(t)` (..., n) at times t (...), in seconds."""
    here, duration = given.program.rows(2, n), trajectory.duration
    if type(trajectory) in OURS and duration < LONGEST * given.seconds:
        times = np.arange(int(duration / given.seconds) + 3) * given.seconds
        table = np.ascontiguousarray(at(times))
        given.program.add(following.looked_up, table=given.program.address(table), here=here)
    else:

        def ask(blocks: Blocks, step: int) -> None:
            for later in range(2):
                there = np.broadcast_to(at((step + later) * given.seconds), (blocks.runs, n))
                blocks.put(here[later], there.T)

        given.program.call(ask)
    return Followed(here, given.program.constant(duration))


def timing(
    program: Program, ways: Rows, duration: float | None, limits: Array | None
) -> dict[str, Rows]:
    """Return the rows of the seconds of some ways (n,), and of their ramps.

    The duration is given, or as short as limits (2, n) of speeds and accelerations allow.
    """
    if limits is None:
        ramps = program.constant(np.full(ways.size, ALIKE))
        return {"seconds": program.constant(duration), "ramps": ramps}
    found = {"seconds": program.rows(), "ramps": program.rows(ways.size)}
    program.add(following.paced, ways=ways, limits=program.constant(limits), **found)
    return found


def check_trajectory(value: Any, what: str) -> None:
    """Raise InputError unless a value has at(t) and a duration."""
    if isinstance(value, type) or not callable(getattr(value, "at", None)):
        raise InputError(f"{what}: expected an object with duration and at(t), got {said(value)}")
    not_negative(getattr(value, "duration", math.nan), f"{what}.duration (seconds)")
