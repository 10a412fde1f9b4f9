"""The row space of a camera Jacobian, for tasks of one camera on a redundant arm."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.kernels.control import row_space as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program


@dataclass(frozen=True, eq=False)
class RowSpace:
    """Rows of the factors of J' = H [R; 0], and stages that use them.

    Attributes
    ----------
    program : Program
        The program whose stages compute the factors.
    J, V, betas, R : BlockRows
        Camera Jacobian (6, n), and its factors, see `robsim.kernels.control.row_space`.
    """

    program: Program
    J: BlockRows
    V: BlockRows
    betas: BlockRows
    R: BlockRows

    @classmethod
    def of(cls, program: Program, J: BlockRows) -> RowSpace:
        """Add the stage that factorises a camera Jacobian (6, n)."""
        V, betas, R = program.rows(*J.shape), program.rows(6), program.rows(6, 6)
        program.add(kernels.factorise_jacobian, J=J, V=V, betas=betas, R=R)
        return cls(program, J, V, betas, R)

    def restrict(self, L: BlockRows) -> BlockRows:
        """Add the stage of the task matrix (k, 6) of L J for the coordinates of this space."""
        k = L.shape[0]
        return self.program.result(kernels.restrict_task, "out", k, 6, L=L, R=self.R)

    def expand(self, x: BlockRows) -> BlockRows:
        """Add the stage of the velocities (n,) with coordinates x (6,)."""
        arguments = {"x": x, "V": self.V, "betas": self.betas}
        return self.program.result(kernels.expand_motion, "qd", self.J.shape[1], **arguments)

    def expand_projector(self, P: BlockRows) -> BlockRows:
        """Add the stage of the projector (n, n) of a projector P (6, 6) of this space."""
        n, room = self.J.shape[1], self.program.scratch(6)
        arguments = {"P": P, "V": self.V, "betas": self.betas, "scratch": room}
        return self.program.result(kernels.expand_projector, "out", n, n, **arguments)

    def add_motion(self, P: BlockRows, motion: BlockRows, qd: BlockRows) -> BlockRows:
        """Add the stage of qd plus a motion (n,), projected by P (6, 6)."""
        arguments = {"motion": motion, "qd": qd, "P": P, "V": self.V, "betas": self.betas}
        arguments["scratch"] = self.program.scratch(6)
        return self.program.result(kernels.add_row_space_motion, "out", qd.size, **arguments)
