"""What stands for the inverse of L or L J, by name: pseudo-inverse, damped inverse or transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Choice, Declared, Number, family, register
from robsim.kernels import solve as kernels

RCOND = 1e-6


INVERSES = family("inverse")
SHARE = Number(above=0, below=1)


@register("inverse", "pseudo_inverse")
@dataclass(frozen=True)
class PseudoInverse(Declared):
    """A^+ with singular values below rcond times the largest taken as zero.

    >>> PseudoInverse()
    PseudoInverse(rcond=1e-06)
    """

    rcond: Annotated[float, SHARE, "Share of the largest below which one counts as zero."] = RCOND

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """(transposed, damping, rcond) for the kernels."""
        return False, 0.0, self.rcond


@register("inverse", "damped")
@dataclass(frozen=True)
class DampedInverse(Declared):
    """(A'A + damping^2 I)^-1 A': shorter commands near a singularity, and never exact.

    >>> DampedInverse().damping
    0.01
    """

    damping: Annotated[float, Number(above=0), "In the unit of the singular values of A."] = 0.01

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """(transposed, damping, rcond) for the kernels."""
        return False, self.damping, 0.0


@register("inverse", "transpose")
@dataclass(frozen=True)
class JacobianTranspose:
    """A': gradient descent of ||e||^2/2; slow along the weak directions of A, and never singular.

    Stable while gain * dt * sigma^2 < 2 for the largest singular value sigma of L J (Hutchinson,
    Hager and Corke 1996, section on image-based control).

    >>> JacobianTranspose()
    JacobianTranspose()
    """

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """(transposed, damping, rcond) for the kernels; J is inverted as by `PseudoInverse`."""
        return True, 0.0, RCOND


Inverse = PseudoInverse | DampedInverse | JacobianTranspose
INVERSE = Choice(
    INVERSES,
    default="pseudo_inverse",
    beside_of={"rcond": ("pseudo_inverse", "rcond"), "damping": ("damped", "damping")},
)


def rank(A: Array, rcond: float = RCOND) -> Any:
    """Rank (B,) of A (m, n, B): how many singular values exceed rcond times the largest."""
    x, found = np.empty(A.shape[1:]), np.empty(A.shape[2], dtype=np.int64)
    kernels.least_squares(A, np.zeros((A.shape[0], A.shape[2])), 0.0, rcond, x, found)
    return found


def product(A: Array, B: Array) -> Array:
    """A (m, n, B) times B (n, p, B)."""
    out = np.empty((A.shape[0], B.shape[1], A.shape[2]))
    kernels.product(A, B, out)
    return out
