"""What stands for the inverse of L or L J, by name: pseudo-inverse, damped inverse or transpose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from robsim.base.arrays import Array, positive
from robsim.base.errors import InputError, suggest
from robsim.kernels import solve as kernels

RCOND = 1e-6


@dataclass(frozen=True)
class PseudoInverse:
    """A^+ with singular values below rcond times the largest taken as zero.

    >>> as_inverse("pseudo_inverse")
    PseudoInverse(rcond=1e-06)
    """

    rcond: float = RCOND
    name: ClassVar[str] = "pseudo_inverse"

    def __post_init__(self) -> None:
        object.__setattr__(self, "rcond", positive(self.rcond, "rcond"))
        if self.rcond >= 1:
            raise InputError(f"rcond must be below 1, got {self.rcond}")

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """(transposed, damping, rcond) for the kernels."""
        return False, 0.0, self.rcond


@dataclass(frozen=True)
class DampedInverse:
    """(A'A + damping^2 I)^-1 A': shorter commands near a singularity, and never exact.

    >>> as_inverse("damped").damping
    0.01
    """

    damping: float = 0.01
    name: ClassVar[str] = "damped"

    def __post_init__(self) -> None:
        object.__setattr__(self, "damping", positive(self.damping, "damping"))

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """(transposed, damping, rcond) for the kernels."""
        return False, self.damping, 0.0


@dataclass(frozen=True)
class JacobianTranspose:
    """A': gradient descent of ||e||^2/2; slow along the weak directions of A, and never singular.

    Stable while gain * dt * sigma^2 < 2 for the largest singular value sigma of L J (Hutchinson,
    Hager and Corke 1996, section on image-based control).

    >>> as_inverse("transpose")
    JacobianTranspose()
    """

    name: ClassVar[str] = "transpose"

    @property
    def numbers(self) -> tuple[bool, float, float]:
        """(transposed, damping, rcond) for the kernels; J is inverted as by `PseudoInverse`."""
        return True, 0.0, RCOND


Inverse = PseudoInverse | DampedInverse | JacobianTranspose
INVERSES: dict[str, type[Any]] = {
    "pseudo_inverse": PseudoInverse,
    "damped": DampedInverse,
    "transpose": JacobianTranspose,
}


def as_inverse(value: Any) -> Inverse:
    """An inverse from its name or itself."""
    if isinstance(value, Inverse):
        return value
    if not isinstance(value, str) or value not in INVERSES:
        raise InputError(f"no inverse {value!r}; {suggest(value, INVERSES, 'inverses')}")
    made: Inverse = INVERSES[value]()
    return made


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
