"""Stages of the bound features of a task: features, interaction matrix and Jacobian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.features.feature_rows import FeatureRows, ObservationRows, concatenate_rows, select_rows
from robsim.features.images.inverse_depth import fit_inverse_depth
from robsim.features.images.taken_pictures import store_pictures
from robsim.kernels.control import control_law
from robsim.kernels.control.damped_rows import damp_normal_rows
from robsim.kernels.formulas.jacobian import BodyMoves
from robsim.kernels.images import mark_occlusion, projection
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.fk_stages import FKStages
from robsim.servo.bound_block import BoundBlock
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.constraints.constraint import MarkView
from robsim.servo.controller_rows import ControllerInputs, allocate_inputs, put_exact_images
from robsim.servo.frame_rows import add_body_poses, add_prescribed_velocities
from robsim.servo.laws.depth_filter import DepthFilter
from robsim.servo.weight_stages import add_mark_weights, scale_entries
from robsim.servo.weightings.weighting_protocol import MarkWeighting, Weighting

# places of the upper triangle in an interaction matrix [R; 0] (7, 6)
FACTOR = np.flatnonzero(np.triu(np.ones((7, 6))))


class BoundFeatureRows:
    """Rows of the bound features of a task: s, L, J of each camera, and L J.

    With weightings, `weights` are the weights of the marks of each camera-target pair.
    """

    def __init__(
        self,
        regulated: BoundFeatures,
        inputs: ControllerInputs,
        weightings: Sequence[Weighting | MarkWeighting] = (),
    ) -> None:
        self.bound_features, self.inputs, self.program = regulated, inputs, inputs.program
        self.weightings, self.weights = weightings, dict[PairKey, BlockRows]()
        # twist of each camera relative to its target, constant over the last period
        self.last_twist = {sight.key: self.program.rows(6) for sight in regulated.sights}
        self.placed, self.frames = self._add_bodies()
        self.observations = {sight.key: self._add_observation(sight) for sight in regulated.sights}
        self.J = {s.key: self.jacobian(s, regulated.moves[s.key]) for s in regulated.sights}
        self.first_jacobian = self.J[regulated.sights[0].key]
        self.block_observations = [
            self._select_observation(part.sights) for part in regulated.parts
        ]
        pairs = zip(regulated.parts, self.block_observations, strict=True)
        with_L = isinstance(regulated.which, str) and regulated.which != "desired"
        each = [part.stages(seen, with_L) for part, seen in pairs]
        self.s = concatenate_rows(self.program, [rows.s for rows in each])
        self.dampings = [rows.damping for rows in each]
        self.statuses = [rows.status for rows in each if rows.status is not None]
        factors = [
            select_rows(self.program, rows.L.flat, FACTOR)
            for rows, part in zip(each, regulated.parts, strict=True)
            if part.models_interaction
        ]
        self.factors = concatenate_rows(self.program, factors) if factors else None
        self._add_interactions(each)
        self.A = self.add_task_jacobian(self.J, regulated.columns.size)

    def jacobian(self, sight: CameraTarget, moves: BodyMoves) -> BlockRows:
        """Return the rows of J (6, n) of a camera relative to its target, by some velocities."""
        return self.placed.frame_jacobian(self.frames[sight.key][0], moves)

    def add_task_jacobian(self, J: dict[PairKey, BlockRows], n: int) -> BlockRows:
        """Return the rows of L J (k, n) with sdot = L (J_c - J_o) qdot, block by block."""
        regulated, program, k = self.bound_features, self.program, self.bound_features.k
        if regulated.has_single_motion:
            first = J[regulated.sights[0].key]
            return program.result(control_law.compute_task_jacobian, "A", k, n, L=self.L, J=first)
        each = [
            program.result(
                control_law.compute_task_jacobian,
                "A",
                rows.s.size,
                n,
                L=rows.L,
                J=J[part.sights[0].key],
            )
            for rows, part in zip(self.block_rows, regulated.parts, strict=True)
        ]
        return concatenate_rows(program, each)

    def damp(self, error: BlockRows) -> tuple[BlockRows, BlockRows, BlockRows]:
        """Return the rows of the error (k,), L (k, 6) and L J (k, n) with the damping of blocks.

        L is that of the twist of the first camera.
        """
        regulated, program, start = self.bound_features, self.program, 0
        errors, interactions, jacobians = [], [], []
        each = zip(regulated.parts, self.block_rows, self.dampings, strict=True)
        for i, (part, rows, damping) in enumerate(each):
            own, L = error[start : start + part.size], rows.L
            start += part.size
            if damping is not None:
                room = program.rows(part.size), program.rows(part.size, 6)
                arguments = {"error": own, "L": L, "damping": damping}
                program.add(damp_normal_rows, **arguments, damped_error=room[0], damped_L=room[1])
                own, L = room
            n, J = regulated.columns.size, self.J[part.sights[0].key]
            errors.append(own)
            interactions.append(self._convert_to_first(i, rows._replace(L=L)))
            jacobians.append(
                program.result(control_law.compute_task_jacobian, "A", part.size, n, L=L, J=J)
            )
        parts = errors, interactions, jacobians
        joined = [concatenate_rows(program, part) for part in parts]
        return joined[0], joined[1], joined[2]

    def drift(self) -> BlockRows:
        """Return the rows of sdot (k,) caused by the known prescribed motions."""
        columns, own = self.bound_features.own_moves
        rates = add_prescribed_velocities(self.inputs, self.bound_features.sights[0].scene, columns)
        each = {t.key: self.jacobian(t, own[t.key]) for t in self.bound_features.sights}
        result = self.program.result
        self.twist = {
            key: result(control_law.multiply_vector, "out", 6, A=J, x=rates)
            for key, J in each.items()
        }
        return self.add_task_jacobian({key: V.column for key, V in self.twist.items()}, 1).flat

    def _add_bodies(self) -> tuple[FKStages, dict[PairKey, Sequence[BlockRows]]]:
        """Return the bodies, and the believed poses of cameras and targets."""
        inputs, sights = self.inputs, self.bound_features.sights
        if inputs.placed is not None and self.bound_features.exact:
            return inputs.placed, {key: view.frames for key, view in inputs.views.items()}
        tree = sights[0].scene.tree
        placed = add_body_poses(self.program, tree, inputs.q)
        return placed, {sight.key: placed.frames(sight.frames) for sight in sights}

    def _add_observation(self, sight: CameraTarget) -> ObservationRows:
        """Return the rows of the controller's observation of the marks of a target."""
        program, view, N = self.program, self.inputs.views[sight.key], len(sight.target.marks)
        eye = sight.eye.camera
        camera = program.each(eye.rows)
        T_w_c, T_w_o = self.frames[sight.key]
        T_c_o = program.result(projection.relative_pose_stage, "T", 3, 4, A=T_w_c, B=T_w_o)
        image = {"camera": camera, "pixels": view.pixels, "lens": eye.lens_kind}
        points = program.result(projection.normalise_mark_pixels, "points", N, 2, **image)
        model = program.numbers(sight.target.marks, 2)
        depth = self._add_depths(sight, view.depth, points)
        rows = view.pixels, points, depth, camera, model, T_c_o
        if self.weightings:
            goal = self.bound_features.locate_marks(sight)
            arguments = view, points, camera, goal
            self.weights[sight.key] = add_mark_weights(self.weightings, self.inputs, *arguments)
        return ObservationRows(
            program,
            N,
            *rows,
            sure=self.bound_features.exact,
            weights=self.weights.get(sight.key),
            plane=self._add_plane(sight, model, T_c_o, depth),
            seconds=self.inputs.seconds,
        )

    def _add_plane(
        self, sight: CameraTarget, model: BlockRows, T_c_o: BlockRows, depth: BlockRows
    ) -> BlockRows | None:
        """Return the rows of the inverse depth of a target, if a feature uses its pictures."""
        bound, program = self.bound_features, self.program
        if sight.key not in bound.pictured_pairs:
            return None
        if bound.which == "desired" or not bound.depths.follows_marks:
            plane = bound.pair_observations[sight.key].plane_last
            assert plane is not None
            return program.each(plane)

        def fit(blocks: Blocks, step: int) -> Array:
            marks, T = blocks.get(model), blocks.get(T_c_o)
            X = (
                T[:, 0] * marks[:, None, 0]
                + T[:, 1] * marks[:, None, 1]
                + T[:, 2] * marks[:, None, 2]
            )
            X += T[:, 3]
            return fit_inverse_depth(X[:, :2] / X[:, 2:], blocks.get(depth))

        return program.add_python_rows(fit, 3)

    def _add_depths(self, sight: CameraTarget, true: BlockRows, points: BlockRows) -> BlockRows:
        """Return the rows of the depths in L."""
        depths, program, N = self.bound_features.depths, self.program, len(sight.target.marks)
        if not depths.follows_marks:
            return program.each(depths.at_goal(self.bound_features.goals[sight.key].depth_last))
        if isinstance(depths.which, DepthFilter):
            twist = self.last_twist[sight.key]
            true = depths.which.stages(self.inputs, points, twist, sight.eye.camera.K)
        factors = depths.factors(N)
        if (factors == 1.0).all():
            return true
        return scale_entries(program, true, program.each(factors))

    def _select_observation(self, sights: tuple[CameraTarget, ...]) -> ObservationRows:
        """Return the rows of the observation of a feature, by one camera or a pair of cameras."""
        observation, *others = (self.observations[sight.key] for sight in sights)
        if not others:
            return observation
        one, two = (self.frames[sight.key][0] for sight in sights)
        between = self.program.result(projection.relative_pose_stage, "T", 3, 4, A=one, B=two)
        return replace(observation, other=others[0], between=between)

    def _add_interactions(self, each: list[FeatureRows]) -> None:
        """Add the stages of L of each block, and of L for the twist of the first camera."""
        which, program = self.bound_features.which, self.program
        if isinstance(which, np.ndarray):  # all cameras move as one
            self.L, self.block_rows = program.constant(which), []
            return
        self.block_rows = [self._select_interaction(i, rows) for i, rows in enumerate(each)]
        firsts = [self._convert_to_first(i, rows) for i, rows in enumerate(self.block_rows)]
        self.L = concatenate_rows(program, firsts)

    def _select_interaction(self, i: int, rows: FeatureRows) -> FeatureRows:
        """Return the rows with L current, at the goal, or the mean of both."""
        which, program = self.bound_features.which, self.program
        if which == "current" or self.bound_features.parts[i].models_interaction:
            return rows
        goal = program.numbers(self.bound_features.L_goals[i], 2)
        if which == "desired":
            return rows._replace(L=goal)
        program.add(control_law.average_rows, rows=rows.L.flat, others=goal.flat)
        return rows

    def _convert_to_first(self, i: int, rows: FeatureRows) -> BlockRows:
        """Return the rows of L for the twist of the first camera."""
        A = self.bound_features.adjoints[i]
        if A is None:
            return rows.L
        arguments = {"L": rows.L, "A": self.program.numbers(A, 2)}
        return self.program.result(
            control_law.express_in_first_camera, "out", *rows.L.shape, **arguments
        )

    def views(self) -> dict[PairKey, MarkView]:
        """Return the rows of the marks of each pair with a feature of marks, for constraints."""
        return {
            sight.key: MarkView(
                sight,
                self.observations[sight.key].pixels,
                self.observations[sight.key].points,
                self.observations[sight.key].depth,
                self.J[sight.key],
                self.inputs.views[sight.key].hidden,
            )
            for sight in self.bound_features.marked_sights
        }

    def flag_hidden(self) -> BlockRows:
        """Return the rows (k,): 1 for a component that depends on a hidden mark, else 0.

        A component depends on a mark if it is NaN without the mark. All are 0 if all marks are
        hidden.
        """
        parts = zip(
            self.bound_features.parts,
            self.block_observations,
            self.bound_features.depends(),
            strict=True,
        )
        return concatenate_rows(self.program, [self._add_lost_components(*each) for each in parts])

    def _add_lost_components(
        self, part: BoundBlock, seen: ObservationRows, depends: NDArray[np.bool_] | None
    ) -> BlockRows:
        """Return the rows that are 1 for the currently lost components of a block."""
        flags = [cast(BlockRows, self.inputs.views[sight.key].hidden) for sight in part.sights]
        if depends is not None:
            each = [[flags[c][n] for c, n in np.argwhere(marks)] for marks in depends]
            return self.program.result(
                mark_occlusion.flag_lost_numbers, "lost", part.size, numbers=each
            )

        def ask(blocks: Blocks, step: int) -> Array:
            hidden = [blocks.get(flag) > 0.0 for flag in flags]
            missing = part.gone(part.observation(seen, blocks).blind(hidden))
            return (missing & ~missing.all(axis=0)).astype(float)

        return self.program.add_python_rows(ask, part.size)


def evaluate_features(regulated: BoundFeatures, q: Array) -> tuple[Array, Array, Array]:
    """Return s (k, B), L (k, 6, B) and L J (k, n, B) at q (nq, B), with perfect sensors."""
    program, sights = Program(), regulated.sights
    inputs = allocate_inputs(program, sights, len(q), 1.0)
    rows = BoundFeatureRows(regulated, inputs)
    blocks = Blocks(program, np.zeros(q.shape[1], dtype=np.int64))
    store_pictures(blocks, regulated.draw_pictures(q))
    put_exact_images(blocks, inputs, sights, q)
    for part in program.segments():
        part(blocks, 0)
    return blocks.get(rows.s), blocks.get(rows.L), blocks.get(rows.A)
