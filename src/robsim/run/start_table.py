"""The text form of the start of a run: coordinates, or a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from robsim.declare.joints import PerJoint, coordinates
from robsim.declare.spec import Context, Raw
from robsim.geometry.pose import Pose
from robsim.geometry.pose_table import KEYS, PoseTable
from robsim.servo.goals.goal import start_of, started


@dataclass(frozen=True)
class StartCoordinates(PerJoint):
    """The declaration of coordinates at the start, instead of a pose there."""

    def beside(self, table: dict[str, Raw], name: str, over: Mapping[str, Raw]) -> None:
        """Remove the pose from a table in place where the coordinates change."""
        for key in KEYS if name in over else ():
            table.pop(key, None)


@dataclass(frozen=True)
class StartPose(PoseTable):
    """The declaration of the pose at the start, instead of coordinates there."""

    flat: bool = True

    def beside(self, table: dict[str, Raw], name: str, over: Mapping[str, Raw]) -> None:
        """Remove the coordinates from a table in place where the pose changes."""
        super().beside(table, name, over)
        if over.keys() & KEYS.keys():
            table.pop("q", None)


@dataclass(frozen=True)
class StartTable:
    """The start of a run; home, if nothing is said."""

    @classmethod
    def of(cls, value: Any, c: Context) -> StartTable:
        """Return the table of a start in a scene."""
        return cls(*started(value, c.facts["scene"]))

    def made(self, c: Context) -> Any:
        """Return the coordinates of the start."""
        return start_of(self.q, self.pose, c.facts["scene"], "q")

    q: Annotated[
        Any, StartCoordinates(coordinates), "Coordinates at the start, one number for each."
    ] = None
    pose: Annotated[
        Pose | None, StartPose(), "Pose at the start, in a scene whose only joint floats."
    ] = None
