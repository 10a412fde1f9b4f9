"""Tasks in order of priority, and the motions that they leave free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from robsim.kernels.control import free_motions as kernels
from robsim.kernels.control.task_priorities import count_priority_rows, solve_priority
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program


@dataclass(frozen=True, eq=False)
class FreeMotions:
    """Motions that tasks leave free: a basis in most runs, a projector in the others.

    Attributes
    ----------
    program : Program
        The program whose stages find the motions.
    rows : dict
        Rows N, Q, usual and P, and the number `free` of columns of N, as
        `robsim.kernels.control.free_motions.compute_projector` requires them.
    """

    program: Program
    rows: dict[str, Any]

    def add_projector(self) -> BlockRows:
        """Add the stage that computes the projector in all runs; return its rows (n, n)."""
        self.program.add(kernels.compute_projector, **self.rows)
        P: BlockRows = self.rows["P"]
        return P

    def add_motion(self, motion: BlockRows, qd: BlockRows) -> BlockRows:
        """Add the stage that adds a projected motion (n,) to a command qd; return the rows."""
        arguments = {"motion": motion, "qd": qd, **self.rows}
        return self.program.result(kernels.add_free_motion, "out", qd.size, **arguments)


def add_priorities(
    program: Program,
    levels: Sequence[tuple[BlockRows, BlockRows]],
    rcond: float,
    J: BlockRows | None = None,
) -> tuple[BlockRows, FreeMotions]:
    """Add the stages of `robsim.servo.shaping.redundancy.solve_priorities` for rows (A_i, rate_i).

    Return the rows of qd, and the free motions. J (6, n) is the Jacobian of a camera if every A_i
    is a product L_i J.
    """
    n = levels[0][0].shape[1]
    redundant = J is not None and n > 6
    free = 6 if redundant else n
    basis = {"N": program.rows(free, n), "Q": program.rows(6, n) if redundant else None}
    state = {**basis, "P": program.rows(n, n), "usual": program.rows()}
    qd, share = program.rows(n), program.constant(rcond)
    arguments = {"qd": qd, "rcond": share, "J": J if redundant else None, **state}
    for i, (A, rate) in enumerate(levels):
        k = A.shape[0]
        level = {"A": A, "rate": rate, "first": int(i == 0), "free": free}
        room = program.rows(count_priority_rows(k, n))
        program.add(solve_priority, **level, **arguments, scratch=room)
        free = max(free - k, 0)
    return qd, FreeMotions(program, {**state, "free": free})
