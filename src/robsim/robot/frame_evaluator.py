"""Evaluation of the poses and Jacobians of frames, for arrays of the user."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robsim.base.arrays import Array, move_runs_first, move_runs_last
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.bodies import batch_kinematics as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.fk_stages import FKStages
from robsim.robot.tree import Tree


class FrameEvaluator:
    """Some frames of a tree, with the compiled program that evaluates their poses."""

    def __init__(self, tree: Tree, names: Sequence[str]):
        self.tree, self.names = tree, names

    def poses(self, q: Array, out: Array) -> bool:
        """Fill out (..., frames, 4, 4) with poses at q (..., nq).

        Return True if the kernel checked q and found no error, else False.
        """
        if self.tree.compiled:
            is_checked: bool = kernels.fill_frame_poses(
                *self._pose_arguments, _flatten_coordinates(q), out.reshape(-1)
            )
            return is_checked
        bodies = self.tree.bodies(move_runs_last(q, 1))
        poses = [homogeneous_matrix(self.tree.frame(bodies, name)) for name in self.names]
        out[:] = np.stack(poses, axis=1).reshape(out.shape)
        return False

    def jacobian(self, q: Array, out: Array) -> bool:
        """Fill out (..., 6, nv) with the Jacobian of the first frame; return as `poses` does."""
        if self.tree.compiled and out.size:
            flat = out.reshape(-1, 6 * self.tree.nv)
            is_checked: bool = kernels.fill_jacobians(
                *self._jacobian_arguments, _flatten_coordinates(q), flat
            )
            return is_checked
        bodies = self.tree.bodies(move_runs_last(q, 1))
        out[:] = move_runs_first(self.tree.jacobian(bodies, self.names[0]), q.shape[:-1])
        return False

    def _build_program(self) -> tuple[FKStages, list[BlockRows]]:
        """Return the bodies in a program, and the rows of the frames."""
        program = Program()
        stages = FKStages(program, self.tree.joints, program.rows(self.tree.nq))
        stages.add()
        return stages, stages.frames([self.tree.find(name) for name in self.names])

    @cached_property
    def _pose_arguments(self) -> tuple[Any, ...]:
        """Arguments of the kernel that evaluates the frames."""
        stages, frames = self._build_program()
        return *stages.program.prepared(), int(stages.q), np.array(frames, dtype=np.int64)

    @cached_property
    def _jacobian_arguments(self) -> tuple[Any, ...]:
        """Arguments of the kernel of the Jacobian, at the frame in axes of the world."""
        stages, (T, *_) = self._build_program()
        moves = self.tree.moves(self.tree.flag_moves(self.names[0]))
        J = stages.base_jacobian(T, moves)
        return *stages.program.prepared(), int(stages.q), int(J)


def _flatten_coordinates(q: Array) -> Array:
    """Return coordinates (..., nq) as one flat array."""
    return q if q.ndim == 1 else q.reshape(-1)  # the test is quicker than a needless reshape
