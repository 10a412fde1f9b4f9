"""The stages of the controller of one servo task, from the image to the command."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.base.values import known
from robsim.kernels.control import broyden, commanding, weighting
from robsim.kernels.linear_algebra.solve import scratch_of
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.servo.command import Basis
from robsim.servo.given import Commanded, Given
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.feed_forward import EstimatedMotion, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import ANY, metres
from robsim.servo.laws.staged_law import AtGain, LawRows, StagedLaw, staged
from robsim.servo.regulated_stages import RegulatedRows
from robsim.servo.weight_stages import by_error, masked, of_numbers, weighed
from robsim.servo.weightings.made_of import groups, made_of
from robsim.servo.weightings.weighting import WeightsOfMarks

if TYPE_CHECKING:
    from robsim.servo.servo_controller import Servo


class ServoStages:
    """The stages of a `Servo`, and the rows that they write.

    `assess` adds those of the error and of what the law is given, `command` those of the law.
    """

    def __init__(self, controller: Servo, given: Given) -> None:
        self.controller, self.given, self.program = controller, given, given.program
        self.k, self.n = controller.k, controller.columns.size
        self.law = staged(controller.law)
        self.add, self.rows, self.constant = (
            given.program.add,
            given.program.rows,
            given.program.constant,
        )
        self._at_gain: AtGain | None = None  # of the law, where the gain depends on it
        self.learnt, self.last = self.rows(self.k, self.n), self.rows(self.k + self.n)
        self.weights: Rows | None = None
        self.status: Rows | None = None
        self.hidden: Rows | None = None

    def assess(self) -> None:
        """Add the stages of s, L, L J and the error, weighted, and of the gain and the drift."""
        c, program = self.controller, self.program
        of = self.of = RegulatedRows(c.regulated, self.given, c.weighting)
        goal = program.each(c.s_goal)
        self.error = program.result(commanding.difference, "error", self.k, s=of.s, s_goal=goal)
        self.L, self.A = of.L, of.A
        if c.broyden is not None:
            self._learn()
        if c.weighting:
            self.weights = self._weights()
            self.hidden = self._unused(self.weights)
        elif self.given.hides:
            self.hidden = of.hidden()
        if self.hidden is not None:
            self._change(masked, self.hidden)
        self.plain = self.error, self.A
        if self.weights is not None:
            self._change(weighed, self.weights)
        self.faded = self.error, self.A
        if (c.regulated.weights != 1.0).any():
            self._change(weighed, self.constant(c.regulated.weights.ravel()))
        self.weighted, self.error = self.error, self.plain[0]
        if self.weights is not None:
            self.status = self._few(self.weights)
        self.gain = self._gain()
        self.towards = self.weighted if c.feed_forward is None else self._with_drift()

    def command(self) -> Rows:
        """Add the stages of the law and of what is done to its command; return its rows."""
        if self.law is not None:
            at_gain = self._at_gain
            if at_gain is None or self.towards != self.weighted:
                at_gain = self._wish(self.law, self.towards)
            qd = at_gain(self.gain)
        else:
            qd = self.program.asked(self._asked, self.n)
        error, A = self.faded
        return self.controller.shaping.stages(self.given, qd, error, self.of.first, A)

    def rate(self) -> Rows:
        """Return the rows of the rate at which the error is to change, -gain e."""
        given = {"gain": self.gain, "x": self.towards}
        return self.program.result(commanding.commanded, "qd", self.k, **given)

    def commanded(self, qd: Rows) -> Commanded:
        """Return the rows that are written, with those of a command."""
        error, A = self.plain
        return Commanded(
            *(self.of.s, error, qd, A, self.rows()),
            lambda blocks: blocks.get(self.of.first),
            self.note,
            self.weights,
            self.status,
            lambda blocks: Basis(blocks.get(error), self.state(blocks, 0, {}, self.towards)),
        )

    def note(self, qd: Rows) -> None:
        """Add the stages that remember what was commanded in the end."""
        c, of, k, add = self.controller, self.of, self.k, self.add
        known = isinstance(c.feed_forward, KnownMotion)
        if c.regulated.depths.filtered:
            for key, J in of.J.items():
                twist = self.program.result(commanding.along, "out", 6, A=J, x=qd)
                own = of.twist[key] if known else self.constant(np.zeros(6))
                add(commanding.summed, x=twist, y=own, out=of.seen_twist[key])
        if isinstance(c.feed_forward, EstimatedMotion):
            add(commanding.along, A=self.A, x=qd, out=self._moved)
        if c.broyden is not None:
            add(commanding.copied, rows=self.plain[1].flat, to=self.learnt.flat)
            add(commanding.copied, rows=qd, to=self.last[k:])
            drift = self._drift if known else of.s
            factor = self.given.dt if known else self.constant(0.0)
            given = {"x": of.s, "factor": factor, "more_of": drift}
            add(commanding.ahead, **given, divided=False, out=self.last[:k])

    def _learn(self) -> None:
        """Let L J be learnt by Broyden's rule, from what is modelled at the start."""
        rule, k, n = self.controller.broyden, self.k, self.n
        assert rule is not None
        self.add(
            broyden.learn_stage,
            dt=self.given.dt,
            s=self.of.s,
            without=self.last[:k],
            qd=self.last[k:],
            start=self.A if rule.start is None else self.constant(rule.start),
            estimate=self.learnt,
            room=self.rows(k * n + k + n),
        )
        self.A = self.learnt

    def _weights(self) -> Rows:
        """Return the rows of the weights (k,) of all weightings, by marks and then by the error."""
        c, each = self.controller, made_of(self.controller.regulated)
        weights = of_numbers(self.program, self.of.weights, each)
        asked = [one for one in c.weighting if not isinstance(one, WeightsOfMarks)]
        if not asked:
            return weights
        error = masked(self.program, self.error, self._unused(weights))
        return by_error(self.program, asked, error, weights, c.tolerances, groups(each))

    def _unused(self, weights: Rows) -> Rows:
        """Return the rows (k,) that say which numbers have the weight 0."""
        return self.program.result(weighting.unused, "out", self.k, weights=weights)

    def _few(self, weights: Rows) -> Rows:
        """Return the row that says where too little is left to command, by rank and by count."""
        c, k, n, program = self.controller, self.k, self.n, self.program
        return program.result(
            weighting.few,
            "status",
            A=self.A,
            **metres(self.of.first if c.one_motion else ANY),
            weights=weights,
            least=program.number(c.full_rank),
            rcond=self.constant(c.rcond),
            marks=max(getattr(each, "least", 1) for each in c.weighting),
            zeros=self.constant(np.zeros(k + 6)),
            room=program.scratch(n + max(scratch_of(k, n), scratch_of(6, n))),
            images=[(self.of.weights[sight.key],) for sight in c.regulated.sights],
        )

    def _change(self, stages: Callable[[Program, Rows, Rows], Rows], by: Rows) -> None:
        """Let error, L and L J be others, row by row."""
        given = self.error, self.L, self.A
        self.error, self.L, self.A = (stages(self.program, each, by) for each in given)

    def _gain(self) -> Rows:
        """Return the row of the gain, which may depend on the error or on the law itself."""
        gain, program = self.controller.gain, self.program
        if not isinstance(gain, AdaptiveGain):
            return program.number(gain)
        numbers = self.constant([gain.at_zero, gain.at_infinity, gain.slope])
        largest = gain.of == "command"
        size = self._at_unit_gain() if largest else self.faded[0]
        given = {"size_of": size, "numbers": numbers, "largest": largest}
        return program.result(commanding.adapt, "gain", **given)

    def _at_unit_gain(self) -> Rows:
        """Return the rows of what the law commands at a gain of one."""
        if self.law is not None:
            self._at_gain = self._wish(self.law, self.weighted)
            return self._at_gain(self.constant(1.0))
        return self.program.asked(self._tried, self.n)

    def _tried(self, blocks: Blocks, step: int) -> Array:
        """Return what a law in Python commands at a gain of one; it will be asked again."""
        memory = deepcopy(self.given.memory(blocks).get("law", {}))
        state = replace(self.state(blocks, step, memory, self.weighted), gain=1.0)
        return self.controller.commanded(state)

    def _with_drift(self) -> Rows:
        """Return the rows of the error with the motion of the target in it."""
        c, k, program = self.controller, self.k, self.program
        if isinstance(c.feed_forward, EstimatedMotion):
            self._moved = self.rows(k)
            drift = program.result(
                commanding.estimate,
                "drifts",
                k,
                errors=self.weighted,
                before=self.rows(k),
                moved=self._moved,
                lag=self.program.number(c.feed_forward.lag),
                dt=self.given.dt,
            )
        else:
            self._drift = self.of.drift()
            drift = weighed(program, self._drift, self.constant(c.regulated.weights.ravel()))
        if self.hidden is not None:
            drift = masked(program, drift, self.hidden)
        if self.weights is not None:
            drift = weighed(program, drift, self.weights)
        given = {"x": self.weighted, "factor": self.gain, "more_of": drift, "divided": True}
        return program.result(commanding.ahead, "out", k, **given)

    def _wish(self, law: StagedLaw, error: Rows) -> AtGain:
        """Add the stages of a law that do not depend on the gain; return what adds the others."""
        of, given = self.of, (self.controller.inverse, self.controller.one_motion)
        rows = error, self.L, of.first, self.A, of.s, self.given.q
        return law.stages(LawRows(self.program, self.k, self.n, *rows, *given))

    def _asked(self, blocks: Blocks, step: int) -> Array:
        """Return the velocities (n, B) from a law of any other kind, which may be a user's."""
        memory = self.given.memory(blocks).setdefault("law", {})
        return self.controller.commanded(self.state(blocks, step, memory, self.towards))

    def state(self, blocks: Blocks, step: int, memory: dict[str, Any], error: Rows) -> ControlState:
        """Return what the law is given, with an error in rows."""
        c, get = self.controller, blocks.get
        constant = isinstance(c.gain, float)
        return known(
            ControlState,
            error_last=frozen(get(error)),
            interaction_last=frozen(get(self.L)),
            jacobian_last=frozen(get(self.of.first)),
            task_jacobian_last=frozen(get(self.A)),
            gain=c.gain if constant else frozen(get(self.gain)[:, None]),
            inverse=c.inverse,
            s_last=frozen(get(self.of.s)),
            q_last=frozen(get(self.given.q)),
            time=step * self.given.seconds,
            dt=self.given.seconds,
            memory=memory,
            one_motion=c.one_motion,
        )
