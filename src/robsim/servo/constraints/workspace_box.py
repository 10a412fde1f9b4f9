"""Constraint: the origin of a frame stays in a box of the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.declare import register
from robsim.servo.constraints.constraint import (
    BarrierRate,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    RowConstraint,
)
from robsim.servo.constraints.frame_planes import add_planes, check_moving_frame
from robsim.world.frame_box import FrameBox


@register("constraint", "workspace_box")
@dataclass(frozen=True)
class WorkspaceBox(RowConstraint, FrameBox):
    """Constraint of a box in the world that the origin of a frame must not leave.

    With the origin p of the frame, the six distances h = p - low and h = high - p are not
    negative. Outside the box the frame returns at `rate`. Compare `Fence`, which checks a command
    after the law and brakes the whole motion.

    Raises
    ------
    InputError
        Unless low is below high; by `simulate`, if the frame does not exist, or if no commanded
        joint moves it.

    Examples
    --------
    >>> import robsim as rs
    >>> box = WorkspaceBox("free_camera.body", low=(-1, -1, 0.2), high=(1, 1, 2))
    >>> law = rs.laws.ConstrainedLaw([box])
    """

    rate: BarrierRate = 4.0

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the names of the rows.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        list of str
            Names such as "lowest x of panda.flange", the lowest first.
        """
        check_moving_frame(type(self).__name__, place, self.frame)
        return [f"{end} {axis} of {self.frame}" for end in ("lowest", "highest") for axis in "xyz"]

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stage of the rows; return them, in the order of `label`."""
        axes = np.eye(3)
        low = np.column_stack([axes, self.low])
        high = np.column_stack([-axes, -np.asarray(self.high)])
        return add_planes(of, self.frame, self.rate, np.concatenate([low, high]))
