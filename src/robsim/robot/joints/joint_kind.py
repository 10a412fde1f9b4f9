"""Base class of kinds of joint: coordinates, motion, sampling and wrapping."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.kernels.bodies.forward_kinematics import place_user_joint
from robsim.kernels.machine.block_rows import Address, BlockRows
from robsim.kernels.machine.program import Program
from robsim.kernels.machine.stages import CompiledStage

SAMPLE_REACH = 0.5  # half range in metres of samples around home, for joints without limits
COORDINATE_UNITS = "rad", "m", "1"


class JointParts(NamedTuple):
    """Independent coordinates and velocities of a joint, with the attributes of `JointKind`.

    A coupled joint has neither. A rolling wheel has a coordinate without a velocity.
    """

    coordinates: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    velocities: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()
    moves: tuple[tuple[bool, int], ...] = ()


class BodyRows(NamedTuple):
    """Rows of a body that the stages of forward kinematics read and write."""

    parent: BlockRows
    place: BlockRows
    x: BlockRows  # first coordinate, or the motion of a kind of the user
    pose: BlockRows
    body: Any  # Any: a `Body` of the assembly, which imports this file


class KinematicsRows(Protocol):
    """Program and rows that joints and couplings use to add their stages, see `FKStages`."""

    program: Program
    ratio: BlockRows

    @property
    def curves(self) -> dict[str, Address]:
        """Tables of the curves of all rails."""


class JointKind:
    """Base class of all kinds of joint: how one frame moves relative to another.

    A kind of your own is a frozen dataclass that derives from this class, with its parameters as
    fields. It defines `name`, `coordinates`, `units` and the methods `motion` and `twists` in
    NumPy. Arrays of coordinates q have the shape (B, n), with the run first and the coordinates in
    the order of `coordinates`. The methods are called from several threads, each with a part of the
    runs.

    Attributes
    ----------
    name : str
        Name in messages, and in files after registration.
    coordinates : tuple of str
        Suffixes of the name of the joint: ("",) for one coordinate, such as (".roll", ".pitch") for
        several.
    units : tuple of str
        Unit of each coordinate: "rad", "m" or "1".
    velocities : tuple of str
        Suffixes of the velocities. Default: `coordinates`.
    rates : tuple of str
        Units of the velocities, "rad/s" or "m/s". Default: the units of the coordinates per second.
    moves : tuple of (bool, int)
        For built-in kinds, whether each velocity turns, and about or along which axis of the moving
        frame.
    straight : bool
        Whether each velocity is the rate of one coordinate. Default: True for a kind without its
        own `integrate`.
    turns : bool
        Whether the joint only turns about its z axis, so that a whole turn changes nothing.
    roams : bool
        Whether the joint lets a robot travel: a floating base or a vehicle.
    wheeled : bool
        Whether the joint cannot move sideways, with the velocities (v, omega).
    free : bool
        Whether the coordinates are a pose: a position and a unit quaternion.
    follower : bool
        Whether the coordinate may follow others, as with `Mimic`.
    rowed : bool
        Whether a Denavit-Hartenberg row can give the constants.
    needs : {"curve", "steering"} or None
        Field that the `Joint` must have.
    placing : Stage or None
        Compiled stage that replaces `motion` and `twists`. It computes both from the coordinates
        and the `constants` of the joint.
    moving : Stage or None
        Compiled stage that replaces `integrate`. Without it, if `placing` is given, each velocity
        is the rate of one coordinate.
    moved : int or None
        Number of leading coordinates that `moving` changes; None for all.
    fused : Stage or None
        For built-in kinds, the stage that computes the pose of a body from its first coordinate.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from robsim.joints import Joint, Link
    >>> from robsim import Pose, Robot
    >>> @dataclass(frozen=True)
    ... class Screw(JointKind):
    ...     lead: float = 0.01  # metres per radian
    ...     name, coordinates, units = "screw", ("",), ("rad",)
    ...     def motion(self, q):
    ...         return np.array(Pose.at(z=self.lead * q[:, 0], rotvec=q * [0, 0, 1]))
    ...     def twists(self, q):
    ...         return np.tile([0, 0, self.lead, 0, 0, 1], (len(q), 1, 1))
    >>> robot = Robot("jack", [Link("base"), Link("nut", "base", Joint(Screw()))])
    >>> robot.fk([2.0])[:3, 3]
    array([0.  , 0.  , 0.02])
    """

    name: ClassVar[str] = ""
    coordinates: ClassVar[tuple[str, ...]] = ()
    units: ClassVar[tuple[str, ...]] = ()
    velocities: ClassVar[tuple[str, ...]] = ()
    rates: ClassVar[tuple[str, ...]] = ()
    moves: ClassVar[tuple[tuple[bool, int], ...]] = ()
    straight: ClassVar[bool] = True
    turns: ClassVar[bool] = False
    roams: ClassVar[bool] = False
    wheeled: ClassVar[bool] = False
    free: ClassVar[bool] = False
    follower: ClassVar[bool] = False
    rowed: ClassVar[bool] = False
    needs: ClassVar[str | None] = None
    placing: ClassVar[CompiledStage | None] = None
    moving: ClassVar[CompiledStage | None] = None
    moved: ClassVar[int | None] = None
    fused: ClassVar[CompiledStage | None] = place_user_joint

    def __init_subclass__(cls, **options: Any) -> None:
        """Fill in the attributes that follow from the attributes of the class."""
        super().__init_subclass__(**options)
        own = vars(cls)
        if "coordinates" in own and "velocities" not in own:
            cls.velocities = cls.coordinates
        if "units" in own and "rates" not in own:
            cls.rates = tuple(f"{unit}/s" for unit in cls.units)
        if ("integrate" in own or "moving" in own) and "straight" not in own:
            cls.straight = False

    @property
    def own(self) -> bool:
        """Whether the kind is defined by the user."""
        return self.fused is place_user_joint

    @property
    def single(self) -> bool:
        """Whether the joint has one coordinate, with limits and a drive."""
        return len(self.coordinates) == 1 and self.straight

    @property
    def alone(self) -> tuple[int, ...]:
        """Index of the only coordinate that each velocity changes, or -1."""
        count = len(self.velocities)
        return tuple(range(count)) if self.straight else (-1,) * count

    @property
    def constants(self) -> tuple[float, ...]:
        """Numbers for the stages: the values of the fields."""
        own: tuple[Any, ...] = fields(self) if is_dataclass(self) else ()
        return tuple(float(getattr(self, each.name)) for each in own)

    def motion(self, q: Array) -> Array:
        """Return the pose (B, 4, 4) of the moved frame in the frame of the joint."""
        raise InputError(f"the motion of a {self.name} joint is compiled; use Robot.fk")

    def twists(self, q: Array) -> Array:
        """Return the twists (B, nv, 6) of the moved frame for a unit of each velocity.

        A twist is (v, omega) at the origin of the moved frame in its own axes: V of T^-1 dT/dt.
        """
        raise InputError(f"the twists of a {self.name} joint are compiled; use Robot.jacobian")

    def integrate(self, q: Array, v: Array, dt: float) -> Array:
        """Return coordinates (B, n) after velocities v (B, nv) over dt seconds."""
        return q + v * dt

    def add_placing(self, rows: KinematicsRows, bodies: Iterable[BodyRows]) -> None:
        """Add the stage that places bodies on joints of this kind."""
        assert self.fused is not None  # a fixed joint places no body
        rows.program.add(self.fused, each=[tuple(each[:4]) for each in bodies])

    @property
    def rest(self) -> Array:
        """Coordinates (n,) of a joint at rest."""
        return np.zeros(len(self.coordinates))

    # Any: `part` is the Curve or the Steering that a kind needs; each kind narrows the type

    def span(self, part: Any) -> tuple[float, float] | None:
        """Return the default limits of the coordinate; `part` is the required curve or steering."""
        return None

    def ranges(self, limits: tuple[float, float] | None, part: Any) -> Array:
        """Return the lowest and highest value (n, 2) of each coordinate, or infinity.

        The argument `limits` holds the limits of a joint with one coordinate, and `part` the curve
        or steering of a kind that requires one.
        """
        rows = np.empty((len(self.coordinates), 2))
        rows[:] = (-np.inf, np.inf) if limits is None else limits
        return rows

    def checked(self, q: Array, what: str, name: str) -> Array:
        """Return valid coordinates (..., n), normalized if necessary, or raise InputError."""
        return q

    def sample(self, share: Array, home: Array, limits: Array) -> Array:
        """Return random coordinates (B, n), uniform within limits (n, 2).

        A coordinate without a limit is within half a metre or half a turn of home (n,). The numbers
        `share` (B, n) are uniform in (0, 1).
        """
        reach = np.where(np.array(self.units) == "rad", np.pi, SAMPLE_REACH)[:, None] * [-1.0, 1.0]
        low, high = np.where(np.isfinite(limits), limits, home[:, None] + reach).T
        return np.asarray(low + (high - low) * share)

    def wrap(self, q: Array, limits: Array) -> Array:
        """Return equivalent coordinates (B, n), moved into limits (n, 2) by whole turns."""
        low, high = limits.T
        if not self.turns or not np.isfinite(limits).all():
            return q
        turns = np.round((q - 0.5 * (low + high)) / (2.0 * np.pi))
        return np.asarray(q - 2.0 * np.pi * turns)

    def between(self, a: Array, b: Array, share: Array) -> Array:
        """Return coordinates between a and b (B, n), for `share` (B,) from 0 to 1."""
        return np.asarray((1.0 - share)[:, None] * a + share[:, None] * b)

    def distance(self, a: Array, b: Array) -> Array:
        """Return the distance between coordinates (..., n): the largest, in metres or radians."""
        return np.asarray((wrap_magnitude(a - b) if self.turns else np.abs(a - b)).max(axis=-1))


def wrap_magnitude(angle: Array) -> Array:
    """Return the magnitude from 0 to pi of the rotation by an angle in radians."""
    return np.asarray(np.abs(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))))


def check_joint_kind(kind: JointKind) -> None:
    """Raise InputError unless a kind of the user is complete and consistent.

    Examples
    --------
    >>> check_joint_kind(JointKind())
    Traceback (most recent call last):
    ...
    robsim...InputError: JointKind.name: expected a word such as 'helical', got ''
    """
    who = type(kind).__name__
    if not kind.name or not isinstance(kind.name, str):
        raise InputError(
            f"{who}.name: expected a word such as 'helical', got {format_value(kind.name)}"
        )
    if not kind.own:
        raise InputError(f"{who} derives from a kind that is compiled; derive from JointKind")
    for method in ("motion", "twists") if kind.placing is None else ():
        if getattr(type(kind), method) is getattr(JointKind, method):
            raise InputError(f"{who}.{method} is missing")
    _check_coordinate_counts(kind, who)
    for unit in kind.units:
        if unit not in COORDINATE_UNITS:
            raise InputError(
                f"{who}.units: expected {', '.join(COORDINATE_UNITS)}, got {format_value(unit)}"
            )
    starts = (".",) if len(kind.coordinates) > 1 else (".", "")
    for ending in (*kind.coordinates, *kind.velocities):
        if not isinstance(ending, str) or ending[:1] not in starts:
            raise InputError(
                f"{who}: several coordinates need names that begin with a dot, as in "
                f"'.roll', got {format_value(ending)}"
            )


def _check_coordinate_counts(kind: JointKind, who: str) -> None:
    """Raise InputError unless each coordinate has a unit and each velocity a rate."""
    nq, nv = len(kind.coordinates), len(kind.velocities)
    if not nq or not 0 < nv <= 6 or (nq, nv) != (len(kind.units), len(kind.rates)):
        raise InputError(
            f"{who}: expected coordinates and their units, velocities (one to six) and their "
            f"rates, got {kind.coordinates}, {kind.units}, {kind.velocities}, {kind.rates}"
        )
    if kind.placing is not None and not kind.straight and kind.moving is None:
        raise InputError(f"{who}.moving: expected the stage that moves its coordinates, got None")
    if kind.straight and nq != nv:
        raise InputError(f"{who}: {nq} coordinates and {nv} velocities need an integrate(q, v, dt)")
