"""Task Jacobians L J of cameras that move as one."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from robsim.kernels.control.row_space import count_product_rows, solve_task_product
from robsim.kernels.control.task_priorities import count_null_space_rows, find_null_space
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.servo.shaping.free_motions import CameraMotions, FreeMotions, find_free_motions
from robsim.servo.shaping.row_space import RowSpace


@dataclass(eq=False)
class TaskProduct:
    """A task Jacobian A = L J, and the stages that use its factors.

    Attributes
    ----------
    program : Program
        The program of the rows.
    L, J, A : BlockRows
        Interaction matrix (k, 6), camera Jacobian (6, n), and their product (k, n).
    rank, bound : BlockRows, optional
        Rank of A and a bound of its condition number, once `solve` has added its stage.
    """

    program: Program
    L: BlockRows
    J: BlockRows
    A: BlockRows
    rank: BlockRows | None = field(default=None, init=False)
    bound: BlockRows | None = field(default=None, init=False)

    @cached_property
    def row_space(self) -> RowSpace:
        """The row space of J. The first use adds its stage."""
        return RowSpace.of(self.program, self.J)

    def solve(self, y: BlockRows, rcond: float) -> BlockRows:
        """Add the stages of A^+ y, for more than six features and joints; return the rows (n,)."""
        (k, n), space, program = self.A.shape, self.row_space, self.program
        self.rank, self.bound = program.rows(), program.rows()
        return program.result(
            solve_task_product,
            "x",
            n,
            L=self.L,
            J=self.J,
            A=self.A,
            y=y,
            V=space.V,
            betas=space.betas,
            R=space.R,
            rcond=program.constant(rcond),
            rank=self.rank,
            bound=self.bound,
            scratch=program.scratch(count_product_rows(k, n)),
        )

    def find_free_motions(self, rcond: float) -> FreeMotions:
        """Return the motions that the task leaves free."""
        if self.J.shape[1] <= 6:
            return find_free_motions(self.program, self.A, rcond)
        space = self.row_space
        if self.bound is not None:
            return CameraMotions(space, lambda: self._find_projector(rcond))
        inner = find_free_motions(self.program, space.restrict(self.L), rcond)
        return CameraMotions(space, inner.add_projector)

    def _find_projector(self, rcond: float) -> BlockRows:
        """Add the stage of the projector (6, 6) in the row space, after the stage of `solve`."""
        k, program = self.A.shape[0], self.program
        return program.result(
            find_null_space,
            "P",
            6,
            6,
            L=self.L,
            R=self.row_space.R,
            bound=self.bound,
            rcond=program.constant(rcond),
            scratch=program.scratch(count_null_space_rows(k)),
        )
