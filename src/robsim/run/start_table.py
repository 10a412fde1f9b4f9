"""The text form of a start: coordinates or a pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from robsim.declare.joint_numbers import PerJoint, get_coordinate_axes
from robsim.declare.spec import Context
from robsim.geometry.pose import Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.servo.goals.goal import describe_start, parse_start


@dataclass(frozen=True)
class StartTable:
    """The start of a run; the home configuration if the table is empty."""

    rivals: ClassVar[Any] = ((("q",), ("pose",)),)

    q: Annotated[
        Any, PerJoint(get_coordinate_axes), "Coordinates at the start, one number for each."
    ] = None
    pose: Annotated[
        Pose | None, FLAT_POSE, "Pose at the start, for a scene with a single floating joint."
    ] = None

    @classmethod
    def of(cls, value: Any, c: Context) -> StartTable:
        """Return the table of a start in a scene."""
        return cls(*describe_start(value, c.facts["scene"]))

    def made(self, c: Context) -> Any:
        """Return the coordinates of the start."""
        return parse_start(self.q, self.pose, c.facts["scene"], "q")
