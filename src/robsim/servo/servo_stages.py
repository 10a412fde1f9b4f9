"""The stages of the controller of one servo task, from the image to the command."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.features.rows import FeatureRows, Seen
from robsim.kernels import commanding, viewing
from robsim.kernels.program import Program
from robsim.kernels.solve import scratch_of
from robsim.kernels.stage import Stage
from robsim.robot.placed import Placed
from robsim.servo.basis import Basis
from robsim.servo.command import Command
from robsim.servo.controller import Decision
from robsim.servo.feature_state import FeatureState
from robsim.servo.given import Commanded, Given, camera_rows
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.law import CameraLaw, ControlState
from robsim.servo.regulated import Regulated
from robsim.servo.sight import Key, Sight

if TYPE_CHECKING:
    from robsim.servo.servo_controller import Servo


class RegulatedRows:
    """The rows of what a task regulates: s, L, J of each camera, and L J."""

    def __init__(self, regulated: Regulated, given: Given) -> None:
        self.regulated, self.given, self.program = regulated, given, given.program
        self.placed, self.frames = self._world()
        self.seen = {sight.key: self._seen(sight) for sight in regulated.sights}
        self.J = {sight.key: self._jacobian(sight) for sight in regulated.sights}
        self.first = self.J[regulated.sights[0].key]
        each = self._features()
        self.s = _joined(self.program, [rows.s for rows in each], [rows.k for rows in each])
        self._interactions(each)

    def _world(self) -> tuple[Placed, dict[Key, tuple[int, int]]]:
        """Return the bodies, and the poses of cameras and targets, where they are believed."""
        given, sights = self.given, self.regulated.sights
        if given.placed is not None and self.regulated.exact:
            views = {key: (view.T_w_c, view.T_w_o) for key, view in given.views.items()}
            return given.placed, views
        scene = sights[0].scene
        placed = Placed(self.program, scene.tree.joints, given.q, scene.nq)
        if scene.tree.own:
            self.program.call(lambda blocks, step: placed.prepare(scene.tree.own, blocks))
        placed.add()
        frames = {}
        for sight in sights:
            eye = sight.constants
            pair = placed.frames([(eye.body, eye.hand_eye), (eye.target, eye.offset)])
            frames[sight.key] = pair[0], pair[1]
        return placed, frames

    def _seen(self, sight: Sight) -> Seen:
        """Return the rows of what the controller knows of the marks of a target."""
        program, view, N = self.program, self.given.views[sight.key], len(sight.target.marks)
        camera, points, T_c_o = (
            program.constant(camera_rows(sight)), program.rows(2 * N), program.rows(12)
        )  # fmt: skip
        program.add(viewing.relative, *self.frames[sight.key], T_c_o)
        bends = bool(sight.eye.camera.lens.any())
        program.add(viewing.normalise, camera, N, view.pixels, points, bends)
        depth = self._depth(sight, view.depth)
        model = program.constant(sight.target.marks)
        return Seen(program, N, view.pixels, points, depth, camera, model, T_c_o)

    def _depth(self, sight: Sight, true: int) -> int:
        """Return the rows of the depths that go into L."""
        depths, N = self.regulated.depths, len(sight.target.marks)
        if depths.which != "true":
            return self.program.constant(depths.at_goal(self.regulated.goals[sight.key].depth_last))
        scale, found = self.program.constant(depths.numbers(N)[2]), self.program.rows(N)
        self.program.add(commanding.weigh, true, N, 1, scale, found)
        return found

    def _jacobian(self, sight: Sight) -> int:
        """Return the rows of J (6, n) of a camera against its target."""
        moves, program = sight.moves(self.regulated.columns), self.program
        J = program.rows(6 * moves.columns.size)
        table = np.column_stack([moves.rows, moves.sign]).astype(np.int64)
        where = self.placed.poses, self.placed.ratio, self.frames[sight.key][0]
        program.add(commanding.jacobian, *where, J, moves.columns.size, len(table), *table.ravel())
        return J

    def _features(self) -> list[FeatureRows]:
        """Return the rows of each feature block."""
        found = []
        for part in self.regulated.parts:
            found.append(part.stages(self._shown(part.sights)))
        return found

    def _shown(self, sights: tuple[Sight, ...]) -> Seen:
        """Return the rows that a feature is shown: what a camera sees, or a pair of them."""
        seen, *others = (self.seen[sight.key] for sight in sights)
        if not others:
            return seen
        between = self.program.rows(12)
        poses = (self.frames[sight.key][0] for sight in sights)
        self.program.add(viewing.relative, *poses, between)
        return replace(seen, other=others[0], between=between)

    def _interactions(self, each: list[FeatureRows]) -> None:
        """Add the stages of L, the one that the law is given, and of L J."""
        regulated, program = self.regulated, self.program
        k, n = regulated.k, regulated.columns.size
        which = regulated.which
        self.A = program.rows(k * n)
        if isinstance(which, np.ndarray):
            self.L, self.each = program.constant(which), []
        else:
            self.each = [self._chosen(i, rows) for i, rows in enumerate(each)]
            firsts = [self._to_first(i, rows) for i, rows in enumerate(self.each)]
            self.L = _joined(program, firsts, [6 * rows.k for rows in self.each])
        if regulated.as_one:
            program.add(commanding.product, self.L, k, self.first, n, self.A)
            return
        row = 0
        for rows, part in zip(self.each, regulated.parts, strict=True):
            J = self.J[part.sights[0].key]
            program.add(commanding.product, rows.L, rows.k, J, n, self.A + n * row)
            row += rows.k

    def _chosen(self, i: int, rows: FeatureRows) -> FeatureRows:
        """Return the rows with L now, at the goal, or the mean of both."""
        which, program = self.regulated.which, self.program
        if which == "current":
            return rows
        goal = program.constant(self.regulated.L_goals[i])
        if which == "desired":
            return rows._replace(L=goal)
        program.add(commanding.mean, 6 * rows.k, rows.L, goal)
        return rows

    def _to_first(self, i: int, rows: FeatureRows) -> int:
        """Return the rows of L for the twist of the first camera."""
        A = self.regulated.adjoints[i]
        if A is None:
            return rows.L
        L = self.program.rows(6 * rows.k)
        self.program.add(commanding.to_first, rows.L, rows.k, self.program.constant(A), L)
        return L


def _joined(program: Program, firsts: list[int], sizes: list[int]) -> int:
    """Return the first of rows that follow one another, copied if there are several parts."""
    if len(firsts) == 1:
        return firsts[0]
    found = at = program.rows(sum(sizes))
    for first, size in zip(firsts, sizes, strict=True):
        program.add(commanding.copied, size, first, at)
        at += size
    return found


class ServoStages:
    """The stages of a `Servo`, and the rows that they write."""

    def __init__(self, controller: Servo, given: Given) -> None:
        self.controller, self.given, self.program = controller, given, given.program
        self.of = of = RegulatedRows(controller.regulated, given)
        k, self.n = controller.k, controller.columns.size
        self.error = self._rows(k)
        self._add(commanding.difference, k, of.s, self._constant(controller.s_goal), self.error)
        self.weighted, self.L, self.A = self.error, of.L, of.A
        if (controller.regulated.weights != 1.0).any():
            self._weigh(k)
        self.unit, self.gain = self._rows(self.n), self._rows(1)
        self.qd = self._rows(self.n)
        if isinstance(controller.law, CameraLaw):
            self._camera_law(controller.law.length)
        else:
            self._joint_law()
        self._scale()

    def commanded(self) -> Commanded:
        """Return the rows that are written."""
        return Commanded(self.of.s, self.error, self.qd, self.of.A, self._rows(1), self.decision)

    def _weigh(self, k: int) -> None:
        weights = self._constant(self.controller.regulated.weights)
        for name, width in (("weighted", 1), ("L", 6), ("A", self.n)):
            found = self._rows(k * width)
            self._add(commanding.weigh, getattr(self, name), k, width, weights, found)
            setattr(self, name, found)

    def _joint_law(self) -> None:
        """Add the stages of the velocities (L J)^+ e at a gain of minus one."""
        k, n, inverse = self.controller.k, self.n, self.controller.inverse.numbers
        if self.controller.one_motion and min(k, n) > 6 and not (inverse[0] or inverse[1]):
            room = max(scratch_of(k, n), max(scratch_of(k, 6), scratch_of(6, n)) + 6)
            rows = self._constant(inverse[2]), self.unit, self._rows(1), self._rows(room)
            J = self.of.first
            self._add(commanding.solve_product, self.L, k, J, n, self.A, self.weighted, *rows)
        else:
            self._invert(self.A, k, n, self.weighted, self.unit)

    def _camera_law(self, length: float) -> None:
        """Add the stages of the twist L^+ e, and of the velocities J^+ V."""
        k, n, unit = self.controller.k, self.n, self._constant(length)
        _, damping, rcond = self.controller.inverse.numbers
        L, V, J = self._rows(6 * k), self._rows(6), self._rows(6 * n)
        self._add(commanding.in_units, self.L, k, 6, unit, 1, L)
        self._invert(L, k, 6, self.weighted, V)
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
        damped = self._constant(damping) if damping > 0.0 else -1
        rows = damped, self._constant(rcond), x, self._rows(1), self._rows(scratch_of(k, n))
        self._add(commanding.solve, A, k, n, y, *rows)

    def _scale(self) -> None:
        """Add the stages of the gain, and of the velocities that it gives."""
        gain = self.controller.gain
        if isinstance(gain, AdaptiveGain):
            numbers = self._constant([gain.at_zero, gain.at_infinity, gain.slope])
            of = (self.n, self.unit) if gain.of == "command" else (self.controller.k, self.error)
            self._add(commanding.adapt, *of, numbers, gain.of == "command", self.gain)
        else:
            self.gain = self._constant(gain)
        self._add(commanding.commanded, self.n, self.gain, self.unit, self.qd)

    def decision(self, blocks: Any) -> Decision:
        """Return the decision of a step, with all that it is based on."""
        c, get, k, n = self.controller, blocks.get, self.controller.k, self.n
        q = get(self.given.q, c.scene.nq)
        believed = c.regulated.sights
        J, A = get(self.of.first, 6, n), get(self.of.A, k, n)
        features = FeatureState(
            get(self.of.s, k),
            get(self.of.L, k, 6),
            J,
            A,
            {key: get(row, 6, n) for key, row in self.of.J.items()},
            {sight.key: sight.project(q) for sight in believed},
            [get(rows.L, rows.k, 6) for rows in self.of.each],
        )
        error, gain = get(self.error, k), get(self.gain, 1)
        given = get(self.weighted, k), get(self.L, k, 6), J, get(self.A, k, n)
        constant = isinstance(c.gain, float)
        state = ControlState(
            *given, c.gain if constant else gain[0][:, None], c.inverse, features.s, q,
            one_motion=c.one_motion,
        )  # fmt: skip
        command = Command(features.s, error, get(self.qd, n), A)
        return c.scaled(Decision(command, J, Basis(features, error, state)))

    def _rows(self, count: int) -> int:
        return self.program.rows(count)

    def _constant(self, values: Any) -> int:
        return self.program.constant(values)

    def _add(self, stage: Stage, *numbers: int) -> None:
        self.program.add(stage, *numbers)
