"""The stages of the controller of one servo task, from the image to the command."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import construct_unchecked
from robsim.kernels.control import broyden_update, control_law, mark_weights
from robsim.kernels.linear_algebra.pseudoinverse import count_solution_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.servo.command import LawInput
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.feature_stages import BoundFeatureRows
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows, as_compiled_law
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.feed_forward import EstimatedMotion, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import SAME_UNITS, describe_metric_columns
from robsim.servo.weight_stages import (
    add_component_weights,
    add_user_weights,
    mask_entries,
    scale_entries,
)
from robsim.servo.weightings.mark_dependencies import find_mark_dependencies, group_components
from robsim.servo.weightings.weighting_protocol import MarkWeighting

if TYPE_CHECKING:
    from robsim.servo.servo_controller import ServoController


class ServoStages:
    """The stages of a `ServoController`, and the rows that they write.

    `assess` adds those of the error and of what the law is given, `command` those of the law.
    """

    def __init__(self, controller: ServoController, given: ControllerInputs) -> None:
        self.controller, self.given, self.program = controller, given, given.program
        self.k, self.n = controller.k, controller.columns.size
        self.law = as_compiled_law(controller.law)
        self.add, self.rows, self.constant = (
            given.program.add,
            given.program.rows,
            given.program.constant,
        )
        self._at_gain: CommandAtGain | None = None  # of the law, where the gain depends on it
        self.learnt, self.last = self.rows(self.k, self.n), self.rows(self.k + self.n)
        self.weights: BlockRows | None = None
        self.status: BlockRows | None = None
        self.hidden: BlockRows | None = None

    def assess(self) -> None:
        """Add the stages of s, L, L J and the error, weighted, and of the gain and the drift."""
        c, program = self.controller, self.program
        of = self.of = BoundFeatureRows(c.regulated, self.given, c.weighting)
        goal = program.each(c.s_goal)
        self.error = program.result(control_law.subtract_goal, "error", self.k, s=of.s, s_goal=goal)
        self.L, self.A = of.L, of.A
        if c.broyden is not None:
            self._learn()
        if c.weighting:
            self.weights = self._weights()
            self.hidden = self._unused(self.weights)
        elif self.given.hides:
            self.hidden = of.hidden()
        if self.hidden is not None:
            self._change(mask_entries, self.hidden)
        self.plain = self.error, self.A
        if self.weights is not None:
            self._change(scale_entries, self.weights)
        self.faded = self.error, self.A
        if (c.regulated.weights != 1.0).any():
            self._change(scale_entries, self.constant(c.regulated.weights.ravel()))
        self.weighted, self.error = self.error, self.plain[0]
        if self.weights is not None:
            self.status = self._few(self.weights)
        self.gain = self._gain()
        self.towards = self.weighted if c.feed_forward is None else self._with_drift()

    def command(self) -> BlockRows:
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

    def rate(self) -> BlockRows:
        """Return the rows of the rate at which the error is to change, -gain e."""
        given = {"gain": self.gain, "x": self.towards}
        return self.program.result(control_law.compute_joint_command, "qd", self.k, **given)

    def commanded(self, qd: BlockRows) -> ControllerOutputs:
        """Return the rows that are written, with those of a command."""
        error, A = self.plain
        return ControllerOutputs(
            *(self.of.s, error, qd, A, self.rows()),
            lambda blocks: blocks.get(self.of.first),
            self.note,
            self.weights,
            self.status,
            lambda blocks: LawInput(blocks.get(error), self.state(blocks, 0, {}, self.towards)),
        )

    def note(self, qd: BlockRows) -> None:
        """Add the stages that remember what was commanded in the end."""
        c, of, k, add = self.controller, self.of, self.k, self.add
        known = isinstance(c.feed_forward, KnownMotion)
        if c.regulated.depths.filtered:
            for key, J in of.J.items():
                twist = self.program.result(control_law.multiply_vector, "out", 6, A=J, x=qd)
                own = of.twist[key] if known else self.constant(np.zeros(6))
                add(control_law.add_vectors, x=twist, y=own, out=of.seen_twist[key])
        if isinstance(c.feed_forward, EstimatedMotion):
            add(control_law.multiply_vector, A=self.A, x=qd, out=self._moved)
        if c.broyden is not None:
            add(control_law.copy_rows, rows=self.plain[1].flat, to=self.learnt.flat)
            add(control_law.copy_rows, rows=qd, to=self.last[k:])
            drift = self._drift if known else of.s
            factor = self.given.dt if known else self.constant(0.0)
            given = {"x": of.s, "factor": factor, "more_of": drift}
            add(control_law.add_scaled_vector, **given, divided=False, out=self.last[:k])

    def _learn(self) -> None:
        """Let L J be learnt by Broyden's rule, from what is modelled at the start."""
        rule, k, n = self.controller.broyden, self.k, self.n
        assert rule is not None
        self.add(
            broyden_update.learn_jacobian,
            dt=self.given.dt,
            s=self.of.s,
            without=self.last[:k],
            qd=self.last[k:],
            start=self.A if rule.start is None else self.constant(rule.start),
            estimate=self.learnt,
            room=self.rows(k * n + k + n),
        )
        self.A = self.learnt

    def _weights(self) -> BlockRows:
        """Return the rows of the weights (k,) of all weightings, by marks and then by the error."""
        c, each = self.controller, find_mark_dependencies(self.controller.regulated)
        weights = add_component_weights(self.program, self.of.weights, each)
        asked = [one for one in c.weighting if not isinstance(one, MarkWeighting)]
        if not asked:
            return weights
        error = mask_entries(self.program, self.error, self._unused(weights))
        return add_user_weights(
            self.program, asked, error, weights, c.tolerances, group_components(each)
        )

    def _unused(self, weights: BlockRows) -> BlockRows:
        """Return the rows (k,) that say which numbers have the weight 0."""
        return self.program.result(mark_weights.flag_unused_numbers, "out", self.k, weights=weights)

    def _few(self, weights: BlockRows) -> BlockRows:
        """Return the row that says where too little is left to command, by rank and by count."""
        c, k, n, program = self.controller, self.k, self.n, self.program
        return program.result(
            mark_weights.detect_too_few_marks,
            "status",
            A=self.A,
            **describe_metric_columns(self.of.first if c.one_motion else SAME_UNITS),
            weights=weights,
            least=program.number(c.full_rank),
            rcond=self.constant(c.rcond),
            marks=max(getattr(each, "least", 1) for each in c.weighting),
            zeros=self.constant(np.zeros(k + 6)),
            room=program.scratch(n + max(count_solution_rows(k, n), count_solution_rows(6, n))),
            images=[(self.of.weights[sight.key],) for sight in c.regulated.sights],
        )

    def _change(
        self, stages: Callable[[Program, BlockRows, BlockRows], BlockRows], by: BlockRows
    ) -> None:
        """Let error, L and L J be others, row by row."""
        given = self.error, self.L, self.A
        self.error, self.L, self.A = (stages(self.program, each, by) for each in given)

    def _gain(self) -> BlockRows:
        """Return the row of the gain, which may depend on the error or on the law itself."""
        gain, program = self.controller.gain, self.program
        if not isinstance(gain, AdaptiveGain):
            return program.number(gain)
        numbers = self.constant([gain.at_zero, gain.at_infinity, gain.slope])
        largest = gain.of == "command"
        size = self._at_unit_gain() if largest else self.faded[0]
        given = {"size_of": size, "numbers": numbers, "largest": largest}
        return program.result(control_law.adapt_gain, "gain", **given)

    def _at_unit_gain(self) -> BlockRows:
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

    def _with_drift(self) -> BlockRows:
        """Return the rows of the error with the motion of the target in it."""
        c, k, program = self.controller, self.k, self.program
        if isinstance(c.feed_forward, EstimatedMotion):
            self._moved = self.rows(k)
            drift = program.result(
                control_law.estimate_drift,
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
            drift = scale_entries(program, self._drift, self.constant(c.regulated.weights.ravel()))
        if self.hidden is not None:
            drift = mask_entries(program, drift, self.hidden)
        if self.weights is not None:
            drift = scale_entries(program, drift, self.weights)
        given = {"x": self.weighted, "factor": self.gain, "more_of": drift, "divided": True}
        return program.result(control_law.add_scaled_vector, "out", k, **given)

    def _wish(self, law: CompiledLaw, error: BlockRows) -> CommandAtGain:
        """Add the stages of a law that do not depend on the gain; return what adds the others."""
        of, given = self.of, (self.controller.inverse, self.controller.one_motion)
        rows = error, self.L, of.first, self.A, of.s, self.given.q
        return law.stages(LawRows(self.program, self.k, self.n, *rows, *given))

    def _asked(self, blocks: Blocks, step: int) -> Array:
        """Return the velocities (n, B) from a law of any other kind, which may be a user's."""
        memory = self.given.memory(blocks).setdefault("law", {})
        return self.controller.commanded(self.state(blocks, step, memory, self.towards))

    def state(
        self, blocks: Blocks, step: int, memory: dict[str, Any], error: BlockRows
    ) -> ControlState:
        """Return what the law is given, with an error in rows."""
        c, get = self.controller, blocks.get
        constant = isinstance(c.gain, float)
        return construct_unchecked(
            ControlState,
            error_last=make_read_only(get(error)),
            interaction_last=make_read_only(get(self.L)),
            jacobian_last=make_read_only(get(self.of.first)),
            task_jacobian_last=make_read_only(get(self.A)),
            gain=c.gain if constant else make_read_only(get(self.gain)[:, None]),
            inverse=c.inverse,
            s_last=make_read_only(get(self.of.s)),
            q_last=make_read_only(get(self.given.q)),
            time=step * self.given.seconds,
            dt=self.given.seconds,
            memory=memory,
            one_motion=c.one_motion,
        )
