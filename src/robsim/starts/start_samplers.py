"""Samplers of starts: poses of the moving frame, or coordinates of the robots."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.unit_warnings import warn_of_degrees
from robsim.declare import Angle, DeclaredValue, Flag, Length, register
from robsim.declare.array_types import Numbers
from robsim.declare.kind_families import family
from robsim.declare.quantities import Amount
from robsim.declare.texts import FrameReference
from robsim.geometry.look_at import look_at_rotation, sample_cone_directions
from robsim.geometry.pose import Pose, PoseLike
from robsim.geometry.pose_table import POSE
from robsim.starts.pose_regions import BoxRegion, LookRegion, PoseRegion, ShellRegion
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
    """Base class of samplers of starts.

    `numbers` is the count of uniform random numbers for one pose, and 0 for samplers of
    coordinates. `advice` names values to change if no start is accepted. With `visible` a start is
    sampled again until the cameras see the marks that the task needs and all joints are within
    their limits. Rejected attempts are counted.

    A robot whose frame has fewer than six motions, or a vehicle, does not reach every pose. Its
    starts are the nearest poses within the bounds of the sampler. The bounds hold for them, and the
    drawn distance is kept if the joints allow it.
    """

    numbers: ClassVar[int] = 0
    advice: ClassVar[str] = "another sampler"

    visible: Annotated[bool, Flag(), "Whether every start must see its target."] = field(
        default=True, kw_only=True
    )

    def coordinates(
        self, reach: StartKinematics, draws: RandomNumbers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (draws, nq), and whether the robot reaches each start.

        A robot that does not reach every pose takes the nearest poses of the region instead.
        """
        poses = self.poses(reach, draws.uniform(self.numbers))
        region = None if reach.reaches_every_pose else self.region(reach)
        if region is None:
            return reach.coordinates(poses)
        return reach.nearest_coordinates(region, poses, draws)

    def region(self, reach: StartKinematics) -> PoseRegion | None:
        """Return the region of the poses; None if only the sampled poses count."""
        return None

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the moving frame in the world.

        `share` (draws, numbers) are uniform numbers in (0, 1).
        """
        raise NotImplementedError


def _get_reference(pose: PoseLike | None, reach: StartKinematics) -> Pose:
    """Return the stored reference pose of a sampler, or the goal if it is None."""
    return cast(Pose | None, pose) or reach.goal


def _interpolate_pair(pair: ArrayLike, share: Array) -> Array:
    """Return numbers between the two bounds of a pair."""
    low, high = cast(Array, pair)
    return np.asarray(low + (high - low) * share)


def _check_low_high_pair(bounds: ArrayLike, subject: str, least: float = -np.inf) -> None:
    """Raise InputError unless a pair of bounds is ordered and at least `least`."""
    pair = cast(Array, bounds)
    if pair.ndim != 1 or pair[0] > pair[1] or pair[0] < least:
        bound = "" if least == -np.inf else f" of at least {least:g}"
        raise InputError(
            f"{subject}: expected (low, high){bound}, got {format_value(pair.tolist())}"
        )


@register("start", "look_at")
@dataclass(frozen=True, eq=False)
class LookAt(Start):
    """Camera poses that look at the middle of the marks of an object.

    Distances from the middle are uniform between two bounds. Directions from the middle are uniform
    on the part of the sphere within the angle `cone` of `axis` (3,), a direction in the world. The
    default axis points to the camera at its goal. At zero `roll` the image columns are as close as
    possible to their direction at the goal; `roll` rotates the camera about its optical axis. With
    `aside` the camera looks at a random point within this radius of the middle.

    A robot with few joints keeps the optical axis and the distance first, then the direction, then
    the roll. If it cannot point the axis at the middle, as a vehicle with a level camera, the axis
    passes as near to the middle as the joints allow.

    Raises
    ------
    InputError
        If bounds are not ordered, or the axis is zero. A study also raises it if the moving frame
        is no camera.

    Examples
    --------
    >>> LookAt("plate", distance=(0.3, 0.8)).cone
    0.7853981633974483
    """

    numbers: ClassVar[int] = 7
    advice: ClassVar[str] = "another distance, roll, cone or axis"

    target: Annotated[
        str | None, FrameReference, "Target object; None: the target of the task."
    ] = None
    distance: Annotated[
        ArrayLike,
        Numbers(item=Length(above=0), shape=(2,)),
        "Least and largest distance in metres.",
    ] = field(kw_only=True)
    roll: Annotated[
        ArrayLike, PAIR, "Least and largest angle about the optical axis in radians."
    ] = FULL_TURN
    cone: Annotated[
        float, Angle(least=0, most=np.pi), "Largest angle from the axis in radians."
    ] = np.pi / 4
    axis: Annotated[
        ArrayLike | None,
        Numbers(item=Amount(), shape=(3,)),
        "Direction from the target; None: the direction of the goal.",
    ] = None
    aside: Annotated[
        float, Length(least=0), "Largest distance in metres of the viewed point from the middle."
    ] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_low_high_pair(self.distance, "LookAt.distance (metres)", 0.0)
        _check_low_high_pair(self.roll, "LookAt.roll (radians)")
        warn_of_degrees(self.roll, "LookAt.roll")
        if self.axis is not None and not np.any(self.axis):
            raise InputError("LookAt.axis: expected a direction, got [0, 0, 0]")

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the camera in the world."""
        middle, axis = self._middle_and_axis(reach)
        directions = sample_cone_directions(axis, self.cone, share[:, 0], share[:, 1])
        T = np.tile(np.eye(4), (len(share), 1, 1))
        T[:, :3, 3] = middle + _interpolate_pair(self.distance, share[:, 2])[:, None] * directions
        z = -directions
        if self.aside:
            view = middle + self.aside * _points_in_ball(share[:, 4:7]) - T[:, :3, 3]
            z = view / np.sqrt((view * view).sum(axis=1, keepdims=True))
        T[:, :3, :3] = look_at_rotation(
            z, _interpolate_pair(self.roll, share[:, 3]), reach.goal.rotation[:, 1]
        )
        return T

    def region(self, reach: StartKinematics) -> LookRegion:
        """Return the region of the poses."""
        middle, axis = self._middle_and_axis(reach)
        bounds = cast(Array, self.distance), self.cone, cast(Array, self.roll), self.aside
        return LookRegion(middle, axis, reach.goal.rotation[:, 1], *bounds)

    def _middle_and_axis(self, reach: StartKinematics) -> tuple[Array, Array]:
        """Return the middle (3,) of the marks, and the unit axis (3,) of the cone."""
        if reach.frame not in [eye.name for eye in reach.scene.cameras]:
            raise InputError(
                f"LookAt: the moving frame '{reach.frame}' is no camera; use Shell, Within or About"
            )
        middle = reach.middle(self.target or reach.controller.sights[0].target.name)
        direction = reach.goal.position - middle if self.axis is None else np.asarray(self.axis)
        if not np.abs(direction).max() > 0:
            raise InputError("LookAt: the goal is in the middle of the marks: give axis=")
        return middle, np.asarray(direction / np.sqrt((direction * direction).sum()))


