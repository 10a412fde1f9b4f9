"""Samplers of starts: poses of the frame that moves, or coordinates of the robots."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import Angle, DeclaredValue, Flag, Length, register
from robsim.declare.array_types import Numbers
from robsim.declare.kind_families import family
from robsim.declare.quantities import Amount
from robsim.declare.texts import FrameReference
from robsim.geometry.look_at import look_at_rotation, sample_cone_directions
from robsim.geometry.pose import Pose
from robsim.geometry.pose_table import POSE
from robsim.starts.start_kinematics import StartKinematics
from robsim.statistics.random_numbers import RandomNumbers

START = family("start")
PAIR = Numbers(item=Angle(), shape=(2,))
DISTANCES = Numbers(item=Length(least=0), shape=(2,))
ANGLES = Numbers(item=Angle(least=0), shape=(2,))
COORDINATES = Numbers(item=Amount(), shape=None)
FULL_TURN = (-np.pi, np.pi)


@dataclass(frozen=True, eq=False)
class Start(DeclaredValue):
    """A sampler of starts; `numbers` is how many random numbers one takes.

    With `visible` only starts are taken at which the cameras see the marks that the task needs and
    the joints are within their limits; what is drawn in vain is counted.
    """

    numbers: ClassVar[int] = 0

    visible: Annotated[bool, Flag(), "Whether only starts are taken that see their target."] = (
        field(default=True, kw_only=True)
    )

    def coordinates(
        self, reach: StartKinematics, draws: RandomNumbers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (draws, nq), and whether each was reached."""
        return reach.coordinates(self.poses(reach, draws.uniform(self.numbers)))

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) in the world of the frame that moves.

        `share` (draws, numbers) are uniform numbers in (0, 1).
        """
        raise NotImplementedError


def _interpolate_pair(pair: Any, share: Array) -> Array:
    return np.asarray(pair[0] + (pair[1] - pair[0]) * share)


def _check_low_high_pair(pair: Any, what: str, least: float = -np.inf) -> None:
    if pair.ndim != 1 or pair[0] > pair[1] or pair[0] < least:
        bound = "" if least == -np.inf else f" of at least {least:g}"
        raise InputError(f"{what}: expected (low, high){bound}, got {format_value(pair.tolist())}")


@register("start", "look_at")
@dataclass(frozen=True, eq=False)
class LookAt(Start):
    """Poses from which the camera looks at the middle of the marks of an object.

    They are at a distance between two, in a direction within the angle `cone` of `axis` (3,), which
    is in the world; None is that from the target to the camera at its goal. Directions are uniform
    on the sphere. The camera is turned about its optical axis by `roll`, from where the columns of
    the image run as nearly as they can as at the goal. With `aside` it looks at a point as far from
    the middle, at most.

    >>> LookAt("plate", distance=(0.3, 0.8)).cone
    0.7853981633974483
    """

    numbers: ClassVar[int] = 7

    target: Annotated[
        str | None, FrameReference, "Object that is looked at; None: that of the task."
    ] = None
    distance: Annotated[
        Any, Numbers(item=Length(above=0), shape=(2,)), "Least and largest distance in metres."
    ] = field(kw_only=True)
    roll: Annotated[Any, PAIR, "Least and largest angle about the optical axis in radians."] = (
        FULL_TURN
    )
    cone: Annotated[float, Angle(least=0, most=np.pi), "Largest angle to the axis."] = np.pi / 4
    axis: Annotated[
        Any,
        Numbers(item=Amount(), shape=(3,)),
        "Direction from the target; None: that of the goal.",
    ] = None
    aside: Annotated[
        float, Length(least=0), "Radius in which the point that is looked at lies."
    ] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_low_high_pair(self.distance, "LookAt.distance (metres)", 0.0)
        _check_low_high_pair(self.roll, "LookAt.roll (radians)")
        if self.axis is not None and not self.axis.any():
            raise InputError("LookAt.axis: expected a direction, got [0, 0, 0]")

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the camera in the world."""
        middle, axis = self._middle_and_axis(reach)
        out = sample_cone_directions(axis, self.cone, share[:, 0], share[:, 1])
        T = np.tile(np.eye(4), (len(share), 1, 1))
        T[:, :3, 3] = middle + _interpolate_pair(self.distance, share[:, 2])[:, None] * out
        z = -out
        if self.aside:
            look = middle + self.aside * _points_in_ball(share[:, 4:7]) - T[:, :3, 3]
            z = look / np.sqrt((look * look).sum(axis=1, keepdims=True))
        T[:, :3, :3] = look_at_rotation(
            z, _interpolate_pair(self.roll, share[:, 3]), reach.goal.rotation[:, 1]
        )
        return T

    def _middle_and_axis(self, reach: StartKinematics) -> tuple[Array, Array]:
        """Return the middle (3,) of the marks, and the unit direction (3,) from it of the cone."""
        if reach.frame not in [eye.name for eye in reach.scene.cameras]:
            raise InputError(
                f"LookAt: what moves is '{reach.frame}', which looks at nothing; take Shell, "
                "Within or About"
            )
        middle = reach.middle(self.target or reach.controller.sights[0].target.name)
        away = reach.goal.position - middle if self.axis is None else self.axis
        if not np.abs(away).max() > 0:
            raise InputError("LookAt: the goal is in the middle of the marks: give axis=")
        return middle, np.asarray(away / np.sqrt((away * away).sum()))


