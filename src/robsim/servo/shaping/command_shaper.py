"""Changes of a command after the law: secondary motion, smooth start, speed limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats, make_read_only, view_for_user
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, KindOf, Number, family, register
from robsim.kernels.control import null_space as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.servo.controller_rows import ControllerInputs
from robsim.servo.shaping.free_motions import FreeMotions
from robsim.servo.shaping.redundancy import AvoidLimits, Posture, SecondaryMotion
from robsim.servo.shaping.speed_limit import SpeedLimit
from robsim.world.scene import Scene

PROJECTIONS = family("projection")


@register("projection", "large")
@dataclass(frozen=True)
class LargeProjection(DeclaredValue):
    """Projector onto motions that keep only the norm ||e||, far from the goal.

    The classic projector keeps every component of e, so a task that uses all joints leaves no room
    for a secondary motion. The large projector keeps the norm ||e|| above `high`, every component
    below `low`, and blends the two between them (see
    `robsim.servo.shaping.redundancy.large_projection`; Marey and Chaumette 2010). The robot then
    avoids its joint limits far from the goal, and the secondary motion does not disturb the final
    approach. Smaller bounds keep the secondary motion active for longer.

    Raises
    ------
    InputError
        Unless low is below high.

    Examples
    --------
    A gantry starts near a joint limit, and the features use all of its joints:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("joint_limits"))
    >>> for projection in "classic", LargeProjection(low=0.01, high=0.1):
    ...     task = replace(scenario.task, projection=projection)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(rs.Outcome(int(run.outcome)).name)
    JOINT_LIMIT
    CONVERGED
    """

    low: Annotated[
        float, Number(above=0), "Norm ||e|| below which every component of e is kept."
    ] = 0.01
    high: Annotated[float, Number(above=0), "Norm ||e|| above which only the norm is kept."] = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low >= self.high:
            raise InputError(f"low must be below high, got {self.low} and {self.high}")


Projector = LargeProjection | str  # a projector, or its name
PROJECTION = KindOf(PROJECTIONS, default="large", plain=("classic",))


@dataclass(frozen=True, eq=False)
class CommandShaper:
    """Changes of the command after the law, for the commanded velocities of a scene."""

    secondary: SecondaryMotion | None
    projection: LargeProjection | None
    smooth_start: float | None  # per second
    limit: SpeedLimit | None
    coordinates: NDArray[np.int64]  # coordinate of each commanded velocity, or -1
    limits: Array  # (n, 2) of these coordinates, in rad or m

    def stages(
        self,
        inputs: ControllerInputs,
        qd: BlockRows,
        error: BlockRows,
        J: BlockRows,
        A: BlockRows,
        find_free_motions: Callable[[], FreeMotions],
    ) -> BlockRows:
        """Add the stages that shape a command qd (n,); return its rows.

        The command serves a task with an error (k,), camera Jacobian J and task Jacobian A.
        `find_free_motions` adds the stages of the motions that the task leaves free.
        """
        program, n = inputs.program, qd.size
        if self.secondary is not None:
            motion = self._add_secondary(self.secondary, inputs, n)
            qd = self._add_projected_motion(program, motion, qd, error, A, find_free_motions())
        if self.smooth_start is not None:
            arguments = {"mu": program.number(self.smooth_start), "initial": program.rows(n)}
            qd = program.result(
                kernels.smooth_start_command, "out", n, **arguments, dt=inputs.dt, qd=qd
            )
        return qd if self.limit is None else self.limit.stages(program, J, qd)

    def _add_projected_motion(
        self,
        program: Program,
        motion: BlockRows,
        qd: BlockRows,
        error: BlockRows,
        A: BlockRows,
        free: FreeMotions,
    ) -> BlockRows:
        """Add the stages that add a motion to qd, projected onto the free motions of the task."""
        if not self.projection:
            return free.add_motion(motion, qd)
        P = free.add_projector()
        bounds = program.constant([self.projection.low, self.projection.high])
        program.add(kernels.apply_large_projector, A=A, error=error, bounds=bounds, P=P)
        arguments = {"P": P, "motion": motion, "qd": qd}
        return program.result(kernels.add_projected_motion, "out", qd.size, **arguments)

    def _add_secondary(
        self, secondary: SecondaryMotion, inputs: ControllerInputs, n: int
    ) -> BlockRows:
        """Add the stage of the secondary motion, which a user's class may define."""
        program, q = inputs.program, inputs.q
        if type(secondary) is AvoidLimits or type(secondary) is Posture:
            low, high = (program.constant(each) for each in secondary.bounds(self.limits))
            return program.result(
                kernels.compute_limit_avoidance,
                "motion",
                n,
                gain=program.number(secondary.gain),
                lowest=low,
                highest=high,
                q=[q[i] if i >= 0 else None for i in self.coordinates],
            )
        return program.add_python_rows(
            lambda blocks, step: self._call_secondary(secondary, blocks.get(q), n), n
        )

    def _call_secondary(self, secondary: SecondaryMotion, q: Array, n: int) -> Array:
        """Return the secondary motion (n, B) of a user's class.

        The coordinate of a velocity without its own coordinate is 0.
        """
        name, expected = type(secondary).__name__, (q.shape[1], n)
        has_coordinate = self.coordinates[:, None] >= 0
        at = np.where(has_coordinate, q[self.coordinates], 0.0)
        value = secondary.velocity(view_for_user(at), self.limits)
        velocity = as_floats(value, f"{name}.velocity", expected)
        if velocity.shape != expected:
            raise InputError(f"{name}.velocity: expected shape {expected}, got {velocity.shape}")
        return np.ascontiguousarray(velocity.T)


def find_coordinates(scene: Scene, columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """Return the coordinate that each velocity alone changes (else -1), and its limits (n, 2)."""
    coordinates = scene.tree.alone(columns)
    limits = np.where((coordinates >= 0)[:, None], scene.limits[coordinates], [-np.inf, np.inf])
    return coordinates, make_read_only(limits)
