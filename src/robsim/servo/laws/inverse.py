"""Inverses of L or L J: the pseudo-inverse, the damped inverse and the transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare import DeclaredValue, KindOf, Number, family, register
from robsim.kernels.control import control_law
from robsim.kernels.linear_algebra.pseudoinverse import count_solution_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages

RCOND = 1e-6


INVERSES = family("inverse")
RCOND_SPEC = Number(above=0, below=1)


@register("inverse", "pseudo_inverse")
@dataclass(frozen=True)
class PseudoInverse(DeclaredValue):
    """Pseudo-inverse A^+, the exact least-squares solution of minimal norm.

    Singular values below rcond times the largest count as zero: the law then commands no motion in
    their direction. Near a singularity, but above this bound, commands grow without limit; use
    `DampedInverse` or a `SpeedLimit` there.

    Examples
    --------
    >>> import robsim as rs
    >>> L = np.diag([2.0, 1e-8]) @ np.eye(2, 6)
    >>> state = rs.laws.ControlState.of([1.0, 1.0], L, np.eye(6), inverse=PseudoInverse())
    >>> rs.laws.JointLaw().command(state)[0, :2] + 0.0  # no motion along the weak direction
    array([-0.5,  0. ])
    """

    rcond: Annotated[
        float, RCOND_SPEC, "Relative size below which a singular value counts as zero."
    ] = RCOND

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """Settings (transposed, damping, rcond) for the kernels."""
        return False, 0.0, self.rcond


@register("inverse", "damped")
@dataclass(frozen=True)
class DampedInverse(DeclaredValue):
    """Damped inverse (A'A + damping^2 I)^-1 A', with bounded commands near a singularity.

    A direction with singular value sigma has the factor sigma/(sigma^2 + damping^2) instead of
    1/sigma: strong directions (sigma above damping) are nearly exact, weak directions become slow
    instead of fast. The error still converges, only slower along weak directions. A larger
    `damping` means smaller commands and more deviation from the intended decay.

    Examples
    --------
    >>> import robsim as rs
    >>> L = np.diag([1.0, 0.01]) @ np.eye(2, 6)
    >>> for inverse in rs.laws.PseudoInverse(), rs.laws.DampedInverse(damping=0.01):
    ...     state = rs.laws.ControlState.of([1.0, 1.0], L, np.eye(6), inverse=inverse)
    ...     print(rs.laws.JointLaw().command(state)[0, :2].round(2))
    [  -1. -100.]
    [ -1. -50.]
    """

    damping: Annotated[float, Number(above=0), "Damping, in the unit of the singular values."] = (
        0.01
    )

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """Settings (transposed, damping, rcond) for the kernels."""
        return False, self.damping, 0.0


@register("inverse", "transpose")
@dataclass(frozen=True)
class JacobianTranspose:
    """Transpose A' in place of an inverse: gradient descent of ||e||^2/2.

    The loop is stable while gain dt sigma^2 < 2 for the largest singular value sigma of L J
    (Hutchinson, Hager and Corke 1996, section on image-based control). The transpose has no
    singularity and costs least, but the error decays as exp(-gain sigma^2 t) in each direction,
    which is slow along the weak directions. It cannot be combined with `feed_forward`.

    Raises
    ------
    InputError
        If the task has `feed_forward`; by `simulate`, if L J is zero or not finite at the goal.

    Examples
    --------
    >>> import robsim as rs
    >>> L = np.diag([2.0, 0.1]) @ np.eye(2, 6)
    >>> inverse = rs.laws.JacobianTranspose()
    >>> state = rs.laws.ControlState.of([1.0, 1.0], L, np.eye(6), inverse=inverse)
    >>> rs.laws.JointLaw().command(state)[0, :2]
    array([-2. , -0.1])
    """

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """Settings (transposed, damping, rcond); J is inverted as by `PseudoInverse`."""
        return True, 0.0, RCOND


InverseKind = PseudoInverse | DampedInverse | JacobianTranspose
Inverse = InverseKind | str  # an inverse, or its name
INVERSE = KindOf(
    INVERSES,
    default="pseudo_inverse",
    beside_of={"rcond": ("pseudo_inverse", "rcond"), "damping": ("damped", "damping")},
)


# numbers of leading columns of a matrix that are per metre
SAME_UNITS = 0
LATERAL_TWIST = 2
CAMERA_TWIST = 3


def describe_metric_columns(J: BlockRows | int) -> dict[str, Any]:
    """Return the arguments of stages for columns per metre: a Jacobian (6, n), or a count."""
    return (
        {"J": J, "translations": 0} if isinstance(J, BlockRows) else {"J": None, "translations": J}
    )


def add_solve(
    program: Program,
    A: BlockRows,
    y: BlockRows,
    damping: float,
    rcond: float,
    J: BlockRows | int = SAME_UNITS,
) -> BlockRows:
    """Add the stage of x = A^+ y, damped unless damping is 0; return its rows (n,).

    Singular values are compared in a unit of length that gives all columns of A equal weight. J
    determines the columns of A that are per metre: the rows of a Jacobian (6, n), or a number of
    leading columns such as `CAMERA_TWIST`. The row after x is the rank, see `rank_row`.
    """
    m, n = A.shape
    solution = program.rows(n + 1)
    program.add(
        control_law.solve_task,
        A=A,
        y=y,
        damping=program.constant(damping) if damping > 0.0 else None,
        rcond=program.constant(rcond),
        x=solution[:n],
        rank=solution[n],
        **describe_metric_columns(J),
        scratch=program.scratch(count_solution_rows(m, n)),
    )
    return solution[:n]


def rank_row(x: BlockRows) -> BlockRows:
    """Return the row of the rank that `add_solve` computed with x."""
    return BlockRows(x + x.size)


def add_inverse(
    program: Program,
    A: BlockRows,
    y: BlockRows,
    inverse: InverseKind,
    J: BlockRows | int = SAME_UNITS,
) -> BlockRows:
    """Add the stage of x = A^+ y by a choice of inverse, or of A' y; return its rows."""
    transposed, damping, rcond = inverse.numbers
    if not transposed:
        return add_solve(program, A, y, damping, rcond, J)
    return program.result(control_law.multiply_transpose, "x", A.shape[1], A=A, y=y)


def compute_rank(
    A: Array, moves: Array | int = SAME_UNITS, rcond: float = RCOND
) -> NDArray[np.int64]:
    """Return the rank (B,) of A (m, n, B) with columns of `moves` (6, n, B), as in `add_solve`.

    The rank is the number of singular values above rcond times the largest.
    """
    m, _, runs = A.shape
    jacobians = [moves] if isinstance(moves, np.ndarray) else []

    def add(program: Program, A: BlockRows, y: BlockRows, *J: BlockRows) -> list[BlockRows]:
        columns = J[0] if J else int(moves)
        return [rank_row(add_solve(program, A, y, 0.0, rcond, columns))]

    (result,) = evaluate_stages(add, [A, np.zeros((m, runs)), *jacobians])
    return result.astype(np.int64)


def multiply_batches(A: Array, B: Array) -> Array:
    """Return the product (m, p, B) of A (m, n, B) and B (n, p, B)."""
    with np.errstate(all="ignore"):  # a run may contain NaN
        out: Array = A[:, 0, None] * B[0]
        for k in range(1, len(B)):
            out += A[:, k, None] * B[k]
    return out
