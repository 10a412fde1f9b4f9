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
from robsim.servo.constraints.constraint_stages import ConstraintStages
from robsim.servo.controller_rows import ControllerInputs, ControllerOutputs
from robsim.servo.feature_stages import BoundFeatureRows
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows, as_compiled_law
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.feed_forward import EstimatedMotion, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import RCOND, SAME_UNITS, add_solve, describe_metric_columns
from robsim.servo.shaping.free_motions import FreeMotions, find_free_motions
from robsim.servo.task_product import TaskProduct
from robsim.servo.weight_stages import (
    add_component_weights,
    add_maximum,
    add_user_weights,
    mask_entries,
    scale_entries,
)
from robsim.servo.weightings.mark_dependencies import find_mark_dependencies, group_components
from robsim.servo.weightings.weighting_protocol import MarkWeighting

if TYPE_CHECKING:
    from robsim.servo.servo_controller import ServoController


class ServoStages:
    """Stages of a `ServoController`, and the rows that they write.

    `assess` adds the stages of the error and of the input of the law, `command` the stages of the
    law.
    """

    def __init__(self, controller: ServoController, inputs: ControllerInputs) -> None:
        self.controller, self.inputs, self.program = controller, inputs, inputs.program
        self.k, self.n = controller.k, controller.columns.size
        self.law = as_compiled_law(controller.law)
        self.add, self.rows, self.constant = (
            inputs.program.add,
            inputs.program.rows,
            inputs.program.constant,
        )
        # not None if the gain depends on the command of the law
        self._command_at_gain: CommandAtGain | None = None
        self.broyden_jacobian, self.last = self.rows(self.k, self.n), self.rows(self.k + self.n)
        self.weights: BlockRows | None = None
        self.status: BlockRows | None = None
        self.hidden: BlockRows | None = None
        self.product: TaskProduct | None = None
        self.constrained: ConstraintStages | None = None

    def assess(self) -> None:
        """Add the stages of s, L, L J and the error, weighted, and of the gain and the drift."""
        c, program = self.controller, self.program
        features = self.feature_rows = BoundFeatureRows(c.bound_features, self.inputs, c.weighting)
        goal = program.each(c.s_goal)
        self.error = program.result(
            control_law.subtract_goal, "error", self.k, s=features.s, s_goal=goal
        )
        self.L, self.A = features.L, features.A
        if c.broyden is not None:
            self._add_broyden()
        if c.weighting:
            self.weights = self._add_weights()
            self.hidden = self._flag_unused(self.weights)
        elif self.inputs.hides:
            self.hidden = features.flag_hidden()
        if self.hidden is not None:
            self._replace_error_rows(mask_entries, self.hidden)
        self.unweighted = self.error, self.A
        if any(each is not None for each in features.dampings):
            self.error, self.L, self.A = features.damp(self.error)
        if self.weights is not None:
            self._replace_error_rows(scale_entries, self.weights)
        self.weighted_by_marks = self.error, self.A
        if (c.bound_features.weights != 1.0).any():
            self._replace_error_rows(scale_entries, self.constant(c.bound_features.weights.ravel()))
        self.weighted_error, self.error = self.error, self.unweighted[0]
        if self.weights is not None:
            self.status = self._add_status(self.weights)
        self.status = add_maximum(program, [*features.statuses, self.status])
        J = self.feature_rows.first_jacobian
        self.product = TaskProduct(program, self.L, J, self.A) if c.one_motion else None
        self.gain = self._add_gain()
        self.law_error = self.weighted_error if c.feed_forward is None else self._add_drift()

    def command(self) -> BlockRows:
        """Add the stages of the law and of the shaping of its command; return its rows."""
        if self.law is not None:
            at_gain = self._command_at_gain
            if at_gain is None or self.law_error != self.weighted_error:
                at_gain = self._add_law(self.law, self.law_error)
            qd = at_gain(self.gain)
        else:
            qd = self.program.add_python_rows(self._call_law, self.n)
        error, A = self.weighted_by_marks
        shaping, constraints = self.controller.shaping, self.controller.constraints
        J = self.feature_rows.first_jacobian
        qd = shaping.stages(self.inputs, qd, error, J, A, self._find_free_motions)
        if constraints is None:
            return qd
        views = self.feature_rows.views()
        rows = self.inputs, self.feature_rows.placed, views, qd, self.A
        self.constrained = ConstraintStages(constraints, *rows)
        return self.constrained.qd

    def _find_free_motions(self) -> FreeMotions:
        """Return the motions that the task leaves free."""
        if self.product is not None:
            return self.product.find_free_motions(RCOND)
        return find_free_motions(self.program, self.weighted_by_marks[1], RCOND)

    def rate(self) -> BlockRows:
        """Return the rows of the desired rate of the error, -gain e."""
        arguments = {"gain": self.gain, "x": self.law_error}
        return self.program.result(control_law.compute_joint_command, "qd", self.k, **arguments)

    def outputs(self, qd: BlockRows) -> ControllerOutputs:
        """Return the written rows, with the rows of a command."""
        error, A = self.unweighted
        step = self._measure_step()
        result = self.program.result
        busy = self.rows() if step is None else result(control_law.compare_step, "busy", share=step)
        limited = self.constrained
        outputs = ControllerOutputs(
            *(self.feature_rows.s, error, qd, A, busy),
            lambda blocks: blocks.get(self.feature_rows.first_jacobian),
            self.note,
            self.weights,
            self.status,
            lambda blocks: LawInput(blocks.get(error), self.state(blocks, 0, {}, self.law_error)),
            factors=self.feature_rows.factors,
            step=step,
            gain=self.gain,
        )
        if limited is None:
            return outputs
        rows = limited.active, limited.slack, limited.of.past
        return replace(outputs, active=rows[0], slack=rows[1], past=rows[2])

    def _measure_step(self) -> BlockRows | None:
        """Return the row of the remaining step of a camera over the largest that converges.

        It is the step of Gauss and Newton, without damping: a damped step may be short far from the
        goal. None if no feature has a largest step.
        """
        c, features = self.controller, self.feature_rows
        parts = [each for each in c.bound_features.parts if each.largest_step is not None]
        if not parts:
            return None
        error, A = self.unweighted
        remaining = add_solve(self.program, A, error, 0.0, c.rcond, features.first_jacobian)
        return add_maximum(
            self.program,
            [
                self.program.result(
                    control_law.measure_camera_step,
                    "share",
                    J=features.J[each.sights[0].key],
                    qd=remaining,
                    largest=self.constant(each.largest_step),
                )
                for each in parts
            ],
        )

    def note(self, qd: BlockRows) -> None:
        """Add the stages that store the final command."""
        c, features, k, add = self.controller, self.feature_rows, self.k, self.add
        if self.constrained:
            self.constrained.note(qd)
        known_motion = isinstance(c.feed_forward, KnownMotion)
        if c.bound_features.depths.filtered:
            for key, J in features.J.items():
                twist = self.program.result(control_law.multiply_vector, "out", 6, A=J, x=qd)
                drift_twist = features.twist[key] if known_motion else self.constant(np.zeros(6))
                add(control_law.add_vectors, x=twist, y=drift_twist, out=features.last_twist[key])
        if isinstance(c.feed_forward, EstimatedMotion):
            add(control_law.multiply_vector, A=self.A, x=qd, out=self._predicted_change)
        if c.broyden is not None:
            add(control_law.copy_rows, rows=self.unweighted[1].flat, to=self.broyden_jacobian.flat)
            add(control_law.copy_rows, rows=qd, to=self.last[k:])
            drift = self._drift if known_motion else features.s
            factor = self.inputs.dt if known_motion else self.constant(0.0)
            arguments = {"x": features.s, "factor": factor, "y": drift}
            add(control_law.add_scaled_vector, **arguments, divide=False, out=self.last[:k])

    def _add_broyden(self) -> None:
        """Replace L J by its estimate with Broyden's rule, which starts from the modelled L J."""
        rule, k, n = self.controller.broyden, self.k, self.n
        assert rule is not None
        self.add(
            broyden_update.learn_jacobian,
            dt=self.inputs.dt,
            s=self.feature_rows.s,
            predicted=self.last[:k],
            qd=self.last[k:],
            start=self.A if rule.start is None else self.constant(rule.start),
            estimate=self.broyden_jacobian,
            scratch=self.rows(k * n + k + n),
        )
        self.A = self.broyden_jacobian

    def _add_weights(self) -> BlockRows:
        """Return the rows of the weights (k,), from the marks and then from the error."""
        c, each = self.controller, find_mark_dependencies(self.controller.bound_features)
        weights = add_component_weights(self.program, self.feature_rows.weights, each)
        user_weightings = [one for one in c.weighting if not isinstance(one, MarkWeighting)]
        if not user_weightings:
            return weights
        error = mask_entries(self.program, self.error, self._flag_unused(weights))
        return add_user_weights(
            self.program, user_weightings, error, weights, c.tolerances, group_components(each)
        )

    def _flag_unused(self, weights: BlockRows) -> BlockRows:
        """Return the rows (k,) that are 1 for components of weight 0."""
        return self.program.result(mark_weights.flag_unused_numbers, "out", self.k, weights=weights)

    def _add_status(self, weights: BlockRows) -> BlockRows:
        """Return the row of the status, set if the rank or the number of marks is too small."""
        c, k, n, program = self.controller, self.k, self.n, self.program
        return program.result(
            mark_weights.detect_too_few_marks,
            "status",
            A=self.A,
            **describe_metric_columns(
                self.feature_rows.first_jacobian if c.one_motion else SAME_UNITS
            ),
            weights=weights,
            full_rank=program.number(c.full_rank),
            rcond=self.constant(c.rcond),
            marks=max(getattr(each, "least", 1) for each in c.weighting),
            zeros=self.constant(np.zeros(k + 6)),
            scratch=program.scratch(n + max(count_solution_rows(k, n), count_solution_rows(6, n))),
            images=[(self.feature_rows.weights[sight.key],) for sight in c.bound_features.sights],
        )

    def _replace_error_rows(
        self, stages: Callable[[Program, BlockRows, BlockRows], BlockRows], by: BlockRows
    ) -> None:
        """Replace error, L and L J by the result of stages, row by row."""
        rows = self.error, self.L, self.A
        self.error, self.L, self.A = (stages(self.program, each, by) for each in rows)

    def _add_gain(self) -> BlockRows:
        """Return the row of the gain, which may depend on the error or on the command."""
        gain, program = self.controller.gain, self.program
        if not isinstance(gain, AdaptiveGain):
            return program.number(gain)
        numbers = self.constant([gain.at_zero, gain.at_infinity, gain.slope])
        largest = gain.of == "command"
        size = self._add_unit_gain_command() if largest else self.weighted_by_marks[0]
        arguments = {"vector": size, "numbers": numbers, "largest": largest}
        return program.result(control_law.adapt_gain, "gain", **arguments)

    def _add_unit_gain_command(self) -> BlockRows:
        """Return the rows of the command of the law at a gain of one."""
        if self.law is not None:
            self._command_at_gain = self._add_law(self.law, self.weighted_error)
            return self._command_at_gain(self.constant(1.0))
        return self.program.add_python_rows(self._call_law_at_unit_gain, self.n)

    def _call_law_at_unit_gain(self, blocks: Blocks, step: int) -> Array:
        """Return the command of a Python law at a gain of one; the law is called again later."""
        memory = deepcopy(self.inputs.memory(blocks).get("law", {}))
        state = replace(self.state(blocks, step, memory, self.weighted_error), gain=1.0)
        return self.controller.evaluate_law(state)

    def _add_drift(self) -> BlockRows:
        """Return the rows of the error plus the drift caused by the motion of the target."""
        c, k, program = self.controller, self.k, self.program
        if isinstance(c.feed_forward, EstimatedMotion):
            self._predicted_change = self.rows(k)
            drift = program.result(
                control_law.estimate_drift,
                "drifts",
                k,
                errors=self.weighted_error,
                last_errors=self.rows(k),
                predicted_change=self._predicted_change,
                lag=self.program.number(c.feed_forward.lag),
                dt=self.inputs.dt,
            )
        else:
            self._drift = self.feature_rows.drift()
            drift = scale_entries(
                program, self._drift, self.constant(c.bound_features.weights.ravel())
            )
        if self.hidden is not None:
            drift = mask_entries(program, drift, self.hidden)
        if self.weights is not None:
            drift = scale_entries(program, drift, self.weights)
        arguments = {"x": self.weighted_error, "factor": self.gain, "y": drift, "divide": True}
        return program.result(control_law.add_scaled_vector, "out", k, **arguments)

    def _add_law(self, law: CompiledLaw, error: BlockRows) -> CommandAtGain:
        """Add the stages of a law before the gain; return a function that adds the others."""
        features = self.feature_rows
        settings = self.controller.inverse, self.product
        rows = error, self.L, features.first_jacobian, self.A, features.s, self.inputs.q
        return law.stages(LawRows(self.program, self.k, self.n, *rows, *settings))

    def _call_law(self, blocks: Blocks, step: int) -> Array:
        """Return the velocities (n, B) from a law in Python, such as a user's law."""
        memory = self.inputs.memory(blocks).setdefault("law", {})
        return self.controller.evaluate_law(self.state(blocks, step, memory, self.law_error))

    def state(
        self, blocks: Blocks, step: int, memory: dict[str, Any], error: BlockRows
    ) -> ControlState:
        """Return the input of the law, with an error in rows."""
        c, get = self.controller, blocks.get
        gain: float | Array  # from the row, as kept stages may have another gain than c
        if isinstance(c.gain, float):
            gain = float(blocks.first(self.gain))
        else:
            gain = make_read_only(get(self.gain)[:, None])
        return construct_unchecked(
            ControlState,
            error_last=make_read_only(get(error)),
            interaction_last=make_read_only(get(self.L)),
            jacobian_last=make_read_only(get(self.feature_rows.first_jacobian)),
            task_jacobian_last=make_read_only(get(self.A)),
            gain=gain,
            inverse=c.inverse,
            s_last=make_read_only(get(self.feature_rows.s)),
            q_last=make_read_only(get(self.inputs.q)),
            time=step * self.inputs.seconds,
            dt=self.inputs.seconds,
            memory=memory,
            one_motion=c.one_motion,
        )
