"""The stages that keep a command within the limits of a `Safety`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.kernels.control import command_limits, control_law
from robsim.kernels.control.constrained_command import constrain_command, count_constraint_rows
from robsim.kernels.control.scaled_target import scale_target
from robsim.kernels.control.velocity_scale import scale_command
from robsim.kernels.formulas.perspective import IN_IMAGE
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.integration_stages import add_integration
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.frame_rows import add_body_poses
from robsim.servo.safety.safety import Fence, Safety
from robsim.servo.shaping.command_shaper import find_coordinates
from robsim.servo.task_controller import TaskController
from robsim.servo.weight_stages import scale_entries
from robsim.world.scene import Scene

JOINT_WEIGHT = 1e-4  # of the deviation of velocities, beside that of the change of the error
SLOW_WEIGHT = 0.02  # of a lower speed, beside a deviation from the direction
LEAST_WEIGHT = 1e-9  # of all unknowns, for a strictly convex problem
BRAKE_ATTEMPTS = 3  # commands that are tried before a frame near its fence is braked
BRAKE_PLACES = 6  # checked poses of the braking motion, at equal distances


@dataclass(frozen=True)
class SafetyGuard:
    """A safety with the believed scene, which defines its limits.

    `hold` is the longest time in seconds that a command may act.
    """

    safety: Safety
    believed: Scene
    hold: float

    def check_command_quantity(self, controller: TaskController) -> None:
        """Raise InputError if the commands are torques and the safety limits velocities."""
        if controller.command_quantity == "velocity":
            return
        for field in ("speed", "acceleration", "margin", "fence"):
            if getattr(self.safety, field) is not None:
                raise InputError(
                    f"safety: {field} limits velocities, and the law commands torques: leave "
                    f"{field} out, and limit torques by the effort of the joints"
                )

    def stages(self, controller: TaskController, inputs: ControllerInputs) -> SafetyStages:
        """Add the stages of a controller, and then the stages that limit its command."""
        return SafetyStages(controller, self, inputs)


class SafetyStages:
    """Output of a controller within the limits of a `Safety`, and the rows of these limits."""

    def __init__(
        self, controller: TaskController, guard: SafetyGuard, inputs: ControllerInputs
    ) -> None:
        self.controller, self.inputs = controller, inputs
        self.safety, self.scene = guard.safety, guard.believed
        inner, n, program = controller.stages(inputs), controller.columns.size, inputs.program
        self.n, self.program, self.scale, self.busy = n, program, program.rows(), program.rows()
        self.last = program.rows(n)  # last command
        self.growth_time = program.rows()  # time since the command began to grow
        self.hold = program.constant(guard.hold)
        self.accelerations = program.constant(self._velocity_limits("acceleration"))
        self.reasons = program.rows()  # active limits, as the bits of `command_limits`
        self.at_limit = program.rows(n)  # 1 for a joint that is kept from its limit
        qd = self._limit_command(inner)
        busy = program.result(control_law.compute_any, "out", rows=[inner.busy, self.busy])
        self.outputs = replace(inner, qd=qd, busy=busy)

    def _limit_command(self, inner: ControllerOutputs) -> BlockRows:
        """Add the stages from the command of the law to the limited command; return its rows."""
        n, program, law_command = self.n, self.program, inner.qd
        self._add_hold(law_command, inner.status)
        target, lowest, highest, slowest, fastest, brake = (program.rows(n) for _ in range(6))
        joints = self._joint_limits()
        program.add(
            command_limits.limit_command,
            law_command=law_command,
            scaled=self._scale_to_speed(law_command),
            target=target,
            lowest=lowest,
            highest=highest,
            slowest=slowest,
            fastest=fastest,
            brake=brake,
            shares=self.scale,
            speeds=program.constant(self._velocity_limits("speed")),
            **joints,
        )
        if self.safety.margin is not None:
            target = self._deflect_target(inner.task_jacobian, target, lowest, highest)
        if self.safety.acceleration is not None:
            target = self._slow_target(inner.task_jacobian, target, slowest, fastest)
        qd = command = target
        if self.safety.fence is not None:
            attempts = self._add_attempts(command, brake)
            if self.safety.margin is not None:
                velocities, seconds = attempts
                program.add(
                    command_limits.limit_attempts, velocities=velocities, seconds=seconds, **joints
                )
            qd = self._add_fence(self.safety.fence, *attempts, brake)
        program.add(
            command_limits.store_command,
            out=qd,
            last=self.last,
            reason=self.reasons,
            busy=self.busy,
            share=self.scale,
        )
        return qd

    def _deflect_target(
        self, A: BlockRows, target: BlockRows, low: BlockRows, high: BlockRows
    ) -> BlockRows:
        """Add the stage of the command within bounds that changes the error as a target does."""
        return self._add_program(A, JOINT_WEIGHT, target, low, high)

    def _slow_target(
        self, A: BlockRows, target: BlockRows, low: BlockRows, high: BlockRows
    ) -> BlockRows:
        """Add the stages of the command within bounds that slows a target rather than deflects it.

        The share of the target is a further unknown.
        """
        program, p = self.program, self.n + 1
        rows = program.rows(A.shape[0] + p, p)
        wish, least, most = (program.rows(p) for _ in range(3))
        program.add(
            scale_target,
            A=A,
            target=target,
            low=low,
            high=high,
            weights=program.constant([JOINT_WEIGHT, SLOW_WEIGHT]),
            rows=rows,
            wish=wish,
            least=least,
            most=most,
        )
        return self._add_program(rows, LEAST_WEIGHT, wish, least, most)[: self.n]

    def _add_program(
        self, A: BlockRows, weight: float, wish: BlockRows, low: BlockRows, high: BlockRows
    ) -> BlockRows:
        """Add the stage that solves a quadratic program within bounds; return its solution."""
        program, n = self.program, wish.size
        return program.result(
            constrain_command,
            "qd",
            n,
            A=A,
            eps=program.constant(weight),
            wish=wish,
            low=low,
            high=high,
            C=program.rows(0, n),
            bound=program.rows(0),
            levels=program.rows(0),
            price=program.constant(1.0),
            multipliers=program.rows(2 * n),
            slack=program.rows(0),
            unmet=program.rows(),
            scratch=program.scratch(count_constraint_rows(n, 0)),
        )

    def _add_hold(self, law_command: BlockRows, status: BlockRows | None) -> None:
        """Add the stage that holds the robot or lets it move."""
        watchdog, program, inputs = self.safety.watchdog, self.program, self.inputs
        after = math.inf if watchdog is None else watchdog.after
        stops = watchdog is not None and watchdog.then == "stop"
        program.add(
            command_limits.hold_command,
            law_command=law_command,
            dt=inputs.dt,
            age=program.constant(0.0) if inputs.age is None else inputs.age,
            released=program.constant(1.0) if inputs.released is None else inputs.released,
            settings=program.constant([after, float(stops), self.safety.ramp or 0.0]),
            latched=program.rows(),
            time_since_hold=self.growth_time,
            share=self.scale,
            reason=self.reasons,
            status=program.constant(float(IN_IMAGE)) if status is None else status,
        )

    def _scale_to_speed(self, command: BlockRows) -> BlockRows:
        """Add the stage that scales a command to the speed limits; return its rows."""
        if self.safety.speed is None:
            return command
        program, n = self.program, self.n
        limits = program.constant([*self._velocity_limits("speed"), math.inf, math.inf])
        J = program.rows(6, n)
        return program.result(scale_command, "out", n, J=J, limits=limits, qd=command)

    def _joint_limits(self) -> dict[str, Any]:
        """Return the arguments of the stages that keep joints within their limits, by their names.

        `places` holds the coordinate of each velocity, -1 without a margin.
        """
        coordinates, bounds = find_coordinates(self.scene, self.controller.columns)
        if self.safety.margin is None:
            coordinates = np.full(self.n, -1)
        else:
            margins = self.safety.limits("margin", self.scene.nq)[coordinates]
            bounds = bounds + np.stack([margins, -margins], axis=1)
        low, high = (self.program.constant(bounds[:, i]) for i in range(2))
        return {
            "last": self.last,
            "reason": self.reasons,
            "duration": self.inputs.dt,
            "hold": self.hold,
            "accelerations": self.accelerations,
            "low": low,
            "high": high,
            "q": self.inputs.q,
            "at_limit": self.at_limit,
            "places": coordinates.tolist(),
        }

    def _add_attempts(self, command: BlockRows, brake: BlockRows) -> tuple[BlockRows, BlockRows]:
        """Add the stage that computes attempts; return the rows of velocities and seconds."""
        program = self.program
        qd, seconds = program.rows(BRAKE_ATTEMPTS, self.n), program.rows(BRAKE_ATTEMPTS)
        program.add(
            command_limits.compute_attempts,
            command=command,
            brake=brake,
            duration=self.inputs.dt,
            hold=self.hold,
            accelerations=self.accelerations,
            velocities=qd,
            seconds=seconds,
        )
        return qd, seconds

    def _add_fence(
        self, fence: Fence, qd: BlockRows, seconds: BlockRows, brake: BlockRows
    ) -> BlockRows:
        """Add the stages that keep a frame in its box; return the rows of the command."""
        program, n = self.program, self.n
        shares = [program.constant([i / BRAKE_PLACES]) for i in range(1, BRAKE_PLACES + 1)]
        poses = [
            self._predict_pose(
                fence.frame, qd[k], scale_entries(program, seconds[k].flat, share)[0]
            )
            for k in range(BRAKE_ATTEMPTS)
            for share in shares
        ]
        return program.result(
            command_limits.fence_command,
            "out",
            n,
            attempts=qd,
            brake=brake,
            reason=self.reasons,
            box=program.constant([fence.low, fence.high]),
            current_pose=self._add_pose(fence.frame, self.inputs.q),
            bernstein=program.constant(compute_bernstein_matrix(BRAKE_PLACES)),
            poses=poses,
        )

    def _predict_pose(self, frame: str, qd: BlockRows, seconds: BlockRows) -> BlockRows:
        """Add the stages of a frame's pose after a time at constant velocities; return its rows."""
        program, scene = self.program, self.scene
        velocity_of = dict(zip(self.controller.columns, qd, strict=True))
        rates = [velocity_of.get(column) for column in range(scene.nv)]
        q = program.result(control_law.copy_rows, "to", scene.nq, rows=self.inputs.q)
        add_integration(program, scene.tree.joints, q, rates, seconds)
        return self._add_pose(frame, q)

    def _add_pose(self, frame: str, q: BlockRows) -> BlockRows:
        """Add the stages of the pose of a frame at coordinates; return its rows."""
        placed = add_body_poses(self.program, self.scene.tree, q)
        return placed.frames([self.scene.tree.find(frame)])[0]

    def _velocity_limits(self, which: str) -> Array:
        """Return a limit of each commanded velocity (n,)."""
        return self.safety.limits(which, self.scene.nv)[self.controller.columns]


def compute_bernstein_matrix(degree: int) -> Array:
    """Return the matrix (degree, degree) from values of a polynomial to Bernstein coefficients.

    The values are at the shares 1/degree, 2/degree, ..., 1 of the interval, relative to the value
    at its start. The first coefficient, which is the value at the start, is left out.
    """
    t, k = np.arange(1, degree + 1)[:, None] / degree, np.arange(1, degree + 1)
    binomials = np.array([math.comb(degree, i) for i in range(1, degree + 1)])
    basis = binomials * t**k * (1.0 - t) ** (degree - k)
    return np.asarray(np.linalg.inv(basis), dtype=np.float64)