@register("start", "shell")
@dataclass(frozen=True, eq=False)
class Shell(Start):
    """Poses within bounds of distance and angle from a reference pose, in any direction.

    The reference pose `about`, with position p0 and rotation R0, is in the world; the default is
    the goal. A start has the pose

        p = p0 + d u,    R = exp(theta [a]x) R0

    with the position uniform in the volume of the shell, the angle theta uniform between its
    bounds, and the direction u and the rotation axis a uniform on the sphere.

    Raises
    ------
    InputError
        If bounds are not ordered, or an angle exceeds pi.

    Examples
    --------
    >>> Shell(distance=(0.1, 0.2), angle=(0.0, 0.5)).about is None
    True
    """

    numbers: ClassVar[int] = 6
    advice: ClassVar[str] = "another distance or angle"

    distance: Annotated[ArrayLike, DISTANCES, "Least and largest distance in metres."]
    angle: Annotated[ArrayLike, ANGLES, "Least and largest angle in radians."] = (0, 0)
    about: Annotated[PoseLike | None, POSE, "Pose in the world; None: the goal."] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_low_high_pair(self.distance, "Shell.distance (metres)", 0.0)
        _check_low_high_pair(self.angle, "Shell.angle (radians)", 0.0)
        _, most = cast(Array, self.angle)
        if most > np.pi:
            raise InputError(f"Shell.angle: at most pi radians, got {most:g}")

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the moving frame in the world."""
        distance, angle = cast(Array, self.distance), cast(Array, self.angle)
        return _sample_about_pose(_get_reference(self.about, reach), distance, angle, share)

    def region(self, reach: StartKinematics) -> ShellRegion:
        """Return the region of the poses."""
        distance, angle = cast(Array, self.distance), cast(Array, self.angle)
        return ShellRegion(_get_reference(self.about, reach), distance, angle)


@register("start", "within")
@dataclass(frozen=True, eq=False)
class Within(Start):
    """Poses within `radius` and `angle` of a reference pose, in any direction.

    The reference pose `about` is in the world; the default is the goal. The distribution is `Shell`
    with distances from 0 to `radius` and angles from 0 to `angle`.

    Examples
    --------
    >>> Within(radius=0.2, angle=0.5).radius
    0.2
    """

    numbers: ClassVar[int] = 6
    advice: ClassVar[str] = "another radius or angle"

    radius: Annotated[float, Length(least=0), "Largest distance in metres."]
    angle: Annotated[float, Angle(least=0, most=np.pi), "Largest angle in radians."] = 0.0
    about: Annotated[PoseLike | None, POSE, "Pose in the world; None: the goal."] = None

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the moving frame in the world."""
        distances, angles = np.array([0.0, self.radius]), np.array([0.0, self.angle])
        return _sample_about_pose(_get_reference(self.about, reach), distances, angles, share)

    def region(self, reach: StartKinematics) -> ShellRegion:
        """Return the region of the poses."""
        distances, angles = np.array([0.0, self.radius]), np.array([0.0, self.angle])
        return ShellRegion(_get_reference(self.about, reach), distances, angles)


