"""The partitioned law of Corke and Hutchinson, which treats the optical axis apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.declare import Declared, Quantity, described
from robsim.kernels.laws import realise
from robsim.kernels.solve import invert
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.law import ControlState, UnitOfLength

SPEED = Quantity(above=0, dimension="speed")
ALONG, ACROSS = [2, 5], [0, 1, 3, 4]  # components of the camera's twist


Roll = Annotated[float, PER_SECOND, "Gain of the rotation about the optical axis."]
Advance = Annotated[float, SPEED, "Speed along the optical axis per unit of ln(sigma*/sigma)."]


@described
@dataclass(frozen=True)
class PartitionedLaw(Declared):
    """The partitioned law: area and angle drive the optical axis, the points drive the rest.

    With s = (x1, y1, ..., angle, area): omega_z = roll (angle - angle*), since a roll turns the
    image the other way, v_z = advance ln(sigma*/sigma) with sigma the square root of the area, and
    V_xy = L_xy^+ (-gain e - L_z V_z), then qdot = J^+ V (Corke and Hutchinson 2001, "A new
    partitioned approach to image-based visual servo control"). `roll` is per second, `advance` in
    metres per second, `length` as in `CameraLaw`.

    >>> PartitionedLaw(roll=2.0).roll
    2.0
    """

    roll: Roll = 1.0
    advance: Advance = 1.0
    length: UnitOfLength = 1.0
    in_camera: ClassVar[bool] = True

    def command(self, state: ControlState) -> Array:
        """Return velocities (B, n) of the commanded joints in rad/s or m/s."""
        assert state.s_last is not None
        V = np.empty((6, state.error_last.shape[1]))
        area = state.s_last[-1]
        V[2] = 0.5 * self.advance * np.log((area - state.error_last[-1]) / area)
        V[5] = self.roll * state.error_last[-2]
        L = state.interaction_last[:-2]
        wanted = state.times_gain(-state.error_last[:-2])
        for axis in ALONG:
            wanted = wanted - L[:, axis] * V[axis]
        across = np.empty((4, V.shape[1]))
        invert(np.ascontiguousarray(L[:, ACROSS]), wanted, *state.inverse.numbers, across)
        V[ACROSS], qd = across, np.empty(state.jacobian_last.shape[1:])
        realise(state.jacobian_last, V, self.length, *state.inverse.numbers[1:], qd)
        return first_view(qd)
