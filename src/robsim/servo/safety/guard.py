"""The stages that keep a command within the limits of a `Safety`."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.control import commanding, guarding
from robsim.kernels.control.limit import scale_stage
from robsim.kernels.formulas.camera import IN_IMAGE
from robsim.kernels.machine.program import Blocks
from robsim.robot.motion import add_motion
from robsim.servo.controller import Controller, Decision
from robsim.servo.given import Commanded, Given
from robsim.servo.placed_frame import placed_at
from robsim.servo.safety.safety import Safety
from robsim.servo.shaping.shaping import coordinates_of
from robsim.world.scene import Scene

ATTEMPTS = 3  # commands that are tried before a frame that nears its fence is braked
PLACES = 0.25, 0.5, 0.75, 1.0  # of the way to rest, where it is looked at


@dataclass(frozen=True)
class Guarded:
    """What a controller writes within the limits of a `Safety`, and rows of these."""

    commanded: Commanded
    last: int  # (n,) what was commanded last
    seconds: int  # for which a command has grown
    most: int  # (n,) accelerations
    why: int  # which limits act, bits as `robsim.kernels.control.guarding` names them
    at_limit: int  # (n,) 1 where a joint is kept from its limit


@dataclass(frozen=True)
class Guard:
    """A safety, and the scene that the controller believes, in which its limits are."""

    safety: Safety
    believed: Scene

    def stages(self, controller: Controller, given: Given) -> Guarded:
        """Add the stages of a controller, then those that keep its command within limits."""
        inner = controller.stages(given)
        made = _Stages(controller, self, given)
        qd = made.add(inner)
        busy = given.program.rows()
        given.program.add(commanding.either, 2, busy, inner.busy, made.busy)

        def decide(blocks: Blocks) -> Decision:
            decision: Decision = inner.decide(blocks)
            within = decision.command._replace(qd=blocks.get(qd, made.n))
            return decision._replace(command=within)

        within = replace(inner, qd=qd, busy=busy, decide=decide)
        rows = made.last, made.seconds, made.most, made.why, made.at_limit
        return Guarded(within, *rows)


class _Stages:
    """The rows of the stages, and how they are connected."""

    def __init__(self, controller: Controller, guard: Guard, given: Given) -> None:
        self.controller, self.given = controller, given
        self.safety, self.scene = guard.safety, guard.believed
        self.n = controller.columns.size
        program = self.program = given.program
        self.why, self.at_limit, self.busy = program.rows(), program.rows(self.n), program.rows()
        self.share, self.last, self.seconds = program.rows(), program.rows(self.n), program.rows()
        self.most = program.constant(self._limits("acceleration"))

    def add(self, inner: Commanded) -> int:
        """Add the stages from what the law wishes to what is commanded, and return its rows."""
        n, program, wished = self.n, self.program, inner.qd
        self._hold(wished, inner.status)
        command, brake = program.rows(n), program.rows(n)
        where, limits = self._joints()
        rows = wished, self._scaled(wished), self.last, command, brake, self.share, self.why
        joints = self.given.dt, self.most, *limits, self.given.q, self.at_limit
        program.add(guarding.soften, n, *rows, *joints, *where)
        qd = command if self.safety.fence is None else self._fence(command, brake)
        program.add(guarding.remember, n, qd, self.last, self.why, self.busy, self.share)
        return qd

    def _hold(self, wished: int, status: int) -> None:
        """Add the stage that lets the robot move, or holds it."""
        dog, program, given = self.safety.watchdog, self.program, self.given
        after = math.inf if dog is None else dog.after
        stops = dog is not None and dog.then == "stop"
        settings = program.constant([after, float(stops), self.safety.ramp or 0.0])
        released = program.constant(1.0) if given.released < 0 else given.released
        age = program.constant(0.0) if given.age < 0 else given.age
        status = program.constant(IN_IMAGE) if status < 0 else status
        rows = released, settings, program.rows(), self.seconds, self.share, self.why, status
        program.add(guarding.hold, self.n, wished, given.dt, age, *rows)

    def _scaled(self, wished: int) -> int:
        """Add the stage that slows a wish down to its speeds; return the rows of the result."""
        if self.safety.speed is None:
            return wished
        program, found = self.program, self.program.rows(self.n)
        limits = program.constant([*self._limits("speed"), math.inf, math.inf])
        program.add(scale_stage, self.n, program.rows(6 * self.n), limits, wished, found)
        return found

    def _joints(self) -> tuple[list[int], tuple[int, int]]:
        """Return the coordinates that are watched, or -1, and the rows of their bounds."""
        where, bounds = coordinates_of(self.scene, self.controller.columns)
        if self.safety.margin is None:
            where = np.full(self.n, -1)
        else:
            margins = self.safety.limits("margin", self.scene.nq)[where]
            bounds = bounds + np.stack([margins, -margins], axis=1)
        low, high = (self.program.constant(bounds[:, i]) for i in range(2))
        return where.tolist(), (low, high)

    def _fence(self, command: int, brake: int) -> int:
        """Add the stages that keep a frame in its box; return the rows of the command."""
        fence, program, n = self.safety.fence, self.program, self.n
        assert fence is not None
        qd, seconds, out = program.rows(ATTEMPTS * n), program.rows(ATTEMPTS), program.rows(n)
        rows = command, brake, self.given.dt, self.most, ATTEMPTS, qd, seconds
        program.add(guarding.attempts, n, *rows)
        ways = [
            self._after(fence.frame, qd + k * n, self._part(seconds + k, place))
            for k in range(ATTEMPTS)
            for place in PLACES
        ]
        box = program.constant([*fence.low, *fence.high])
        now = self._at(fence.frame, self.given.q)
        each = box, now, ATTEMPTS, len(PLACES)
        program.add(guarding.fence, n, qd, brake, out, self.why, *each, *ways)
        return out

    def _part(self, row: int, share: float) -> int:
        """Add the stage of a share of a number; return its row."""
        found = self.program.rows()
        program = self.program
        program.add(commanding.weigh, row, 1, 1, program.constant(share), found)
        return found

    def _after(self, frame: str, qd: int, seconds: int) -> int:
        """Add the stages of the pose of a frame after some time at velocities; return its rows."""
        program, scene = self.program, self.scene
        q, rates = program.rows(scene.nq), np.full(scene.nv, -1)
        rates[self.controller.columns] = qd + np.arange(self.n)
        program.add(commanding.copied, scene.nq, self.given.q, q)
        add_motion(program, scene.tree.joints, q, rates, seconds)
        return self._at(frame, q)

    def _at(self, frame: str, q: int) -> int:
        """Add the stages of the pose of a frame at coordinates; return its rows."""
        placed = placed_at(self.program, self.scene.tree, q)
        return placed.frames([self.scene.tree.find(frame)])[0]

    def _limits(self, which: str) -> Array:
        """Return a limit of each commanded velocity (n,)."""
        return self.safety.limits(which, self.scene.nv)[self.controller.columns]
