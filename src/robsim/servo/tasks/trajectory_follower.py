"""The common part of tasks that follow a trajectory."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

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


@runtime_checkable
class Trajectory(Protocol):
    """Protocol of a trajectory: any object with a duration, and with points at times.

    Examples
    --------
    >>> class Swing:  # one joint, for two seconds
    ...     duration = 2.0
    ...     def at(self, t):
    ...         return [0.1 * np.sin(np.pi * t)]
    >>> isinstance(Swing(), Trajectory)
    True
    """

    @property
    def duration(self) -> float:
        """Duration in seconds."""

    def at(self, t: float) -> ArrayLike:
        """Return the point at a time in seconds: n coordinates (n,), or a pose (4, 4)."""


TABLE_TYPES = (Blends, Path, Quintic, Straight, Trapezoid)  # sampled once into a table
MAX_TABLE_PERIODS = 100_000  # largest number of periods in a table


class ReferenceRows(NamedTuple):
    """Rows of a trajectory: its points now and one period later, and its duration.

    A point has n numbers: coordinates, or the twelve numbers of a pose.
    """

    here: BlockRows  # (2, n)
    seconds: BlockRows


@dataclass(frozen=True, eq=False)
class TrajectoryFollower(TaskController):
    """Controller of a task that follows a trajectory."""

    task: Any  # its gain is in 1/s, or None to correct a deviation within one period

    def gain_row(self, inputs: ControllerInputs) -> BlockRows:
        """Return the row of the gain; it is infinite to correct a deviation within one period."""
        gain = self.task.gain
        return inputs.program.constant(math.inf if gain is None else gain)

    def busy(self, inputs: ControllerInputs, reference: ReferenceRows) -> BlockRows:
        """Add the stage that computes whether the trajectory is still running; return its row."""
        times = {"seconds": reference.seconds, "duration": inputs.dt}
        return inputs.program.result(axis_trajectory.flag_running_trajectory, "out", **times)


def make_cameraless_fields(
    scene: Scene, frame: str, columns: VelocityIndices, s_goal: Array, task: Any
) -> dict[str, Any]:
    """Return the fields of the controller of a task without a camera, with the goal s (k,)."""
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
    inputs: ControllerInputs, trajectory: Trajectory, n: int, at: Callable[[ArrayLike], Array]
) -> ReferenceRows:
    """Add the stages of a trajectory `at(t)` (..., n) at times t (...) in seconds."""
    rows, duration = inputs.program.rows(2, n), trajectory.duration
    if type(trajectory) in TABLE_TYPES and duration < MAX_TABLE_PERIODS * inputs.seconds:
        times = np.arange(int(duration / inputs.seconds) + 3) * inputs.seconds
        table = np.ascontiguousarray(at(times))
        inputs.program.add(
            axis_trajectory.look_up_trajectory, table=inputs.program.address(table), here=rows
        )
    else:

        def ask(blocks: Blocks, step: int) -> None:
            for later in range(2):
                point = np.broadcast_to(at((step + later) * inputs.seconds), (blocks.runs, n))
                blocks.put(rows[later], point.T)

        inputs.program.call(ask)
    return ReferenceRows(rows, inputs.program.constant(duration))


def add_timing(
    program: Program, distances: BlockRows, duration: float | None, limits: Array | None
) -> dict[str, BlockRows]:
    """Return the rows of the durations of some distances (n,), and of their ramps.

    The duration is given, or the shortest within limits (2, n) of speed and acceleration.
    """
    if limits is None:
        ramps = program.constant(np.full(distances.size, QUINTIC_RAMP))
        return {"seconds": program.constant(duration), "ramps": ramps}
    times = {"seconds": program.rows(), "ramps": program.rows(distances.size)}
    program.add(
        axis_trajectory.plan_shortest_time, ways=distances, limits=program.constant(limits), **times
    )
    return times


def check_trajectory(value: Any, what: str) -> None:
    """Raise InputError unless a value has at(t) and a duration."""
    if isinstance(value, type) or not callable(getattr(value, "at", None)):
        raise InputError(
            f"{what}: expected an object with duration and at(t), got {format_value(value)}"
        )
    as_nonnegative(getattr(value, "duration", math.nan), f"{what}.duration (seconds)")
