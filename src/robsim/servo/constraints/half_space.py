"""Constraint: the origin of a frame stays on one side of a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Length, register
from robsim.declare.array_types import Numbers
from robsim.declare.texts import FrameReference
from robsim.servo.constraints.constraint import (
    BarrierRate,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    RowConstraint,
)
from robsim.servo.constraints.frame_planes import add_planes, check_moving_frame
from robsim.world.frame_box import Corner


@register("constraint", "half_space")
@dataclass(frozen=True)
class HalfSpace(RowConstraint, DeclaredValue):
    """Constraint of a plane that the origin of a frame must not cross.

    With the unit vector n along `normal` and the origin p of the frame, in axes of the world,

        h = n p - offset >= 0.

    Raises
    ------
    InputError
        If the normal is zero; by `simulate`, if the frame does not exist, or if no commanded joint
        moves it.

    Notes
    -----
    h falls by at most the rate in the first order of the period. A frame on a turning joint moves
    on an arc, and leaves the half-space by at most |p''| dt^2 / 2.

    Examples
    --------
    The camera stays one metre above the floor, or returns there:

    >>> import robsim as rs
    >>> law = rs.laws.ConstrainedLaw([HalfSpace("free_camera.body", (0, 0, 1), 1.0)])
    """

    frame: Annotated[
        str, FrameReference, "Frame of the scene; its origin must not cross the plane."
    ]
    normal: Annotated[
        Corner, Numbers(shape=(3,)), "Direction from the plane to the allowed side, in the world."
    ]
    offset: Annotated[
        float, Length(), "Distance of the plane from the origin of the world, along the normal."
    ] = 0.0
    rate: BarrierRate = 4.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "normal", tuple(np.asarray(self.normal).tolist()))
        if not any(self.normal):
            raise InputError("HalfSpace: the normal must not be zero")

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the name of the row.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        list of str
            A name such as "plane for panda.flange".
        """
        check_moving_frame(type(self).__name__, place, self.frame)
        return [f"plane for {self.frame}"]

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stage of the row; return it."""
        n = np.asarray(self.normal) / np.abs(self.normal).max()  # neither underflow nor overflow
        n /= np.linalg.norm(n)
        return add_planes(of, self.frame, self.rate, np.array([[*n, self.offset]]))
