"""Prediction of the motion of candidates in the believed scene, by the stages of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from functools import cached_property
from typing import NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.bodies.integration import assemble_velocities
from robsim.kernels.control import rollout
from robsim.kernels.images import projection
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, CompiledStages, Program, PythonStage
from robsim.kernels.machine.stages import advance_blocks
from robsim.robot.fk_stages import FKStages
from robsim.robot.integration_stages import (
    add_integration,
    add_python_integration,
    add_wheel_rolling,
)
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.controller_rows import ControllerInputs, ViewRows, add_image
from robsim.servo.frame_rows import add_prescribed_velocities
from robsim.servo.servo_controller import ServoController


class Forecast(NamedTuple):
    """Predicted motion of C candidates.

    Attributes
    ----------
    counts : ndarray of shape (C, B)
        Number of instants before the first with a mark near the border or a joint beyond a limit.
    distances : ndarray of shape (C, B)
        Root mean square distance of the marks from their goal at the end, in metres.
    """

    counts: Array
    distances: Array


class PredictionTimes(NamedTuple):
    """Instants of a prediction: fine steps until the next prediction, then coarse steps.

    Attributes
    ----------
    dt : float
        Control period and fine step, in seconds.
    between : int
        Number of fine steps in a coarse step.
    coarse : int
        Number of coarse steps in the horizon.
    """

    dt: float
    between: int
    coarse: int

    @property
    def period(self) -> float:
        """Coarse step and time between two predictions, in seconds."""
        return self.between * self.dt

    @property
    def instants(self) -> int:
        """Number of predicted instants, the present included."""
        return self.between + self.coarse


def divide_horizon(horizon: float, period: float, dt: float) -> PredictionTimes:
    """Return the instants of a prediction over a horizon with a period, in seconds, about."""
    between = max(round(period / dt), 1)
    return PredictionTimes(dt, between, max(round(horizon / (between * dt)), 1))


class Prediction:
    """Program of one predicted step of all candidates: motion, image, assessment, command.

    Each candidate has its own coordinates. Joints follow their commands at once, images are exact.
    Until the next prediction the steps are those of the control loop, so a command that is wild for
    an instant is foreseen.
    """

    def __init__(
        self,
        reference: ServoController,
        candidates: Sequence[ServoController],
        times: PredictionTimes,
        margin: float | Array,
        path: tuple[str, ...],
    ) -> None:
        self.times, self.path = times, path
        self.reference, self.program = reference, Program()
        self.pairs = reference.believed_sights
        self.scene = next(iter(self.pairs.values())).scene
        self.dt, self.margin = self.program.constant(times.dt), self.program.number(margin)
        self.low, self.high = (self.program.constant(each) for each in self.scene.limits.T)
        self.alive = self.program.constant(1.0)
        self.last: list[BlockRows] = []  # last commands that constraints use
        each = [self._add_candidate(i, one) for i, one in enumerate(candidates)]
        self.q, self.counts, self.distances = zip(*each, strict=True)

    def forecast(self, q: Array, last: Array, blocks: Blocks, step: int) -> Forecast:
        """Return the predicted motions from coordinates q (nq, B) of the runs of some blocks.

        `last` (n, B) is the last command. `step` is the number of the present instant, in
        periods of the prediction.
        """
        future = Blocks(self.program, blocks.rows)
        future.memory = deepcopy(blocks.memory)
        for rows in self.q:
            future.put(rows, q)
        for rows in self.last:
            future.put(rows, last)
        for _ in range(self.times.between):
            self._advance(future, step, step + 1)
        self._advance(future, step + 1, step + 2)
        future.fill(self.dt, np.array([self.times.period]))
        self._advance(future, step + 2, step + self.times.coarse + 1)
        counts, distances = (
            np.stack([future.get(row) for row in rows]) for rows in (self.counts, self.distances)
        )
        return Forecast(counts, distances)

    def _advance(self, future: Blocks, step: int, until: int) -> None:
        """Perform predicted steps, by compiled stages alone if possible."""
        before = future.numbers.copy() if self.program.rescues else future.numbers
        if self._compiled is not None:
            parts = self._compiled.addresses, self._compiled.at, self._compiled.numbers
            advance_blocks(*parts, 0, future.flat, int(self.alive), step, until)
            if not any(future.numbers[:, row].any() for row in self.program.rescues):
                return
            future.numbers[:] = before
        for now in range(step, until):
            for part in self._segments:
                part(future, now)

    @cached_property
    def _compiled(self) -> CompiledStages | None:
        """The compiled stages; None if a candidate has unconditional Python code."""
        stages = self.program.stages
        return None if stages is None else CompiledStages(stages)

    @cached_property
    def _segments(self) -> list[PythonStage]:
        """All stages, with consecutive compiled stages joined."""
        return self.program.segments()

    def _add_candidate(
        self, i: int, candidate: ServoController
    ) -> tuple[BlockRows, BlockRows, BlockRows]:
        """Add the stages of a candidate; return the rows of q, of its count and its distance."""
        program, scene = self.program, self.scene
        q, v = program.rows(scene.nq), program.rows(scene.nv)
        placed = FKStages(program, scene.tree.joints, q)
        self._add_motion(placed, v)
        placed.add()
        views = {key: self._add_view(placed, sight) for key, sight in self.pairs.items()}
        count, distance = self._add_assessment(q, views)
        inputs = ControllerInputs(
            program,
            self.dt,
            self.times.period,
            q,
            views,
            placed if candidate.bound_features.exact else None,
            name_path(self.path, i),
        )
        outputs = candidate.stages(inputs)
        outputs.note(outputs.qd)
        if outputs.past is not None:
            self.last.append(outputs.past[0])
        self._add_velocities(inputs, outputs.qd, v)
        return q, count, distance

    def _add_motion(self, placed: FKStages, v: BlockRows) -> None:
        """Add the stages that move the joints for a period by velocities, at first by zeros."""
        program, joints, q = self.program, self.scene.tree.joints, placed.q
        add_integration(program, joints, q, list(v), self.dt)
        add_wheel_rolling(program, joints, q, v, placed.ratio, self.dt)
        add_python_integration(program, joints, q, list(v), self.dt)

    def _add_view(self, placed: FKStages, sight: CameraTarget) -> ViewRows:
        """Add the stages of the image of a pair; return its rows."""
        program, N = self.program, len(sight.target.marks)
        return add_image(
            program, placed, sight, program.rows(N, 2), program.rows(N), program.rows()
        )

    def _add_assessment(
        self, q: BlockRows, views: dict[PairKey, ViewRows]
    ) -> tuple[BlockRows, BlockRows]:
        """Add the stages of the feasible time and the distance; return their rows."""
        program, images, targets = self.program, [], []
        for key, view in views.items():
            sight = self.pairs[key]
            images.append((view.pixels, program.each(sight.eye.camera.rows)))
            T_w_c, T_w_o = view.frames
            T = program.result(projection.relative_pose_stage, "T", 3, 4, A=T_w_c, B=T_w_o)
            marks = program.numbers(sight.target.marks, 2)
            targets.append((T, marks, program.each(self._locate_goal(key))))
        count = program.rows()
        program.add(
            rollout.count_feasible_instants,
            q=q,
            low=self.low,
            high=self.high,
            margin=self.margin,
            started=program.rows(),
            room=program.rows(2),
            feasible=program.rows(),
            count=count,
            images=images,
        )
        distance = program.result(rollout.measure_mark_distance, "out", targets=targets)
        return count, distance

    def _locate_goal(self, key: PairKey) -> Array:
        """Return the marks (N, 3, runs) of a pair at the goal, in camera axes."""
        goal = self.reference.bound_features.goals[key]
        points, depth = goal.points_last, goal.depth_last
        return np.stack([points[:, 0] * depth, points[:, 1] * depth, depth], axis=1)

    def _add_velocities(self, inputs: ControllerInputs, qd: BlockRows, v: BlockRows) -> None:
        """Add the stage of all velocities, commanded or prescribed."""
        every = np.arange(self.scene.nv)
        drift = add_prescribed_velocities(inputs, self.scene, every)
        rows = dict(zip(self.reference.columns.tolist(), qd, strict=True))
        commands = [rows.get(column) for column in every.tolist()]
        self.program.add(assemble_velocities, v=v, prescribed=drift, commands=commands)


def name_path(path: tuple[str, ...], i: int) -> tuple[str, ...]:
    """Return the path of the memory of a candidate, from the path of its task."""
    return (*path, f"candidate {i}")
