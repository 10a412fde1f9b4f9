"""The stages of the controller of one servo task, from the image to the command."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels import broyden, commanding
from robsim.kernels.program import Blocks
from robsim.kernels.solve import scratch_of
from robsim.kernels.stage import Stage
from robsim.servo.basis import Basis
from robsim.servo.command import Command
from robsim.servo.controller import Decision
from robsim.servo.given import Commanded, Given
from robsim.servo.laws.feed_forward import EstimatedMotion, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.law import CameraLaw, ControlState, JointLaw
from robsim.servo.regulated_stages import RegulatedRows
from robsim.servo.shaping.shaping import Shapeable

if TYPE_CHECKING:
    from robsim.servo.servo_controller import Servo


class ServoStages:
    """The stages of a `Servo`, and the rows that they write.

    `assess` adds those of the error and of what the law is given, `command` those of the law.
    """

    def __init__(self, controller: Servo, given: Given) -> None:
        self.controller, self.given, self.program = controller, given, given.program
        self.k, self.n = controller.k, controller.columns.size
        self.compiled = type(controller.law) in (JointLaw, CameraLaw)
        self.rows, self.constant = self.program.rows, self.program.constant
        self.learnt, self.last = self.rows(self.k * self.n), self.rows(self.k + self.n)

    def assess(self) -> None:
        """Add the stages of s, L, L J and the error, weighted, and of the gain and the drift."""
        c, k, n = self.controller, self.k, self.n
        of = self.of = RegulatedRows(c.regulated, self.given)
        self.error, self.L, self.A = self.rows(k), of.L, of.A
        self._add(commanding.difference, k, of.s, self.program.each(c.s_goal), self.error)
        if c.broyden is not None:
            self._learn()
        self.hidden = of.hidden() if self.given.hides else -1
        if self.hidden >= 0:
            self._change(commanding.masked, self.hidden)
        self.plain = self.error, self.L, self.A
        if (c.regulated.weights != 1.0).any():
            self._change(commanding.weigh, self.constant(c.regulated.weights))
        self.weighted, self.error = self.error, self.plain[0]
        self.unit = self.rows(n)
        self.gain = self._gain()
        self.towards = self.weighted if c.feed_forward is None else self._with_drift()

    def command(self) -> None:
        """Add the stages of the law and of what is done to its command."""
        c, n = self.controller, self.n
        if self.compiled:
            if self.towards != self.weighted or not self._asked_already:
                self._law(self.towards)
            qd = self.rows(n)
            self._add(commanding.commanded, n, self.gain, self.unit, qd)
        else:
            qd = self.rows(n)
            self.program.call(lambda blocks, step: blocks.put(qd, self._asked(blocks, step)))
        error, _, A = self.plain
        shapeable = Shapeable(self.k, n, error, self.of.first, A, qd)
        self.qd = c.shaping.stages(self.given, shapeable)

    def rate(self) -> int:
        """Return the rows of the rate at which the error is to change, -gain e."""
        rate = self.rows(self.k)
        self._add(commanding.commanded, self.k, self.gain, self.towards, rate)
        return rate

    def commanded(self) -> Commanded:
        """Return the rows that are written."""
        error, _, A = self.plain
        return Commanded(self.of.s, error, self.qd, A, self.rows(1), self.decision, self.note)

    def note(self, qd: int) -> None:
        """Add the stages that remember what was commanded in the end."""
        c, of, k, n = self.controller, self.of, self.k, self.n
        known = isinstance(c.feed_forward, KnownMotion)
        if c.regulated.depths.filtered:
            for key, J in of.J.items():
                twist = self.rows(6)
                self._add(commanding.along, J, 6, n, qd, twist)
                own = of.twist[key] if known else self.constant(np.zeros(6))
                self._add(commanding.summed, 6, twist, own, of.seen_twist[key])
        if isinstance(c.feed_forward, EstimatedMotion):
            self._add(commanding.along, self.A, k, n, qd, self._moved)
        if c.broyden is not None:
            self._add(commanding.copied, k * n, self.plain[2], self.learnt)
            self._add(commanding.copied, n, qd, self.last + k)
            drift = self._drift if known else of.s
            factor = self.given.dt if known else self.constant(0.0)
            self._add(commanding.ahead, k, of.s, factor, drift, False, self.last)

    def _learn(self) -> None:
        """Let L J be learnt by Broyden's rule, from what is modelled at the start."""
        rule, k, n = self.controller.broyden, self.k, self.n
        assert rule is not None
        start = self.A if rule.start is None else self.constant(rule.start)
        room = self.rows(k * n + k + n)
        rows = self.of.s, self.last, self.last + k, start, self.learnt, room
        self._add(broyden.learn_stage, k, n, self.given.dt, *rows)
        self.A = self.learnt

    def _change(self, stage: Stage, by: int) -> None:
        """Let error, L and L J be others, row by row."""
        for name, width in (("error", 1), ("L", 6), ("A", self.n)):
            found = self.rows(self.k * width)
            self._add(stage, getattr(self, name), self.k, width, by, found)
            setattr(self, name, found)

    def _gain(self) -> int:
        """Return the row of the gain, which may depend on the error or on the law itself."""
        gain = self.controller.gain
        self._asked_already = False
        if not isinstance(gain, AdaptiveGain):
            return self.program.each(np.reshape(gain, (1, -1)))
        numbers, row = self.constant([gain.at_zero, gain.at_infinity, gain.slope]), self.rows(1)
        if gain.of == "error":
            self._add(commanding.adapt, self.k, self.plain[0], numbers, False, row)
            return row
        if self.compiled:
            self._law(self.weighted)
            self._asked_already = True
        else:
            self.program.call(self._ask_at_unit_gain)
        self._add(commanding.adapt, self.n, self.unit, numbers, True, row)
        return row

    def _ask_at_unit_gain(self, blocks: Blocks, step: int) -> None:
        """Write what a law of any kind commands at a gain of one; it will be asked again."""
        memory = deepcopy(self.given.memory(blocks).get("law", {}))
        state = replace(self.state(blocks, step, memory, self.weighted), gain=1.0)
        blocks.put(self.unit, self.controller.commanded(state))

    def _with_drift(self) -> int:
        """Return the rows of the error with the motion of the target in it."""
        c, k = self.controller, self.k
        if isinstance(c.feed_forward, EstimatedMotion):
            self._moved, drift = self.rows(k), self.rows(k)
            lag, before = self.constant(c.feed_forward.lag), self.rows(k)
            given = self.weighted, before, self._moved, drift, lag, self.given.dt
            self._add(commanding.estimate, k, *given)
        else:
            self._drift = self.of.drift()
            drift = self.rows(k)
            weights = self.constant(c.regulated.weights)
            self._add(commanding.weigh, self._drift, k, 1, weights, drift)
        if self.hidden >= 0:
            seen = self.rows(k)
            self._add(commanding.masked, drift, k, 1, self.hidden, seen)
            drift = seen
        found = self.rows(k)
        self._add(commanding.ahead, k, self.weighted, self.gain, drift, True, found)
        return found

    def _law(self, error: int) -> None:
        """Add the stages of the velocities that the law gives at a gain of minus one."""
        law = self.controller.law
        if isinstance(law, CameraLaw):
            self._camera_law(error, law.length)
        else:
            self._joint_law(error)

    def _joint_law(self, error: int) -> None:
        """Add the stages of (L J)^+ e."""
        k, n = self.k, self.n
        transposed, damping, rcond = self.controller.inverse.numbers
        if self.controller.one_motion and min(k, n) > 6 and not (transposed or damping):
            room = max(scratch_of(k, n), max(scratch_of(k, 6), scratch_of(6, n)) + 6)
            rows = self.constant(rcond), self.unit, self.rows(1), self.rows(room)
            factors = self.L, k, self.of.first, n
            self._add(commanding.solve_product, *factors, self.A, error, *rows)
        else:
            self._invert(self.A, k, n, error, self.unit)

    def _camera_law(self, error: int, length: float) -> None:
        """Add the stages of the twist L^+ e, and of the velocities J^+ V."""
        k, n, unit = self.k, self.n, self.constant(length)
        _, damping, rcond = self.controller.inverse.numbers
        L, V, J = self.rows(6 * k), self.rows(6), self.rows(6 * n)
        self._add(commanding.in_units, self.L, k, 6, unit, 1, L)
        self._invert(L, k, 6, error, V)
        self._add(commanding.in_units, V, 6, 1, unit, 2, V)
        self._add(commanding.in_units, V, 6, 1, unit, 0, V)
        self._add(commanding.in_units, self.of.first, 6, n, unit, 0, J)
        self._solve(J, 6, n, V, self.unit, damping, rcond)

    def _invert(self, A: int, k: int, n: int, y: int, x: int) -> None:
        """Add the stage of x = A^+ y, or A' y."""
        transposed, damping, rcond = self.controller.inverse.numbers
        if transposed:
            self._add(commanding.transpose, A, k, n, y, x)
        else:
            self._solve(A, k, n, y, x, damping, rcond)

    def _solve(self, A: int, k: int, n: int, y: int, x: int, damping: float, rcond: float) -> None:
        damped = self.constant(damping) if damping > 0.0 else -1
        rows = damped, self.constant(rcond), x, self.rows(1), self.rows(scratch_of(k, n))
        self._add(commanding.solve, A, k, n, y, *rows)

    def _asked(self, blocks: Blocks, step: int) -> Array:
        """Return the velocities (n, B) from a law of any other kind, which may be a user's."""
        memory = self.given.memory(blocks).setdefault("law", {})
        return self.controller.commanded(self.state(blocks, step, memory, self.towards))

    def state(self, blocks: Blocks, step: int, memory: dict[str, Any], error: int) -> ControlState:
        """Return what the law is given, with an error in rows from the first."""
        c, get, k, n = self.controller, blocks.get, self.k, self.n
        constant = isinstance(c.gain, float)
        return ControlState(
            get(error, k),
            get(self.L, k, 6),
            get(self.of.first, 6, n),
            get(self.A, k, n),
            c.gain if constant else get(self.gain, 1)[0][:, None],
            c.inverse,
            get(self.of.s, k),
            get(self.given.q, c.scene.nq),
            step * self.given.seconds,
            self.given.seconds,
            memory,
            c.one_motion,
        )

    def decision(self, blocks: Blocks) -> Decision:
        """Return the decision of a step, with all that it is based on."""
        get, k, n = blocks.get, self.k, self.n
        error, _, A = self.plain
        basis = Basis(get(error, k), self.state(blocks, 0, {}, self.towards))
        command = Command(get(self.of.s, k), basis.error, get(self.qd, n), get(A, k, n))
        return Decision(command, get(self.of.first, 6, n), basis)

    def _add(self, stage: Stage, *numbers: int) -> None:
        self.program.add(stage, *numbers)
