"""The light of a scene in pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import ListOf, Number, Role, check_fields, described

SHORTEST, LONGEST = 1e-9, 1e9  # of the direction


@described
@dataclass(frozen=True)
class Light:
    """Parallel light from one direction, and light from everywhere.

    A surface with the unit normal n has the grey value

        255 albedo (ambient + (1 - ambient) max(0, -n . direction))

    (Lambert's law). Surfaces cast no shadows and do not reflect each other.

    Raises
    ------
    InputError
        If the direction is zero or huge, or `ambient` is not between 0 and 1.

    Examples
    --------
    >>> Light(direction=(0, 0, -2)).unit_direction
    array([ 0.,  0., -1.])
    """

    direction: Annotated[
        tuple[float, float, float],
        ListOf(Number(), 3, 3),
        Role.FIGURE,
        "Direction in which the light travels, in the world.",
    ] = (0.3, 0.4, -0.87)
    ambient: Annotated[
        float,
        Number(least=0, most=1),
        Role.FIGURE,
        "Share of the light that comes from everywhere.",
    ] = 0.4

    def __post_init__(self) -> None:
        check_fields(self)
        largest = max(map(abs, self.direction))
        if not SHORTEST <= largest <= LONGEST:
            raise InputError(
                f"direction of a light: expected a vector with a length from {SHORTEST:g} to "
                f"{LONGEST:g}, got {self.direction}"
            )

    @property
    def unit_direction(self) -> Array:
        """The direction as a unit vector (3,)."""
        direction = np.array(self.direction)
        return np.asarray(direction / np.linalg.norm(direction))
