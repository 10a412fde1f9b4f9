"""The stages that keep a command within the limits of a `Safety`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.control import command_limits, control_law
from robsim.kernels.control.velocity_scale import scale_command
from robsim.kernels.formulas.perspective import IN_IMAGE
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.integration_stages import add_integration
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.frame_rows import add_body_poses
from robsim.servo.safety.safety import Safety
from robsim.servo.shaping.command_shaper import find_coordinates
from robsim.servo.task_controller import TaskController
from robsim.servo.weight_stages import scale_entries
from robsim.world.scene import Scene

BRAKE_ATTEMPTS = 3  # commands that are tried before a frame that nears its fence is braked
BRAKE_FRACTIONS = 0.25, 0.5, 0.75, 1.0  # of the way to rest, where it is looked at


@dataclass(frozen=True)
class SafetyGuard:
    """A safety, and the scene that the controller believes, in which its limits are."""

    safety: Safety
    believed: Scene

    def stages(self, controller: TaskController, given: ControllerInputs) -> SafetyStages:
        """Add the stages of a controller, then those that keep its command within limits."""
        return SafetyStages(controller, self, given)


class SafetyStages:
    """What a controller writes within the limits of a `Safety`, and rows of these."""

    def __init__(
        self, controller: TaskController, guard: SafetyGuard, given: ControllerInputs
    ) -> None:
        self.controller, self.given = controller, given
        self.safety, self.scene = guard.safety, guard.believed
        inner, n, program = controller.stages(given), controller.columns.size, given.program
        self.n, self.program, self.share, self.busy = n, program, program.rows(), program.rows()
        self.last = program.rows(n)  # what was commanded last
        self.seconds = program.rows()  # for which a command has grown
        self.most = program.constant(self._limits("acceleration"))
        self.why = program.rows()  # which limits act, bits as `command_limits` names them
        self.at_limit = program.rows(n)  # 1 where a joint is kept from its limit
        qd = self._within(inner)
        busy = program.result(control_law.compute_any, "out", rows=[inner.busy, self.busy])
        self.commanded = replace(inner, qd=qd, busy=busy)

    def _within(self, inner: ControllerOutputs) -> BlockRows:
        """Add the stages from what the law wishes to what is commanded, and return its rows."""
        n, program, wished = self.n, self.program, inner.qd
        self._hold(wished, inner.status)
        command, brake = program.rows(n), program.rows(n)
        places, (low, high) = self._joints()
        program.add(
            command_limits.limit_command,
            wished=wished,
            scaled=self._scaled(wished),
            last=self.last,
            command=command,
            brake=brake,
            shares=self.share,
            reason=self.why,
            duration=self.given.dt,
            accelerations=self.most,
            low=low,
            high=high,
            q=self.given.q,
            at_limit=self.at_limit,
            places=places,
        )
        qd = command if self.safety.fence is None else self._fence(command, brake)
        program.add(
            command_limits.store_command,
            out=qd,
            last=self.last,
            reason=self.why,
            busy=self.busy,
            share=self.share,
        )
        return qd

    def _hold(self, wished: BlockRows, status: BlockRows | None) -> None:
        """Add the stage that lets the robot move, or holds it."""
        dog, program, given = self.safety.watchdog, self.program, self.given
        after = math.inf if dog is None else dog.after
        stops = dog is not None and dog.then == "stop"
        program.add(
            command_limits.hold_command,
            wished=wished,
            dt=given.dt,
            age=program.constant(0.0) if given.age is None else given.age,
            released=program.constant(1.0) if given.released is None else given.released,
            settings=program.constant([after, float(stops), self.safety.ramp or 0.0]),
            latched=program.rows(),
            passed=self.seconds,
            share=self.share,
            reason=self.why,
            status=program.constant(float(IN_IMAGE)) if status is None else status,
        )

    def _scaled(self, wished: BlockRows) -> BlockRows:
        """Add the stage that slows a wish down to its speeds; return the rows of the result."""
        if self.safety.speed is None:
            return wished
        program, n = self.program, self.n
        limits = program.constant([*self._limits("speed"), math.inf, math.inf])
        J = program.rows(6, n)
        return program.result(scale_command, "out", n, J=J, limits=limits, qd=wished)

    def _joints(self) -> tuple[list[int], tuple[BlockRows, BlockRows]]:
        """Return the coordinates that are watched, or -1, and the rows of their bounds."""
        where, bounds = find_coordinates(self.scene, self.controller.columns)
        if self.safety.margin is None:
            where = np.full(self.n, -1)
        else:
            margins = self.safety.limits("margin", self.scene.nq)[where]
            bounds = bounds + np.stack([margins, -margins], axis=1)
        low, high = (self.program.constant(bounds[:, i]) for i in range(2))
        return where.tolist(), (low, high)

    def _fence(self, command: BlockRows, brake: BlockRows) -> BlockRows:
        """Add the stages that keep a frame in its box; return the rows of the command."""
        fence, program, n = self.safety.fence, self.program, self.n
        assert fence is not None
        qd, seconds = program.rows(BRAKE_ATTEMPTS, n), program.rows(BRAKE_ATTEMPTS)
        program.add(
            command_limits.compute_attempts,
            command=command,
            brake=brake,
            duration=self.given.dt,
            most=self.most,
            velocities=qd,
            seconds=seconds,
        )
        shares = [program.constant([place]) for place in BRAKE_FRACTIONS]
        ways = [
            self._after(fence.frame, qd[k], scale_entries(program, seconds[k].flat, share)[0])
            for k in range(BRAKE_ATTEMPTS)
            for share in shares
        ]
        return program.result(
            command_limits.fence_command,
            "out",
            n,
            attempts=qd,
            brake=brake,
            reason=self.why,
            box=program.constant([fence.low, fence.high]),
            now=self._at(fence.frame, self.given.q),
            places=len(BRAKE_FRACTIONS),
            poses=ways,
        )

    def _after(self, frame: str, qd: BlockRows, seconds: BlockRows) -> BlockRows:
        """Add the stages of the pose of a frame after some time at velocities; return its rows."""
        program, scene = self.program, self.scene
        moved = dict(zip(self.controller.columns, qd, strict=True))
        rates = [moved.get(column) for column in range(scene.nv)]
        q = program.result(control_law.copy_rows, "to", scene.nq, rows=self.given.q)
        add_integration(program, scene.tree.joints, q, rates, seconds)
        return self._at(frame, q)

    def _at(self, frame: str, q: BlockRows) -> BlockRows:
        """Add the stages of the pose of a frame at coordinates; return its rows."""
        placed = add_body_poses(self.program, self.scene.tree, q)
        return placed.frames([self.scene.tree.find(frame)])[0]

    def _limits(self, which: str) -> Array:
        """Return a limit of each commanded velocity (n,)."""
        return self.safety.limits(which, self.scene.nv)[self.controller.columns]
