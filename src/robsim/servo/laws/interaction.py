"""Which interaction matrix a task takes."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np

from robsim.base.arrays import Array, frozen, numbers
from robsim.base.errors import InputError, suggest
from robsim.servo.laws.broyden import Broyden

Interaction = Literal["current", "desired", "mean"]  # in the order of the kernels


def as_interaction(given: Any) -> Interaction | Broyden | Array:
    """An interaction matrix from its name, Broyden's rule, or one constant (k, 6)."""
    if isinstance(given, Broyden):
        return given
    kinds = get_args(Interaction)
    if isinstance(given, str):
        if given == "broyden":
            return Broyden()
        if given not in kinds:
            raise InputError(
                f"no interaction matrix {given!r}; "
                f"{suggest(given, [*kinds, 'broyden'], 'choices')}, or a constant (k, 6)"
            )
        return given  # type: ignore[return-value]
    if not np.ndim(given) or np.asarray(given).dtype.kind not in "iuf":
        raise InputError(
            f"no interaction matrix {given!r:.80}; {suggest(given, [*kinds, 'broyden'], 'choices')}"
        )
    L = numbers(given, "interaction", ("k", 6))
    if L.ndim != 2:
        raise InputError(f"interaction: expected one matrix of shape (k, 6), got {L.shape}")
    return frozen(L)
