"""What is done to a command after the law: secondary motion, smooth start, speed limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats, make_read_only, view_for_user
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, KindOf, Number, family, register
from robsim.kernels.control import null_space as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.servo.controller_rows import ControllerInputs
from robsim.servo.laws.inverse import RCOND
from robsim.servo.shaping.redundancy import AvoidLimits, Posture, add_priorities
from robsim.servo.shaping.speed_limit import SpeedLimit
from robsim.world.scene import Scene

PROJECTIONS = family("projection")


@register("projection", "large")
@dataclass(frozen=True)
class LargeProjection(DeclaredValue):
    """The large projection: far from the goal a secondary motion need only keep ||e||.

    Above `high` (in units of ||e||) only the norm is kept, below `low` every component, between
    them the two are blended; see `robsim.servo.shaping.redundancy.large_projection`.

    >>> LargeProjection()
    LargeProjection(low=0.01, high=0.1)
    """

    low: Annotated[
        float, Number(above=0), "Norm ||e|| below which every component of e is kept."
    ] = 0.01
    high: Annotated[float, Number(above=0), "Norm ||e|| above which only the norm is kept."] = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low >= self.high:
            raise InputError(f"low must be below high, got {self.low} and {self.high}")


PROJECTION = KindOf(PROJECTIONS, default="large", plain=("classic",))


@dataclass(frozen=True, eq=False)
class CommandShaper:
    """What is done to the command after the law, for the commanded velocities of a scene."""

    secondary: Any  # a `Secondary`, or None
    projection: LargeProjection | None
    smooth_start: float | None  # per second
    limit: SpeedLimit | None
    coordinates: NDArray[np.int64]  # of each commanded velocity; -1 if it has none of its own
    limits: Array  # (n, 2) of these coordinates, in rad or m

    def stages(
        self, given: ControllerInputs, qd: BlockRows, error: BlockRows, J: BlockRows, A: BlockRows
    ) -> BlockRows:
        """Add the stages that shape a command qd (n,), and return its rows.

        It serves a task with an error (k,), whose camera moves by J and features by A.
        """
        program, n = given.program, qd.size
        if self.secondary is not None:
            wish, P = self._wish(given, n), self._projector(program, error, A)
            qd = program.result(kernels.add_projected_motion, "out", n, P=P, wish=wish, qd=qd)
        if self.smooth_start is not None:
            held = {"mu": program.number(self.smooth_start), "first": program.rows(n)}
            qd = program.result(kernels.smooth_start_command, "out", n, **held, dt=given.dt, qd=qd)
        return qd if self.limit is None else self.limit.stages(program, J, qd)

    def _projector(self, program: Program, error: BlockRows, A: BlockRows) -> BlockRows:
        """Add the stages of the projector onto what the task leaves free."""
        _, P = add_priorities(program, [(A, program.rows(error.size))], RCOND)
        if self.projection:
            bounds = program.constant([self.projection.low, self.projection.high])
            program.add(kernels.apply_large_projector, A=A, error=error, bounds=bounds, P=P)
        return P

    def _wish(self, given: ControllerInputs, n: int) -> BlockRows:
        """Add the stage of the secondary motion, which may come from a user's class."""
        program, q, secondary = given.program, given.q, self.secondary
        if type(secondary) in (AvoidLimits, Posture):
            low, high = (program.constant(each) for each in secondary.bounds(self.limits))
            return program.result(
                kernels.compute_limit_avoidance,
                "wish",
                n,
                gain=program.number(secondary.gain),
                lowest=low,
                highest=high,
                q=[q[i] if i >= 0 else None for i in self.coordinates],
            )
        return program.asked(lambda blocks, step: self._asked(blocks.get(q), n), n)

    def _asked(self, q: Array, n: int) -> Array:
        """Return the secondary motion (n, B) of a user's class.

        Velocities without a coordinate of their own are at zero.
        """
        name, wanted = type(self.secondary).__name__, (q.shape[1], n)
        own = self.coordinates[:, None] >= 0
        at = np.where(own, q[self.coordinates], 0.0)
        given = self.secondary.velocity(view_for_user(at), self.limits)
        wish = as_floats(given, f"{name}.velocity", wanted)
        if wish.shape != wanted:
            raise InputError(f"{name}.velocity: expected shape {wanted}, got {wish.shape}")
        return np.ascontiguousarray(wish.T)


def find_coordinates(scene: Scene, columns: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """Return the coordinate that each velocity alone changes (else -1), and its limits (n, 2)."""
    found = scene.tree.alone(columns)
    limits = np.where((found >= 0)[:, None], scene.limits[found], [-np.inf, np.inf])
    return found, make_read_only(limits)
