"""Minimum-jerk motions of axes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from robsim.declare import Time, check_fields, register
from robsim.trajectory.rest_to_rest import RestToRest
from robsim.trajectory.time_law import Timing


@register("trajectory", "quintic")
@dataclass(frozen=True, eq=False)
class Quintic(RestToRest):
    """A minimum-jerk motion from rest to rest in `duration` seconds.

    q = start + (10 u^3 - 15 u^4 + 6 u^5) (end - start), u = t/duration: the polynomial of least
    jerk (Craig 2005, section 7.3; Siciliano et al. 2009, section 4.2.1). Each axis is fastest
    halfway, 15/8 of its mean speed; its largest acceleration is 10/sqrt(3) way/duration^2.

    >>> move = Quintic([0.0, 1.0], [2.0, 1.0], duration=4.0)
    >>> move.at([1.0, 2.0, 9.0])
    array([[0.20703125, 1.        ],
           [1.        , 1.        ],
           [2.        , 1.        ]])
    >>> move.velocity(2.0)
    array([0.9375, 0.    ])
    """

    duration: Annotated[float, Time(above=0), "Duration of the motion."]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_fields(self)

    @cached_property
    def timing(self) -> Timing:
        """The timing of the motion, the same for all axes."""
        return Timing(np.asarray(self.duration))
