"""Tasks in order of priority, and the motions that they leave free."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from robsim.kernels.control import free_motions as kernels
from robsim.kernels.control.task_priorities import count_priority_rows, solve_priority
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.servo.shaping.row_space import RowSpace


class FreeMotions(Protocol):
    """Motions that tasks leave free."""

    def add_projector(self) -> BlockRows:
        """Add the stages of the projector in all runs; return its rows (n, n)."""

    def add_motion(self, motion: BlockRows, qd: BlockRows) -> BlockRows:
        """Add the stages that add a projected motion (n,) to a command qd; return the rows."""


@dataclass(frozen=True, eq=False)
class BasisMotions(FreeMotions):
    """Free motions with a basis in most runs, and a projector in the others.

    Attributes
    ----------
    program : Program
        The program whose stages find the motions.
    rows : dict
        Rows N, usual and P, and the number `free` of columns of N, as
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


@dataclass(frozen=True, eq=False)
class CameraMotions(FreeMotions):
    """Free motions of tasks of one camera, in the row space of its Jacobian.

    Attributes
    ----------
    space : RowSpace
        The row space.
    find_projector : callable
        Adds the stages of the projector in this space; returns its rows (6, 6).
    """

    space: RowSpace
    find_projector: Callable[[], BlockRows]

    def add_projector(self) -> BlockRows:
        """Add the stages of the projector; return its rows (n, n)."""
        return self.space.expand_projector(self.find_projector())

    def add_motion(self, motion: BlockRows, qd: BlockRows) -> BlockRows:
        """Add the stages that add a projected motion (n,) to a command qd; return the rows."""
        return self.space.add_motion(self.find_projector(), motion, qd)


def add_priorities(
    program: Program, levels: Sequence[tuple[BlockRows, BlockRows]], rcond: float
) -> tuple[BlockRows, BasisMotions]:
    """Add the stages of `robsim.servo.shaping.redundancy.solve_priorities` for rows (A_i, rate_i).

    Return the rows of qd, and the free motions.
    """
    free = n = levels[0][0].shape[1]
    state = {"N": program.rows(n, n), "P": program.rows(n, n), "usual": program.rows()}
    qd = program.rows(n)
    arguments = {"qd": qd, "rcond": program.constant(rcond), **state}
    for i, (A, rate) in enumerate(levels):
        k = A.shape[0]
        level = {"A": A, "rate": rate, "first": int(i == 0), "free": free}
        room = program.rows(count_priority_rows(k, n))
        program.add(solve_priority, **level, **arguments, scratch=room)
        free = max(free - k, 0)
    return qd, BasisMotions(program, {**state, "free": free})


def find_free_motions(program: Program, A: BlockRows, rcond: float) -> BasisMotions:
    """Add the stages of the motions that a task with a matrix A (k, n) leaves free."""
    return add_priorities(program, [(A, program.rows(A.shape[0]))], rcond)[1]


def add_camera_priorities(
    space: RowSpace, levels: Sequence[tuple[BlockRows, BlockRows]], rcond: float
) -> tuple[BlockRows, CameraMotions]:
    """Add the stages of tasks L_i J of one camera for rows (L_i, rate_i), as `add_priorities`."""
    restricted = [(space.restrict(L), rate) for L, rate in levels]
    x, inner = add_priorities(space.program, restricted, rcond)
    return space.expand(x), CameraMotions(space, inner.add_projector)
