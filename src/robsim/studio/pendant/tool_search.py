"""Search for coordinates that bring the tool to a pose, or close to it, near the present ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.geometry.pose import Pose
from robsim.robot.ik.ik_result import IKResult
from robsim.robot.joint import Joint
from robsim.robot.joints.mimic import Mimic
from robsim.robot.link import Link
from robsim.robot.robot import Robot

Lead = Literal["pose", "pointing", "position"]  # parts of the pose that count
LEADS: tuple[Lead, ...] = ("pose", "pointing", "position")
REACHED = 1e-6  # metres and radians: smaller differences from the requested pose do not count
STEP, STEP_ANGLE = 0.05, 0.2  # metres and radians between the searches along a motion
MOST_STEPS = 30
ATTEMPTS = 12  # further starts near the present coordinates, if the search from these fails
SPREAD = {"rad": 0.5, "m": 0.1}  # largest distance of these starts
FARTHEST = 1.2  # rad or m: a dragged tool may not move a coordinate farther at once
WIDE_ATTEMPTS = 80  # random starts for a typed pose, which may need another configuration
WIDEST = {"rad": math.pi, "m": 1.0}  # largest distance of these starts from zero
BETTER = 0.98  # another start must reduce the error at least to this share


class ReachedPose(NamedTuple):
    """Coordinates (nq,) nearest to a requested pose, and their distance from it.

    `distance` is in metres and `angle` in radians; the angle counts only as far as the lead
    demands. `switched` is whether the arm is in another configuration, such as elbow up.
    """

    q: Array
    distance: float
    angle: float
    switched: bool = False

    @property
    def is_reached(self) -> bool:
        """Whether the tool is at the requested pose."""
        return self.distance <= REACHED and self.angle <= REACHED


class ToolSearch:
    """Search that moves the joints before a link; platforms stay where they are.

    A free body or a platform that moves sideways is moved only if nothing else moves the link.
    Raises InputError if no joint moves the link, or a vehicle alone.
    """

    def __init__(self, robot: Robot, link: str, q: Array) -> None:
        self.robot, self.link = robot, link
        self.arm, self.free = hold_links(robot, q, is_platform)
        if not self.arm.tree.flag_velocities(link).any():
            self.arm, self.free = hold_links(robot, q, _rides_on_wheels)
        tree = self.arm.tree
        columns = np.flatnonzero(tree.flag_velocities(link))
        if not columns.size:
            raise InputError(f"no joint moves '{link}': choose another frame, or use the sliders")
        rows = tree.alone(columns.astype(np.int64))
        self.rows = rows[rows >= 0]
        sources = [tie.source for tie in tree.joints.ties]  # a turn would move their followers
        turning = np.array([kind.turns for kind in tree.kinds(columns)])[rows >= 0]
        self.turning = turning & ~np.isin(self.rows, sources)
        self.count = len(columns)

    @property
    def moved(self) -> list[int]:
        """Indices of the coordinates of the robot that the search changes."""
        return [int(i) for i in self.free[self.rows]]

    @property
    def natural_lead(self) -> Lead:
        """The parts of a pose that the number of joints can fulfil."""
        return "pose" if self.count > 5 else "pointing" if self.count == 5 else "position"

    def find(self, T: Pose, q: Array, lead: Lead = "pose", wide: bool = False) -> ReachedPose:
        """Return the coordinates near q (nq,) that bring the link closest to T in the base.

        If `wide`, another configuration of the arm may be chosen, such as elbow up instead of
        elbow down.
        """
        start = q[self.free]
        ask: dict[str, Any] = {
            "link": self.link,
            "mask": None if lead == "pose" else lead,
            "threads": 1,
        }
        found = self._search_along(T, q, ask)
        best, switched = found.q, False
        if not found.success:
            nearby = self._search_nearby(T, start, float(found.error), ask)
            best = best if nearby is None else nearby
            missed = wide and not self.measure(T, self._complete(best, q), lead).is_reached
            other = self._search_widely(T, start, ask) if missed else None
            best, switched = (best, False) if other is None else (other, True)
        whole = self._complete(self._unwind(best, start), q)
        return self.measure(T, whole, lead)._replace(switched=switched)

    def _complete(self, own: Array, q: Array) -> Array:
        """Return q (nq,) with other values of the coordinates that the search may change."""
        whole = q.copy()
        whole[self.free] = own
        return whole

    def measure(self, T: Pose, q: Array, lead: Lead) -> ReachedPose:
        """Return the distance of the link at q (nq,) from the pose T in the base."""
        reached = Pose(self.robot.fk(q, self.link))
        between = (reached.inv() @ T).matrix
        angle = 0.0
        if lead == "pose":
            angle = float(np.linalg.norm(Pose(between).rotvec))
        elif lead == "pointing":
            angle = float(np.arctan2(np.hypot(*between[:2, 2]), between[2, 2]))
        return ReachedPose(q, float(np.linalg.norm(between[:3, 3])), angle)

    def _search_along(self, T: Pose, q: Array, ask: dict[str, Any]) -> IKResult:
        """Return the result of searches along the straight motion to T, each from the last result.

        Short steps keep the posture of the arm. The last search begins where the motion is still
        possible, or at q if the result is better.
        """
        here, start = Pose(self.robot.fk(q, self.link)), q[self.free]
        way = (here.inv() @ T).matrix
        turn = Pose(way).rotvec
        size = max(np.linalg.norm(way[:3, 3]) / STEP, np.linalg.norm(turn) / STEP_ANGLE)
        count = min(math.ceil(float(size)), MOST_STEPS)
        at = start
        for share in np.arange(1, count) / max(count, 1):
            between = here @ Pose.at(*(share * way[:3, 3]), rotvec=share * turn)
            found = self.arm.ik(between, at, restarts=0, **ask)
            if not found.success:
                break
            at = self._unwind(found.q, at)
        along = self.arm.ik(T, at, restarts=0, **ask)
        if along.success or at is start:
            return along
        direct = self.arm.ik(T, start, restarts=0, **ask)
        return direct if direct.error < BETTER * along.error else along

    def _search_nearby(
        self, T: Pose, start: Array, error: float, ask: dict[str, Any]
    ) -> Array | None:
        """Return coordinates closer to T by a search from several starts around `start`, if any.

        An arm that is stretched cannot begin to bend from where it is: the gradient vanishes there.
        """
        spread = [SPREAD[self.arm.coordinate_units[i]] for i in self.rows]
        ends = start[self.rows] - spread, start[self.rows] + spread
        own, errors = self._search_from_random_starts(T, start, ends, ATTEMPTS, ask)
        near = np.abs(own - start).max(axis=1, initial=0.0) <= FARTHEST
        closer = near & (errors < BETTER * error)
        if not closer.any():
            return None
        return _find_nearest(own, start, closer & (errors <= errors[closer].min() + REACHED))

    def _search_widely(self, T: Pose, start: Array, ask: dict[str, Any]) -> Array | None:
        """Return the coordinates nearest to `start` of all searches that reach T, or None."""
        spans = [WIDEST[self.arm.coordinate_units[i]] for i in self.rows]
        ends = np.multiply(spans, -1.0), np.array(spans)
        own, errors = self._search_from_random_starts(T, start, ends, WIDE_ATTEMPTS, ask)
        solved = errors <= REACHED / 10
        return _find_nearest(own, start, solved) if solved.any() else None

    def _search_from_random_starts(
        self, T: Pose, start: Array, ends: tuple[Array, Array], count: int, ask: dict[str, Any]
    ) -> tuple[Array, Array]:
        """Return the coordinates (count, nq) and errors of searches that begin between two ends."""
        starts, low, high = np.tile(start, (count, 1)), *self.arm.limits.T
        starts[:, self.rows] = np.random.default_rng(0).uniform(*ends, (count, len(self.rows)))
        found = self.arm.ik(T, np.clip(starts, low, high), restarts=0, **ask)
        return np.array([self._unwind(q, start) for q in found.q]), np.asarray(found.error)

    def _unwind(self, q: Array, near: Array) -> Array:
        """Return q with angles within the limits as close to `near` as whole turns permit."""
        out = np.array(q)
        low, high = self.arm.limits.T
        rows, whole = self.rows[self.turning], 2.0 * np.pi
        fewest, most = (
            np.ceil((low[rows] - q[rows]) / whole),
            np.floor((high[rows] - q[rows]) / whole),
        )
        turns = np.clip(np.round((near[rows] - q[rows]) / whole), fewest, most)
        out[rows] += whole * np.where(fewest <= most, turns, 0.0)
        return out


def _find_nearest(q: Array, start: Array, usable: NDArray[np.bool_]) -> Array:
    """Return the usable row of q (n, nq) whose largest distance from `start` is least."""
    steps = np.abs(q - start).max(axis=1)
    return np.asarray(q[np.where(usable, steps, np.inf).argmin()])


def hold_links(
    robot: Robot, q: Array, is_held: Callable[[Link], bool]
) -> tuple[Robot, NDArray[np.int64]]:
    """Return a robot whose held links are fixed as at q (nq,), and its coordinates.

    A robot without such links is returned unchanged.
    """
    if not any(map(is_held, robot.links)):
        return robot, np.arange(robot.nq)
    links: list[Link] = []
    kept: list[int] = []
    start = 0
    for link in robot.links:
        count = len(link.joint.parts.coordinates)
        if link.parent and is_held(link):
            T = Pose(robot.fk(q, link.parent)).inv() @ Pose(robot.fk(q, link.name))
            links.append(replace(link, joint=Joint(place=T)))
        else:
            links.append(link)
            kept += range(start, start + count)
        start += count
    home = np.clip(q[kept], *robot.limits[kept].T)
    return Robot(robot.name, links, home, tip=robot.tip), np.array(kept, dtype=np.int64)


def is_platform(link: Link) -> bool:
    """Return whether the joint of a link is a free body, a vehicle, or a wheel of a vehicle."""
    return len(link.joint.parts.coordinates) > 1 or _rides_on_wheels(link)


def _rides_on_wheels(link: Link) -> bool:
    """Return whether the joint of a link is a vehicle, or a wheel of one."""
    follows = link.joint.follows
    return link.joint.model.wheeled or not (follows is None or isinstance(follows, Mimic))


def parse_lead(value: object) -> Lead:
    """Return the lead of this name; raise InputError if there is none."""
    lead = next((each for each in LEADS if each == value), None)
    if lead is None:
        raise InputError(f"no lead {format_value(value)}; leads: {', '.join(LEADS)}")
    return lead
