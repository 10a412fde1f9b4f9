"""Inverses of L or L J: the pseudo-inverse, the damped inverse and the transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Choice, Declared, Number, family, register
from robsim.kernels.control import commanding
from robsim.kernels.linear_algebra.solve import scratch_of
from robsim.kernels.machine.program import Program, evaluated
from robsim.kernels.machine.rows import Rows

RCOND = 1e-6


INVERSES = family("inverse")
SHARE = Number(above=0, below=1)


@register("inverse", "pseudo_inverse")
@dataclass(frozen=True)
class PseudoInverse(Declared):
    """The pseudo-inverse A^+, with singular values below rcond times the largest taken as zero.

    >>> PseudoInverse()
    PseudoInverse(rcond=1e-06)
    """

    rcond: Annotated[
        float, SHARE, "Share of the largest singular value below which one counts as zero."
    ] = RCOND

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """The numbers (transposed, damping, rcond) for the kernels."""
        return False, 0.0, self.rcond


@register("inverse", "damped")
@dataclass(frozen=True)
class DampedInverse(Declared):
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
INVERSE = Choice(
    INVERSES,
    default="pseudo_inverse",
    beside_of={"rcond": ("pseudo_inverse", "rcond"), "damping": ("damped", "damping")},
)


ANY, ACROSS, TWIST = 0, 2, 3  # how many of the columns, the first ones, are per metre


def metres(J: Rows | int) -> dict[str, Any]:
    """Return what stages take of the columns that are per metre: a Jacobian (6, n), or a number."""
    return {"J": J, "slides": 0} if isinstance(J, Rows) else {"J": None, "slides": J}


def solved(
    program: Program, A: Rows, y: Rows, damping: float, rcond: float, J: Rows | int = ANY
) -> Rows:
    """Add the stage of x = A^+ y, damped unless damping is 0; return its rows (n,), see `rank_of`.

    Singular values are compared in the unit of length in which all columns of A count alike, where
    J says which of them are per metre: the rows of a Jacobian (6, n), TWIST or ACROSS.
    """
    m, n = A.shape
    found = program.rows(n + 1)
    program.add(
        commanding.solve,
        A=A,
        y=y,
        damping=program.constant(damping) if damping > 0.0 else None,
        rcond=program.constant(rcond),
        x=found[:n],
        rank=found[n],
        **metres(J),
        scratch=program.scratch(scratch_of(m, n)),
    )
    return found[:n]


def rank_of(x: Rows) -> Rows:
    """Return the row of the rank with which `solved` found x."""
    return Rows(x + x.size)


def inverted(program: Program, A: Rows, y: Rows, inverse: Inverse, J: Rows | int = ANY) -> Rows:
    """Add the stage of x = A^+ y by a choice of inverse, or of A' y; return its rows."""
    transposed, damping, rcond = inverse.numbers
    if not transposed:
        return solved(program, A, y, damping, rcond, J)
    return program.result(commanding.transpose, "x", A.shape[1], A=A, y=y)


def rank(A: Array, moves: Array | int = ANY, rcond: float = RCOND) -> Any:
    """Return the rank (B,) of A (m, n, B), whose columns are of `moves` (6, n, B), as in `solved`.

    It is the number of singular values above rcond times the largest.
    """
    m, _, runs = A.shape
    given = [moves] if isinstance(moves, np.ndarray) else []

    def add(program: Program, A: Rows, y: Rows, *J: Rows) -> list[Rows]:
        known = J[0] if J else int(moves)
        return [rank_of(solved(program, A, y, 0.0, rcond, known))]

    (found,) = evaluated(add, [A, np.zeros((m, runs)), *given])
    return found.astype(np.int64)


def product(A: Array, B: Array) -> Array:
    """Return the product (m, p, B) of A (m, n, B) and B (n, p, B)."""
    with np.errstate(all="ignore"):  # a run that went wrong is data
        out: Array = A[:, 0, None] * B[0]
        for k in range(1, len(B)):
            out += A[:, k, None] * B[k]
    return out
