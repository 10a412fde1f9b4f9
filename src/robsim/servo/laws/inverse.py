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


Matrix = tuple[int, int, int]  # the first row of A (m, n), m and n
ANY, TWIST, ACROSS = -1, -4, -3  # for the kernels: how many columns are per metre, less -1


def solved(program: Program, A: Matrix, y: int, damping: float, rcond: float, J: int = ANY) -> int:
    """Add the stage of x = A^+ y, damped unless damping is 0; return its rows, then its rank's.

    Singular values are compared in the unit of length in which all columns of A count alike, where
    J says which of them are per metre: the row of a Jacobian (6, n), TWIST or ACROSS.
    """
    m, n = A[1:]
    x, damped = program.rows(n + 1), program.constant(damping) if damping > 0.0 else -1
    room = program.scratch(scratch_of(m, n))
    program.add(commanding.solve, *A, y, damped, program.constant(rcond), x, x + n, J, room)
    return x


def inverted(program: Program, A: Matrix, y: int, inverse: Inverse, J: int = ANY) -> int:
    """Add the stage of x = A^+ y by a choice of inverse, or of A' y; return its rows."""
    transposed, damping, rcond = inverse.numbers
    if not transposed:
        return solved(program, A, y, damping, rcond, J)
    x = program.rows(A[2])
    program.add(commanding.transpose, *A, y, x)
    return x


def rank(A: Array, moves: Array | int = ANY, rcond: float = RCOND) -> Any:
    """Return the rank (B,) of A (m, n, B), whose columns are of `moves` (6, n, B), as in `solved`.

    It is the number of singular values above rcond times the largest.
    """
    m, n, runs = A.shape
    given = [moves] if isinstance(moves, np.ndarray) else []

    def add(program: Program, A: int, y: int, *J: int) -> tuple[int]:
        known = J[0] if J else int(moves)
        return (solved(program, (A, m, n), y, 0.0, rcond, known) + n,)

    (found,) = evaluated(add, [A, np.zeros((m, runs)), *given], [(1,)])
    return found[0].astype(np.int64)


def product(A: Array, B: Array) -> Array:
    """Return the product (m, p, B) of A (m, n, B) and B (n, p, B)."""
    with np.errstate(all="ignore"):  # a run that went wrong is data
        out: Array = A[:, 0, None] * B[0]
        for k in range(1, len(B)):
            out += A[:, k, None] * B[k]
    return out
