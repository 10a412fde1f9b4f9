"""The common part of tasks that follow a trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, as_nonnegative, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.kernels.control import axis_trajectory
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.controller_rows import ControllerInputs
from robsim.servo.shaping.command_fields import VelocityIndices
from robsim.servo.task_controller import TaskController
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid
from robsim.trajectory.time_law import QUINTIC_RAMP
from robsim.world.scene import Scene

TABLE_TYPES = (Blends, Path, Quintic, Straight, Trapezoid)  # which are looked up in a table
MAX_TABLE_PERIODS = 100_000  # periods of a table


class ReferenceRows(NamedTuple):
    """The rows of a trajectory: where it is now, then where it is a period later; how long it is.

    Each place is n numbers: coordinates, or the twelve of a pose.
    """

    here: BlockRows  # (2, n)
    seconds: BlockRows


@dataclass(frozen=True, eq=False)
class TrajectoryFollower(TaskController):
    """The controller of a task that follows a trajectory."""

    task: Any  # whose gain is per second; None for all of it in one period

    def gain_row(self, given: ControllerInputs) -> BlockRows:
        """Return the row of the gain, which is infinite for all of a distance in one period."""
        gain = self.task.gain
        return given.program.constant(math.inf if gain is None else gain)

    def busy(self, given: ControllerInputs, way: ReferenceRows) -> BlockRows:
        """Add the stage of whether the trajectory is not over, and return its row."""
        times = {"seconds": way.seconds, "duration": given.dt}
        return given.program.result(axis_trajectory.flag_running_trajectory, "out", **times)


def make_cameraless_fields(
    scene: Scene, frame: str, columns: VelocityIndices, s_goal: Array, task: Any
) -> dict[str, Any]:
    """Return the fields of the controller of a task without a camera, with its goal s (k,)."""
    return {
        "scene": scene,
        "frame": frame,
        "sights": (),
        "columns": columns,
        "s_goal": make_read_only(s_goal[:, None]),
        "tolerances": np.full(len(s_goal), task.tolerance),
        "goal_pixels": np.empty((0, 2)),
        "pace": task.gain or 1.0,
        "task": task,
    }


def add_trajectory(
    given: ControllerInputs, trajectory: Any, n: int, at: Callable[[Any], Array]
) -> ReferenceRows:
    """Add the stages of a trajectory, which is `at(t)` (..., n) at times t (...), in seconds."""
    here, duration = given.program.rows(2, n), trajectory.duration
    if type(trajectory) in TABLE_TYPES and duration < MAX_TABLE_PERIODS * given.seconds:
        times = np.arange(int(duration / given.seconds) + 3) * given.seconds
        table = np.ascontiguousarray(at(times))
        given.program.add(
            axis_trajectory.look_up_trajectory, table=given.program.address(table), here=here
        )
    else:

        def ask(blocks: Blocks, step: int) -> None:
            for later in range(2):
                there = np.broadcast_to(at((step + later) * given.seconds), (blocks.runs, n))
                blocks.put(here[later], there.T)

        given.program.call(ask)
    return ReferenceRows(here, given.program.constant(duration))


def add_timing(
    program: Program, ways: BlockRows, duration: float | None, limits: Array | None
) -> dict[str, BlockRows]:
    """Return the rows of the seconds of some ways (n,), and of their ramps.

    The duration is given, or as short as limits (2, n) of speeds and accelerations allow.
    """
    if limits is None:
        ramps = program.constant(np.full(ways.size, QUINTIC_RAMP))
        return {"seconds": program.constant(duration), "ramps": ramps}
    found = {"seconds": program.rows(), "ramps": program.rows(ways.size)}
    program.add(
        axis_trajectory.plan_shortest_time, ways=ways, limits=program.constant(limits), **found
    )
    return found


def check_trajectory(value: Any, what: str) -> None:
    """Raise InputError unless a value has at(t) and a duration."""
    if isinstance(value, type) or not callable(getattr(value, "at", None)):
        raise InputError(
            f"{what}: expected an object with duration and at(t), got {format_value(value)}"
        )
    as_nonnegative(getattr(value, "duration", math.nan), f"{what}.duration (seconds)")