@register("start", "about")
@dataclass(frozen=True, eq=False)
class About(Start):
    """Poses in a box about a reference pose: offsets and rotations are bounded along each axis.

    Offsets are along the axes of the reference pose, and rotations are roll, pitch and yaw. Each is
    uniform between -bound and bound. The reference `pose` is in the world; the default is the goal.

    Examples
    --------
    >>> About(position=[0.1, 0.1, 0.3], rpy=[0.0, 0.0, 1.0]).rpy
    array([0., 0., 1.])
    """

    numbers: ClassVar[int] = 6
    advice: ClassVar[str] = "another position or rpy"

    position: Annotated[
        ArrayLike,
        Numbers(item=Length(least=0), shape=(3,)),
        "Largest offset along each axis in metres.",
    ] = (0.0, 0.0, 0.0)
    rpy: Annotated[
        ArrayLike,
        Numbers(item=Angle(least=0), shape=(3,)),
        "Largest roll, pitch and yaw in radians.",
    ] = (0.0, 0.0, 0.0)
    pose: Annotated[PoseLike | None, POSE, "Pose in the world; None: the goal."] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_degrees(self.rpy, "About.rpy")

    def poses(self, reach: StartKinematics, share: Array) -> Array:
        """Return poses (draws, 4, 4) of the moving frame in the world."""
        signed = 2.0 * share - 1.0
        position, rpy = cast(Array, self.position), cast(Array, self.rpy)
        offsets = Pose.at(*(signed[:, :3] * position).T, rpy=signed[:, 3:] * rpy)
        return np.asarray((_get_reference(self.pose, reach) @ offsets).matrix)

    def region(self, reach: StartKinematics) -> BoxRegion:
        """Return the region of the poses."""
        bounds = np.concatenate([cast(Array, self.position), cast(Array, self.rpy)])
        return BoxRegion(_get_reference(self.pose, reach), bounds)


@register("start", "anywhere")
@dataclass(frozen=True, eq=False)
class Anywhere(Start):
    """Coordinates uniform between `low` and `high`; the defaults are the joint limits.

    A study raises InputError if `low` or `high` is not finite, has another number of coordinates
    than the scene, or if `low` is above `high`.

    Examples
    --------
    >>> Anywhere(visible=False).low is None
    True
    """

    advice: ClassVar[str] = "low and high around coordinates that see the target"

    low: Annotated[ArrayLike | None, COORDINATES, "Lowest coordinates, (nq,)."] = None
    high: Annotated[ArrayLike | None, COORDINATES, "Highest coordinates, (nq,)."] = None

    def coordinates(
        self, reach: StartKinematics, draws: RandomNumbers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (draws, nq), and which are within the joint limits.

        Coordinates outside the limits are returned at the limits.
        """
        scene = reach.scene
        low, high = (
            limits if own is None else np.asarray(own)
            for own, limits in zip((self.low, self.high), scene.limits.T, strict=True)
        )
        for name, end in (("low", low), ("high", high)):
            if end.shape not in ((), (scene.nq,)) or not np.isfinite(end).all():
                raise InputError(
                    f"Anywhere.{name}: expected {scene.nq} finite coordinates, got "
                    f"{format_value(end.tolist())}; give low and high if joints have no "
                    "limits"
                )
        if (low > high).any():
            raise InputError(f"Anywhere: low {format_value(low.tolist())} is above high")
        q = low + (high - low) * draws.uniform(scene.nq)
        least, most = scene.limits.T
        return np.clip(q, least, most), ((q >= least) & (q <= most)).all(axis=1)


def _sample_about_pose(pose: Pose, distance: Array, angle: Array, share: Array) -> Array:
    """Return poses (n, 4, 4) within bounds of distance and angle from a reference pose."""
    distances = np.cbrt(_interpolate_pair(distance**3, share[:, 0]))[:, None]
    rotations = _interpolate_pair(angle, share[:, 3])[:, None] * _unit_directions(share[:, 4:6])
    offsets = Pose.at(*(distances * _unit_directions(share[:, 1:3])).T, rotvec=rotations)
    return np.asarray((Pose.at(*pose.position) @ offsets).matrix @ _rotation_matrix_of(pose))


def _rotation_matrix_of(pose: Pose) -> Array:
    """Return the rotation of a pose as a matrix (4, 4) without translation."""
    T = np.eye(4)
    T[:3, :3] = pose.rotation
    return T


def _unit_directions(share: Array) -> Array:
    """Return unit vectors (n, 3), uniform on the sphere, from uniform numbers (n, 2)."""
    return sample_cone_directions(np.array([0.0, 0.0, 1.0]), np.pi, share[:, 0], share[:, 1])


def _points_in_ball(share: Array) -> Array:
    """Return points (n, 3), uniform in the unit ball, from uniform numbers (n, 3)."""
    return np.asarray(np.cbrt(share[:, :1]) * _unit_directions(share[:, 1:]))
