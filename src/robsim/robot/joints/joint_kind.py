"""The base class of kinds of joint: coordinates, motion, sampling and wrapping."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.kernels.bodies.forward_kinematics import place_user_joint
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.stages import CompiledStage

SAMPLE_REACH = 0.5  # metres either way of home, for joints without limits; angles have a full turn
COORDINATE_UNITS = "rad", "m", "1"


class JointParts(NamedTuple):
    """The part of a kind of joint that one has which follows others, named as `JointKind` does."""

    coordinates: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    velocities: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()
    moves: tuple[tuple[bool, int], ...] = ()


class BodyRows(NamedTuple):
    """A body that stages place: the rows that they read and write, and how it is joined."""

    parent: BlockRows
    place: BlockRows
    x: BlockRows  # its first coordinate, or the motion of a user's kind
    pose: BlockRows
    body: Any


class JointKind:
    """The base class of all kinds of joint: how one frame moves against another.

    A kind of the user's own is a frozen dataclass that derives from this; its parameters are its
    fields. It has a `name`, `coordinates` and their `units`, and the methods `motion` and
    `twists`, in plain NumPy with the run first, called from several threads with a part of the
    runs each. Arrays of coordinates q are (B, n), in the order of `coordinates`.

    name         as in messages, and in files once it is registered
    coordinates  what follows the name of the joint: ("",) for one, (".roll", ".pitch") for several
    units        of each: "rad", "m" or "1"
    velocities   likewise; those of the coordinates where they are not given
    rates        units of the velocities, "rad/s" or "m/s"
    moves        of RobSim's kinds what each velocity is: (whether it turns, about or along which
                 axis of the moving frame)
    straight     whether each velocity is the rate of one coordinate: so it is where a kind has no
                 `integrate` of its own
    turns        whether it only turns about its z axis by its coordinate, so that a whole turn
                 changes nothing
    roams        whether it flies or drives about, as no part of an arm does
    wheeled      whether it cannot move sideways, (v, omega) being its velocities
    free         whether its coordinates are a pose: a position and a unit quaternion
    follower     whether its coordinate may depend on others, as `Mimic` does
    rowed        whether a Denavit-Hartenberg row gives its constants
    needs        the field that its `Joint` must have: "curve", "steering" or none
    placing      the compiled stage that computes motion and twists instead of the methods, from
                 the coordinates and the `constants` of the joint
    moving       likewise the stage that moves the coordinates by velocities that are held; without
                 it, if `placing` is given, each velocity is the rate of one coordinate
    moved        how many of its coordinates `moving` moves, the first ones; None: all
    fused        of RobSim's kinds the stage that places bodies at once, from their first
                 coordinates
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
        """Fill in the attributes that follow from those that the class defines."""
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
        """Whether it is of the user's own: its motion comes first, and then is carried along."""
        return self.fused is place_user_joint

    @property
    def single(self) -> bool:
        """Whether it has one coordinate, with limits and a drive of its own."""
        return len(self.coordinates) == 1 and self.straight

    @property
    def alone(self) -> tuple[int, ...]:
        """The only coordinate that each velocity changes, by number, or -1."""
        count = len(self.velocities)
        return tuple(range(count)) if self.straight else (-1,) * count

    @property
    def constants(self) -> tuple[float, ...]:
        """The numbers that its stages are given: those of its fields."""
        own: tuple[Any, ...] = fields(self) if is_dataclass(self) else ()
        return tuple(float(getattr(self, each.name)) for each in own)

    def motion(self, q: Array) -> Array:
        """Return the pose (B, 4, 4) of the moved frame in the frame of the joint."""
        raise InputError(f"the motion of a {self.name} joint is compiled; ask Robot.fk")

    def twists(self, q: Array) -> Array:
        """Return the twist (B, nv, 6) of the moved frame for a unit of each velocity.

        (v, omega) at the origin of the moved frame and in its own axes: V of T^-1 dT/dt.
        """
        raise InputError(f"the twists of a {self.name} joint are compiled; ask Robot.jacobian")

    def integrate(self, q: Array, v: Array, dt: float) -> Array:
        """Return coordinates (B, n) after velocities v (B, nv) were held for dt seconds."""
        return q + v * dt

    def add_placing(self, placed: Any, bodies: Iterable[BodyRows]) -> None:
        """Add the stage that places bodies on joints of this kind."""
        placed.program.add(self.fused, each=[tuple(each[:4]) for each in bodies])

    @property
    def rest(self) -> Array:
        """The coordinates (n,) of a joint at rest."""
        return np.zeros(len(self.coordinates))

    def span(self, part: Any) -> tuple[float, float] | None:
        """Return the default limits of its coordinate; `part` is the part that the kind needs."""
        return None

    def ranges(self, limits: tuple[float, float] | None, part: Any) -> Array:
        """Return the lowest and highest value (n, 2) of each coordinate, or infinity.

        `limits` are those of the joint, which only a kind of one coordinate has, and `part` is the
        curve or the steering of a kind that needs one.
        """
        rows = np.empty((len(self.coordinates), 2))
        rows[:] = (-np.inf, np.inf) if limits is None else limits
        return rows

    def checked(self, q: Array, what: str, name: str) -> Array:
        """Return coordinates (..., n) as they are used; raise InputError if they cannot be."""
        return q

    def sample(self, share: Array, home: Array, limits: Array) -> Array:
        """Return random coordinates (B, n), uniform within limits (n, 2).

        A coordinate without a limit stays within half a metre or half a turn of home (n,). `share`
        (B, n) are uniform numbers in (0, 1).
        """
        reach = np.where(np.array(self.units) == "rad", np.pi, SAMPLE_REACH)[:, None] * [-1.0, 1.0]
        low, high = np.where(np.isfinite(limits), limits, home[:, None] + reach).T
        return np.asarray(low + (high - low) * share)

    def wrap(self, q: Array, limits: Array) -> Array:
        """Return coordinates (B, n) of the same pose, within limits (n, 2) where that helps."""
        low, high = limits.T
        if not self.turns or not np.isfinite(limits).all():
            return q
        turns = np.round((q - 0.5 * (low + high)) / (2.0 * np.pi))
        return np.asarray(q - 2.0 * np.pi * turns)

    def between(self, a: Array, b: Array, share: Array) -> Array:
        """Return coordinates on the way from a to b (B, n), where `share` (B,) goes from 0 to 1."""
        return np.asarray((1.0 - share)[:, None] * a + share[:, None] * b)

    def distance(self, a: Array, b: Array) -> Array:
        """Return the distance between coordinates (..., n), the largest in metres or radians."""
        return np.asarray((wrap_magnitude(a - b) if self.turns else np.abs(a - b)).max(axis=-1))


def wrap_magnitude(angle: Array) -> Array:
    """Return the equivalent rotation, from 0 to pi, of an angle."""
    return np.asarray(np.abs(angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))))


def check_joint_kind(kind: JointKind) -> None:
    """Raise InputError unless a kind of the user's own is complete and consistent."""
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
                f"{who}: names of several coordinates follow that of the joint after a dot, as in "
                f"'.roll', got {format_value(ending)}"
            )


def _check_coordinate_counts(kind: JointKind, who: str) -> None:
    """Raise InputError unless each coordinate has a unit, and each velocity a rate."""
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