@register("start", "shell")
@dataclass(frozen=True, eq=False)
class Shell(Start):
    """Poses whose distance and angle from another one are between two, in any direction.

    `about` is that pose in the world; None is the goal. Positions are uniform in the volume,
    angles uniform between the two, and their axes uniform on the sphere.

    >>> Shell(distance=(0.1, 0.2), angle=(0.0, 0.5)).about is None
    True
    """

    numbers: ClassVar[int] = 6

    distance: Annotated[Any, DISTANCES, "Least and largest distance in metres."]
    angle: Annotated[Any, ANGLES, "Least and largest angle in radians."] = (0, 0)
    about: Annotated[Pose | None, POSE, "Pose in the world; None: the goal."] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_low_high_pair(self.distance, "Shell.distance (metres)", 0.0)
        _check_low_high_pair(self.angle, "Shell.angle (radians)", 0.0)
        if self.angle[1] > np.pi:
            raise InputError(f"Shell.angle: at most pi radians, got {self.angle[1]:g}")

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the frame that moves in the world."""
        return _sample_about_pose(self.about or reach.goal, self.distance, self.angle, share)


@register("start", "within")
@dataclass(frozen=True, eq=False)
class Within(Start):
    """Poses no farther than `radius` and `angle` from another one, in any direction.

    `about` is that pose in the world; None is the goal.

    >>> Within(radius=0.2, angle=0.5).radius
    0.2
    """

    numbers: ClassVar[int] = 6

    radius: Annotated[float, Length(least=0), "Largest distance."]
    angle: Annotated[float, Angle(least=0, most=np.pi), "Largest angle."] = 0.0
    about: Annotated[Pose | None, POSE, "Pose in the world; None: the goal."] = None

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the frame that moves in the world."""
        far, turned = np.array([0.0, self.radius]), np.array([0.0, self.angle])
        return _sample_about_pose(self.about or reach.goal, far, turned, share)


@register("start", "about")
@dataclass(frozen=True, eq=False)
class About(Start):
    """Poses about another one, in a box: so far along, and turned so far about, each axis.

    Offsets are in the axes of that pose, turns roll, pitch and yaw. `pose` is in the world; None
    is the goal.

    >>> About(position=[0.1, 0.1, 0.3], rpy=[0.0, 0.0, 1.0]).rpy
    array([0., 0., 1.])
    """

    numbers: ClassVar[int] = 6

    position: Annotated[
        Any, Numbers(item=Length(least=0), shape=(3,)), "Largest offset along each axis."
    ] = (0.0, 0.0, 0.0)
    rpy: Annotated[
        Any, Numbers(item=Angle(least=0), shape=(3,)), "Largest roll, pitch and yaw."
    ] = (0.0, 0.0, 0.0)
    pose: Annotated[Pose | None, POSE, "Pose in the world; None: the goal."] = None

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the frame that moves in the world."""
        signed = 2.0 * share - 1.0
        made = Pose.at(*(signed[:, :3] * self.position).T, rpy=signed[:, 3:] * self.rpy)
        return np.asarray(((self.pose or reach.goal) @ made).matrix)


@register("start", "anywhere")
@dataclass(frozen=True, eq=False)
class Anywhere(Start):
    """Coordinates anywhere between `low` and `high`; None are the limits of the joints.

    >>> Anywhere(visible=False).low is None
    True
    """

    low: Annotated[Any, COORDINATES, "Lowest coordinates, (nq,)."] = None
    high: Annotated[Any, COORDINATES, "Highest coordinates, (nq,)."] = None

    def coordinates(
        self, reach: StartKinematics, draws: RandomNumbers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (draws, nq), and whether each was reached."""
        scene = reach.scene
        low, high = (
            limits if own is None else own
            for own, limits in zip((self.low, self.high), scene.limits.T, strict=True)
        )
        for name, end in (("low", low), ("high", high)):
            if end.shape not in ((), (scene.nq,)) or not np.isfinite(end).all():
                raise InputError(
                    f"Anywhere.{name}: expected {scene.nq} finite coordinates, got "
                    f"{format_value(end.tolist())}; joints without limits need these"
                )
        if (low > high).any():
            raise InputError(f"Anywhere: low {format_value(low.tolist())} is above high")
        q = low + (high - low) * draws.uniform(scene.nq)
        return q, np.ones(len(q), dtype=bool)


def _sample_about_pose(pose: Pose, distance: Array, angle: Array, share: Array) -> Array:
    """Return poses (n, 4, 4) at distances and angles between two from another pose."""
    far = np.cbrt(_interpolate_pair(distance**3, share[:, 0]))[:, None]
    turn = _interpolate_pair(angle, share[:, 3])[:, None] * _unit_directions(share[:, 4:6])
    made = Pose.at(*(far * _unit_directions(share[:, 1:3])).T, rotvec=turn)
    return np.asarray((Pose.at(*pose.position) @ made).matrix @ _rotation_matrix_of(pose))


def _rotation_matrix_of(pose: Pose) -> Array:
    T = np.eye(4)
    T[:3, :3] = pose.rotation
    return T


def _unit_directions(share: Array) -> Array:
    """Return unit vectors (n, 3), uniform on the sphere, of uniform numbers (n, 2)."""
    return sample_cone_directions(np.array([0.0, 0.0, 1.0]), np.pi, share[:, 0], share[:, 1])


def _points_in_ball(share: Array) -> Array:
    """Return points (n, 3), uniform in the unit ball, of uniform numbers (n, 3)."""
    return np.asarray(np.cbrt(share[:, :1]) * _unit_directions(share[:, 1:]))
