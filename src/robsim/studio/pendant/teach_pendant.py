"""The state of a teach pendant: the robot at its present coordinates, and recorded poses."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from robsim.analysis.manipulability import condition_number
from robsim.base.arrays import Array
from robsim.base.errors import InputError, check_known, format_value
from robsim.geometry.pose import Pose
from robsim.plot.wireframe import compute_display_pose
from robsim.robot.robot import Robot
from robsim.studio.control_values import is_json_integer, is_json_number
from robsim.studio.pendant.coordinate_fields import (
    find_limit_side,
    list_coordinate_fields,
    round_coordinates,
)
from robsim.studio.pendant.pose_table_file import read_pose_table
from robsim.studio.pendant.recorded_poses import (
    MOST_POSES,
    RecordedPose,
    ReplayPace,
    check_pose_name,
)
from robsim.studio.pendant.tool_search import (
    REACHED,
    Lead,
    ReachedPose,
    ToolSearch,
    is_platform,
    parse_lead,
)
from robsim.world.scene import Scene

MOST_STATES = 500  # number of stored moves
REACH = 100.0  # metres: largest coordinate of a typed position
SPEED_SHARES = (0.01, 1.0)  # smallest and largest share of the full speed
LEG_DURATIONS = (0.1, 600.0)  # shortest and longest duration of a leg, seconds


@dataclass(frozen=True, eq=False)
class TaughtState:
    """Coordinates (nq,), recorded poses, and the pose of the tool that was not reached, if any."""

    q: Array
    poses: tuple[RecordedPose, ...] = ()
    requested: Pose | None = None  # of the chosen link, in the base
    reached: ReachedPose | None = None


class TeachPendant:
    """A robot that is moved by joints or by its tool, with recorded poses, undo and redo.

    Coordinates in requests have the units of the `fields`: degrees and centimetres. A change that
    raises InputError has no effect. Changes with the same stroke number are one move for `undo`.

    Attributes
    ----------
    robot : Robot
        The robot.
    fields : list of CoordinateField
        Its coordinates with their units and limits.
    link : str
        The link that the handle moves.
    lead : {"pose", "pointing", "position"}
        Parts of the pose of the handle that the link follows.
    pace : ReplayPace
        Pace of the replay.
    """

    link: str
    lead: Lead

    def __init__(self, robot: Robot) -> None:
        self.robot, self.scene = robot, Scene((robot,))
        self.fields = list_coordinate_fields(robot)
        self.pace = ReplayPace()
        self._states, self._at = [TaughtState(np.array(robot.home))], 0
        self._stroke: object = None
        self._search: tuple[tuple[str, bytes], ToolSearch] | None = None
        self.choose_link(robot.tip)

    @property
    def state(self) -> TaughtState:
        """The present state."""
        return self._states[self._at]

    @property
    def q(self) -> Array:
        """The present coordinates (nq,)."""
        return self.state.q

    @property
    def poses(self) -> list[RecordedPose]:
        """The recorded poses."""
        return list(self.state.poses)

    @property
    def can_undo(self) -> bool:
        """Whether there is a move to undo."""
        return self._at > 0

    @property
    def can_redo(self) -> bool:
        """Whether there is an undone move."""
        return self._at + 1 < len(self._states)

    @property
    def tool(self) -> Pose:
        """The pose of the chosen link in the base."""
        return Pose(self.robot.fk(self.q, self.link))

    @cached_property
    def base(self) -> Pose:
        """The pose of the base link in the frame of the figures."""
        name = f"{self.robot.name}.{self.robot.links[0].name}"
        return Pose(compute_display_pose(self.scene, name, self.robot.home))

    # moves

    def set_joint(self, index: Any, value: Any, stroke: object = None) -> None:
        """Set a coordinate, in its displayed unit."""
        i = _check_index(index, len(self.fields), "joint")
        q = self.q.copy()
        q[i] = self.fields[i].convert_number(value)
        self._move(q, stroke)

    def move_tool(self, T: Pose, stroke: object = None, wide: bool = False) -> None:
        """Bring the chosen link to a pose in the base, or as close to it as the arm can reach.

        If `wide`, another configuration of the arm may be chosen.
        """
        if np.abs(T.position).max() > REACH:
            raise InputError(f"the tool: no position may be farther than {REACH:g} m")
        reached = self._tool_search().find(T, self.q, self.lead, wide)
        requested = None if reached.is_reached else T
        self._commit(replace(self.state, q=reached.q, requested=requested, reached=reached), stroke)

    def type_tool(self, index: Any, value: Any) -> None:
        """Set x, y or z of the tool in cm, or roll, pitch or yaw in degrees (index 0 to 5)."""
        i, tool = _check_index(index, 6, "number of a pose"), self.tool
        if not is_json_number(value):
            raise InputError(f"the tool: expected a number, got {format_value(value)}")
        numbers = [*tool.position, *tool.rpy]
        numbers[i] = value / 100.0 if i < 3 else math.radians(math.remainder(value, 360.0))
        self.move_tool(Pose.at(*numbers[:3], rpy=numbers[3:]), wide=True)

    def go_home(self) -> None:
        """Move to the home configuration."""
        self._move(np.array(self.robot.home))

    def choose_link(self, name: object) -> None:
        """Choose the link that the handle moves."""
        names = [link.name for link in self.robot.links]
        check_known(name, names, "no link {}", "links")
        self.link = str(name)
        self.lead = "position"
        with suppress(InputError):  # a link that no joint moves is shown, and cannot be dragged
            self.lead = self._tool_search().natural_lead
        self._forget_requests()

    def choose_lead(self, name: object) -> None:
        """Choose the parts of the pose that the link follows."""
        self.lead = parse_lead(name)
        self._forget_requests()

    # recorded poses

    def record(self) -> None:
        """Add the present coordinates to the recorded poses, rounded to 0.001 deg and 0.01 mm."""
        if len(self.state.poses) >= MOST_POSES:
            raise InputError(f"at most {MOST_POSES} poses can be recorded")
        taken, number = {pose.name for pose in self.state.poses}, len(self.state.poses) + 1
        while f"pose {number}" in taken:
            number += 1
        q = round_coordinates(self.fields, self.q)
        self._keep_poses([*self.poses, RecordedPose(f"pose {number}", q)])

    def remove(self, index: Any) -> None:
        """Remove a recorded pose."""
        poses = self.poses
        del poses[self._check_pose(index)]
        self._keep_poses(poses)

    def rename(self, index: Any, name: object) -> None:
        """Give a recorded pose another name."""
        poses, i = self.poses, self._check_pose(index)
        others = [pose.name for j, pose in enumerate(poses) if j != i]
        poses[i] = replace(poses[i], name=check_pose_name(name, others))
        self._keep_poses(poses)

    def reorder(self, index: Any, to: Any) -> None:
        """Move a recorded pose to another place in the list."""
        poses, place = self.poses, self._check_pose(to)
        poses.insert(place, poses.pop(self._check_pose(index)))
        self._keep_poses(poses)

    def go_to(self, index: Any) -> None:
        """Move to a recorded pose."""
        self._move(self.poses[self._check_pose(index)].q.copy())

    def load_poses(self, text: Any) -> None:
        """Replace the recorded poses by the poses of a CSV table."""
        if not isinstance(text, str):
            raise InputError("poses: expected the text of a CSV file")
        self._keep_poses(read_pose_table(self.robot, text))

    def set_pace(self, speed: object, duration: object) -> None:
        """Set the share of the full speed, or the duration of each leg in seconds if not None."""
        self.pace = ReplayPace(
            _check_between(speed, SPEED_SHARES, "speed"),
            None
            if duration is None
            else _check_between(duration, LEG_DURATIONS, "seconds per motion"),
        )

    # history

    def undo(self) -> None:
        """Return to the state before the last move or change of the list."""
        if not self.can_undo:
            raise InputError("there is nothing to undo")
        self._at, self._stroke = self._at - 1, None

    def redo(self) -> None:
        """Repeat the move or change that was undone."""
        if not self.can_redo:
            raise InputError("there is nothing to redo")
        self._at, self._stroke = self._at + 1, None

    # displayed values

    @property
    def limit_sides(self) -> list[str]:
        """For each coordinate "low" or "high" if it is at this limit, else ""."""
        return [find_limit_side(f, float(x)) for f, x in zip(self.fields, self.q, strict=True)]

    @property
    def reach_text(self) -> str:
        """Explanation of the distance from the requested pose, or "" if the tool is there."""
        reached = self.state.reached
        if reached is not None and reached.switched:
            return "reached in another configuration of the arm"
        if self.state.requested is None or reached is None:
            return ""
        gaps = [f"{_format_length(reached.distance)} too far"] if reached.distance > REACHED else []
        if reached.angle > REACHED:
            gaps.append(f"turned by {math.degrees(reached.angle):.3g} deg")
        sides = ((self.fields[i], self.limit_sides[i]) for i in self._tool_search().moved)
        held = [
            f"{field.name} at its limit of {(field.low if side == 'low' else field.high):.4g} "
            f"{field.unit}"
            for field, side in sides
            if side
        ]
        return "; ".join([f"out of reach: {' and '.join(gaps)}", *held])

    @property
    def condition(self) -> float | None:
        """Condition number of the Jacobian of the tool, in units of the reach; None if infinite."""
        size = max(float(np.linalg.norm(self.tool.position)), 1e-3)
        number = float(condition_number(self.robot, self.q, self.link, length=size))
        return number if number < 1e6 else None

    @cached_property
    def _platform_rows(self) -> list[int]:
        """Indices of the coordinates of platforms."""
        rows = [
            is_platform(link) for link in self.robot.links for _ in link.joint.parts.coordinates
        ]
        return [i for i, held in enumerate(rows) if held]

    def _tool_search(self) -> ToolSearch:
        """Return the search for the chosen link, with platforms where they are."""
        key = (self.link, self.q[self._platform_rows].tobytes())
        if self._search is None or self._search[0] != key:
            self._search = key, ToolSearch(self.robot, self.link, self.q)
        return self._search[1]

    def _move(self, q: Array, stroke: object = None) -> None:
        """Move to coordinates (nq,), as a new state."""
        self._commit(replace(self.state, q=q, requested=None, reached=None), stroke)

    def _keep_poses(self, poses: list[RecordedPose]) -> None:
        """Store another list of recorded poses, as a new state."""
        self._commit(replace(self.state, poses=tuple(poses)))

    def _commit(self, state: TaughtState, stroke: object = None) -> None:
        """Store a state; it replaces the last state of the same stroke."""
        again = stroke is not None and stroke == self._stroke
        self._states = [*self._states[: self._at + (0 if again else 1)], state][-MOST_STATES:]
        self._at, self._stroke = len(self._states) - 1, stroke

    def _forget_requests(self) -> None:
        """Forget the requested poses, which belong to another link or lead."""
        self._states = [replace(state, requested=None, reached=None) for state in self._states]
        self._stroke = None

    def _check_pose(self, index: Any) -> int:
        """Return the index of a recorded pose; raise InputError if there is none."""
        return _check_index(index, len(self.state.poses), "recorded pose")


def _format_length(metres: float) -> str:
    """Return a length in cm, or in m from 10 m on."""
    return f"{100.0 * metres:.3g} cm" if metres < 9.995 else f"{metres:.3g} m"


def _check_index(index: Any, count: int, what: str) -> int:
    """Return an index below `count`; raise InputError for other values."""
    if not is_json_integer(index) or not 0 <= index < count:
        raise InputError(f"there is no {what} {format_value(index)}")
    return int(index)


def _check_between(value: Any, ends: tuple[float, float], what: str) -> float:
    """Return a number between two ends; raise InputError for others."""
    if not is_json_number(value) or not ends[0] <= value <= ends[1]:
        raise InputError(f"{what}: expected {ends[0]:g} to {ends[1]:g}, got {format_value(value)}")
    return float(value)
