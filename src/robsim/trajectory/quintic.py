"""Minimum-jerk motions of axes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike

from robsim.declare import Time, check_fields, register
from robsim.trajectory.rest_to_rest import RestToRest
from robsim.trajectory.time_law import Timing


@register("trajectory", "quintic")
@dataclass(frozen=True, eq=False)
class Quintic(RestToRest):
    """Minimum-jerk motion from rest to rest in a given duration.

    The positions follow the polynomial of least jerk (Craig 2005, section 7.3; Siciliano et al.
    2009, section 4.2.1),

        q = start + (10 u^3 - 15 u^4 + 6 u^5) (end - start),  u = t / duration.

    The largest speed of an axis is 15/8 of its mean speed, halfway. The largest acceleration is
    10/sqrt(3) |end - start| / duration^2. Use it for smooth motions of known duration, and
    `Trapezoid` for fast motions within limits. Before and after the motion the axes rest at `start`
    and `end`. Leading axes (...) of `start` and `end` describe several motions at once, which are
    broadcast against the times.

    Examples
    --------
    >>> move = Quintic([0.0, 1.0], [2.0, 1.0], duration=4.0)
    >>> move.at([1.0, 2.0, 9.0])
    array([[0.20703125, 1.        ],
           [1.        , 1.        ],
           [2.        , 1.        ]])
    >>> move.velocity(2.0)
    array([0.9375, 0.    ])
    """

    duration: Annotated[float, Time(above=0), "Duration of the motion."]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, start: ArrayLike, end: ArrayLike, duration: float) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        check_fields(self)

    @cached_property
    def timing(self) -> Timing:
        """Timing of the motion, the same for all axes."""
        return Timing(np.asarray(self.duration))
