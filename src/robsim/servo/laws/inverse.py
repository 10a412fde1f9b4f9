"""Inverses of L or L J: the pseudo-inverse, the damped inverse and the transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import DeclaredValue, KindOf, Number, family, register
from robsim.kernels.control import control_law
from robsim.kernels.linear_algebra.pseudoinverse import count_solution_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluated

RCOND = 1e-6


INVERSES = family("inverse")
RCOND_SPEC = Number(above=0, below=1)


@register("inverse", "pseudo_inverse")
@dataclass(frozen=True)
class PseudoInverse(DeclaredValue):
    """The pseudo-inverse A^+, with singular values below rcond times the largest taken as zero.

    >>> PseudoInverse()
    PseudoInverse(rcond=1e-06)
    """

    rcond: Annotated[
        float, RCOND_SPEC, "Share of the largest singular value below which one counts as zero."
    ] = RCOND

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """The numbers (transposed, damping, rcond) for the kernels."""
        return False, 0.0, self.rcond


@register("inverse", "damped")
@dataclass(frozen=True)
class DampedInverse(DeclaredValue):
    """The damped inverse (A'A + damping^2 I)^-1 A', with shorter commands near a singularity.

    It is never exact.

    >>> DampedInverse().damping
    0.01
    """

    damping: Annotated[
        float, Number(above=0), "Damping, in the unit of the singular values of A."
    ] = 0.01

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """The numbers (transposed, damping, rcond) for the kernels."""
        return False, self.damping, 0.0


@register("inverse", "transpose")
@dataclass(frozen=True)
class JacobianTranspose:
    """The transpose A' in place of an inverse: gradient descent of ||e||^2/2.

    It is never singular, and slow along the weak directions of A.

    Stable while gain * dt * sigma^2 < 2 for the largest singular value sigma of L J (Hutchinson,
    Hager and Corke 1996, section on image-based control).

    >>> JacobianTranspose()
    JacobianTranspose()
    """

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """The numbers (transposed, damping, rcond); J is inverted as by `PseudoInverse`."""
        return True, 0.0, RCOND


Inverse = PseudoInverse | DampedInverse | JacobianTranspose
INVERSE = KindOf(
    INVERSES,
    default="pseudo_inverse",
    beside_of={"rcond": ("pseudo_inverse", "rcond"), "damping": ("damped", "damping")},
)


SAME_UNITS, LATERAL_TWIST, CAMERA_TWIST = (
    0,
    2,
    3,
)  # how many of the columns, the first ones, are per metre


def describe_metric_columns(J: BlockRows | int) -> dict[str, Any]:
    """Return what stages take of the columns that are per metre: a Jacobian (6, n), or a number."""
    return {"J": J, "slides": 0} if isinstance(J, BlockRows) else {"J": None, "slides": J}


def add_solve(
    program: Program,
    A: BlockRows,
    y: BlockRows,
    damping: float,
    rcond: float,
    J: BlockRows | int = SAME_UNITS,
) -> BlockRows:
    """Add the stage of x = A^+ y, damped unless damping is 0; return its rows (n,), see `rank_row`.

    Singular values are compared in the unit of length in which all columns of A count alike, where
    J says which of them are per metre: the rows of a Jacobian (6, n), TWIST or ACROSS.
    """
    m, n = A.shape
    found = program.rows(n + 1)
    program.add(
        control_law.solve_task,
        A=A,
        y=y,
        damping=program.constant(damping) if damping > 0.0 else None,
        rcond=program.constant(rcond),
        x=found[:n],
        rank=found[n],
        **describe_metric_columns(J),
        scratch=program.scratch(count_solution_rows(m, n)),
    )
    return found[:n]


def rank_row(x: BlockRows) -> BlockRows:
    """Return the row of the rank with which `add_solve` found x."""
    return BlockRows(x + x.size)


def add_inverse(
    program: Program, A: BlockRows, y: BlockRows, inverse: Inverse, J: BlockRows | int = SAME_UNITS
) -> BlockRows:
    """Add the stage of x = A^+ y by a choice of inverse, or of A' y; return its rows."""
    transposed, damping, rcond = inverse.numbers
    if not transposed:
        return add_solve(program, A, y, damping, rcond, J)
    return program.result(control_law.multiply_transpose, "x", A.shape[1], A=A, y=y)


def compute_rank(A: Array, moves: Array | int = SAME_UNITS, rcond: float = RCOND) -> Any:
    """Return the rank (B,) of A (m, n, B), whose columns are of `moves` (6, n, B), as in `add_solve`.

    It is the number of singular values above rcond times the largest.
    """
    m, _, runs = A.shape
    given = [moves] if isinstance(moves, np.ndarray) else []

    def add(program: Program, A: BlockRows, y: BlockRows, *J: BlockRows) -> list[BlockRows]:
        known = J[0] if J else int(moves)
        return [rank_row(add_solve(program, A, y, 0.0, rcond, known))]

    (found,) = evaluated(add, [A, np.zeros((m, runs)), *given])
    return found.astype(np.int64)


def multiply_batches(A: Array, B: Array) -> Array:
    """Return the product (m, p, B) of A (m, n, B) and B (n, p, B)."""
    with np.errstate(all="ignore"):  # a run that went wrong is data
        out: Array = A[:, 0, None] * B[0]
        for k in range(1, len(B)):
            out += A[:, k, None] * B[k]
    return out
