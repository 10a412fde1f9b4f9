"""Joints: how one frame moves against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, numbers, positive
from robsim.base.errors import InputError, suggest
from robsim.base.names import checked_name
from robsim.base.warned import warn_of_degrees
from robsim.geometry.curves import Curve
from robsim.geometry.pose import IDENTITY, Pose, common_lead, one_pose

Kind = Literal["fixed", "revolute", "prismatic", "floating", "planar", "unicycle", "car", "rail"]


class Parts(NamedTuple):
    """What a kind of joint has of its own; the names follow that of the joint."""

    coordinates: tuple[str, ...] = ()
    units: tuple[str, ...] = ()  # of the coordinates
    velocities: tuple[str, ...] = ()
    rates: tuple[str, ...] = ()  # units of the velocities
    # what the velocities are: (about an axis, which axis of the moving frame)
    moves: tuple[tuple[bool, int], ...] = ()


_IN_PLANE = ".x", ".y", ".theta"
_FORWARD = (".v", ".omega"), ("m/s", "rad/s"), ((False, 0), (True, 2))
KINDS: dict[str, Parts] = {
    "fixed": Parts(),
    "revolute": Parts(("",), ("rad",), ("",), ("rad/s",), ((True, 2),)),
    "prismatic": Parts(("",), ("m",), ("",), ("m/s",), ((False, 2),)),
    "floating": Parts(
        (".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"),
        ("m",) * 3 + ("1",) * 4,
        (".vx", ".vy", ".vz", ".wx", ".wy", ".wz"),
        ("m/s",) * 3 + ("rad/s",) * 3,
        tuple((turns, axis) for turns in (False, True) for axis in range(3)),
    ),
    "planar": Parts(
        _IN_PLANE,
        ("m", "m", "rad"),
        (".vx", ".vy", ".omega"),
        ("m/s", "m/s", "rad/s"),
        ((False, 0), (False, 1), (True, 2)),
    ),
    "unicycle": Parts(_IN_PLANE, ("m", "m", "rad"), *_FORWARD),
    "car": Parts((*_IN_PLANE, ".steering"), ("m", "m", "rad", "rad"), *_FORWARD),
    "rail": Parts(("",), ("m",), ("",), ("m/s",), ((False, 0),)),
}
LIMIT_SLACK = 1e-9  # metres or radians by which rounding may exceed a limit
SINGLE = tuple(kind for kind, parts in KINDS.items() if len(parts.coordinates) == 1)


@dataclass(frozen=True)
class Mimic:
    """A coordinate that follows another: ratio * q_of + offset; `of` is the name of that one.

    >>> Mimic("finger_left").ratio
    1.0
    """

    of: str
    ratio: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        checked_of(self.of)
        for name in ("ratio", "offset"):
            given = numbers(getattr(self, name), f"mimic {name}", ())
            object.__setattr__(self, name, float(given))

    def source_limits(self, limits: tuple[float, float]) -> tuple[float, float]:
        """(lowest, highest) of what it follows, where it is within such limits itself.

        >>> Mimic("finger_left", -2.0, 1.0).source_limits((0.0, 2.0))
        (-0.5, 0.5)
        """
        if self.ratio == 0.0:
            return -np.inf, np.inf
        with np.errstate(over="ignore"):  # what hardly follows has no say
            ends = (np.array(limits) - self.offset) / self.ratio + 0.0
        return float(ends.min()), float(ends.max())


@dataclass(frozen=True)
class Chord:
    """A coordinate of a body that hangs from a rail by two wheels, `length` apart.

    The first wheel touches the curve of the rail joint `of` at its coordinate s, and its centre
    lies `radius` beside the curve (metres, to the left of the way); the centre of the second lies
    `length` from that of the first, as far beside the curve, further along it. A third wheel may
    touch the curve between them, `at` metres along the chord; by default it is the second. What
    the coordinate is:

    "angle"   of the chord, from the tangent at the first wheel (radians)
    "arc"     s of the point where the third wheel touches the curve (metres)
    "height"  of the centre of the third wheel above the chord (metres)
    "tilt"    of the tangent where the third wheel touches, from the chord (radians)

    >>> Chord("rear", 0.4, gives="angle").at
    0.4
    """

    of: str
    length: float
    radius: float = 0.0
    at: float | None = None
    gives: Literal["angle", "arc", "height", "tilt"] = "arc"

    def __post_init__(self) -> None:
        checked_of(self.of)
        put = object.__setattr__
        put(self, "length", positive(self.length, "chord length"))
        put(self, "radius", float(numbers(self.radius, "chord radius", ())))
        at = self.length if self.at is None else positive(self.at, "chord at")
        put(self, "at", at)
        if at > self.length:
            raise InputError(f"chord at must not exceed its length {self.length:g}, got {at:g}")
        if self.gives not in GIVEN:
            hint = suggest(self.gives, GIVEN, "what a chord gives")
            raise InputError(f"a chord gives no {self.gives!r}; {hint}")


GIVEN = ("angle", "arc", "height", "tilt")  # in the order of the kernel's numbers


@dataclass(frozen=True)
class Rolling:
    """The angle of a wheel that rolls without slipping under its vehicle: radius in metres.

    The vehicle is the unicycle or car that carries the wheel, or carries what steers it.

    >>> Rolling(0.1).radius
    0.1
    """

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive(self.radius, "rolling radius"))


@dataclass(frozen=True)
class Ackermann:
    """The angle at which a wheel of a car is turned, by the steering angle in the middle.

    All axles point at the centre of the turn; `of` is the name of the steering coordinate, and
    where the wheel is follows from where its joint stands on the car: in front as a rule.

    >>> Ackermann("body.steering").of
    'body.steering'
    """

    of: str

    def __post_init__(self) -> None:
        checked_of(self.of)


Coupling = Mimic | Chord | Ackermann | Rolling


@dataclass(frozen=True)
class Steering:
    """How a car steers: wheelbase (metres), largest angle (rad), and its rate (rad/s).

    The angle is that of a front wheel in the middle, tan(angle) = wheelbase * omega / v. Between
    periods it changes by no more than rate * dt, and then it is held.

    >>> Steering(0.5).limit
    0.6
    """

    wheelbase: float
    limit: float = 0.6
    rate: float = 1.0

    def __post_init__(self) -> None:
        for name in ("wheelbase", "limit", "rate"):
            object.__setattr__(self, name, positive(getattr(self, name), f"steering {name}"))
        if self.limit >= np.pi / 2:
            raise InputError(f"steering limit must be below a right angle, got {self.limit:g} rad")

    def rates(self, speed: ArrayLike, angle: ArrayLike) -> Array:
        """Velocities (..., 2) = (v, omega) of a car that is told its speed (m/s) and angle (rad).

        omega = v tan(angle)/wheelbase: the rates of a `Motion`, for a car that goes its own way.
        InputError: an angle beyond the limit.

        >>> Steering(0.5).rates(1.0, 0.3).round(6)
        array([1.      , 0.618672])
        """
        v, turned = numbers(speed, "speed (m/s)", ()), numbers(angle, "steering angle (rad)", ())
        if (np.abs(turned) > self.limit).any():
            far = float(turned.flat[np.abs(turned).argmax()])
            raise InputError(f"steering angle {far:g} rad: the limit is {self.limit:g} rad")
        common_lead(v.shape, turned.shape, "speed and steering angle")
        return np.stack(np.broadcast_arrays(v, v * np.tan(turned) / self.wheelbase), axis=-1)


def checked_of(name: object) -> None:
    """InputError unless it can be the name of a coordinate."""
    if not isinstance(name, str) or not name:
        raise InputError(f"of: expected the name of a coordinate, got {name!r:.80}")


@dataclass(frozen=True)
class Joint:
    """place . motion(q) . tail: a constant pose, a motion, a constant pose.

    A revolute joint turns about z and a prismatic one slides along it. A floating joint moves
    freely, a planar one in the plane z = 0; so do a unicycle and a car, which cannot move
    sideways, and a rail, which follows its `curve`, x along it. A car has a `steering`.

    `limits` is (lowest, highest) in radians or metres, None for none, or for a rail for its ends.
    `follows` says that the coordinate depends on others (`Mimic`, `Chord`, `Ackermann`, `Rolling`),
    `name` how it is called where the link's name will not do. `speed` (rad/s or m/s) and `effort`
    (N m or N) are what the drive can do: files keep them, and nothing here is held to them.

    >>> Joint("prismatic", limits=(0.0, 0.5)).limits
    (0.0, 0.5)
    """

    kind: Kind = "fixed"
    place: Pose = IDENTITY
    tail: Pose = IDENTITY
    limits: tuple[float, float] | None = None
    name: str | None = field(default=None, kw_only=True)
    speed: float | None = field(default=None, kw_only=True)
    effort: float | None = field(default=None, kw_only=True)
    curve: Curve | None = field(default=None, kw_only=True)
    steering: Steering | None = field(default=None, kw_only=True)
    follows: Coupling | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            raise InputError(f"no joint kind {self.kind!r}; {suggest(self.kind, KINDS, 'kinds')}")
        for part in ("place", "tail"):
            object.__setattr__(self, part, one_pose(getattr(self, part), f"joint {part}"))
        if self.name is not None:
            checked_name(self.name, "joint")
        for part in ("speed", "effort"):
            if getattr(self, part) is not None:
                object.__setattr__(self, part, positive(getattr(self, part), f"joint {part}"))
                if self.kind not in SINGLE:
                    raise InputError(
                        f"a {self.kind} joint has no {part} of its own; {', '.join(SINGLE)} have"
                    )
        self._check("curve", Curve, "rail")
        self._check("steering", Steering, "car")
        self._check_follows()
        self._check_limits()

    @property
    def parts(self) -> Parts:
        """Its own coordinates and velocities: none where it follows others."""
        own = KINDS[self.kind]
        if self.follows is None:
            return own
        if isinstance(self.follows, Rolling):  # it remembers how far it has rolled
            return own._replace(velocities=(), rates=(), moves=())
        return Parts()

    def within(self, prefix: str) -> Joint:
        """The same in a scene, where names of coordinates begin with that of the robot."""
        if self.follows is None or isinstance(self.follows, Rolling):
            return self
        return replace(self, follows=replace(self.follows, of=f"{prefix}.{self.follows.of}"))

    def _check(self, part: str, expected: type, kind: str) -> None:
        """InputError unless it has this part if it is of this kind, and only then."""
        value = getattr(self, part)
        if (value is not None) != (self.kind == kind):
            lacks = f"a {kind} joint needs a {part}" if value is None else ""
            raise InputError(lacks or f"a {self.kind} joint has no {part}: that is for a {kind}")
        if value is not None and not isinstance(value, expected):
            raise InputError(f"{part}: expected a {expected.__name__}, got {value!r:.80}")

    def _check_follows(self) -> None:
        if self.follows is None:
            return
        if not isinstance(self.follows, Coupling):
            raise InputError(f"follows: expected Mimic, Chord, ..., got {self.follows!r:.80}")
        if self.kind not in SINGLE:
            raise InputError(f"a {self.kind} joint cannot follow others; {', '.join(SINGLE)} can")
        gives = getattr(self.follows, "gives", "")
        turns = isinstance(self.follows, Rolling | Ackermann) or gives in ("angle", "tilt")
        slides = gives in ("arc", "height")
        if (turns and self.kind != "revolute") or (slides and self.kind == "revolute"):
            what = f"{type(self.follows).__name__} gives {'an angle' if turns else 'a length'}"
            raise InputError(f"{what}, and a {self.kind} joint moves otherwise")

    def _check_limits(self) -> None:
        if self.limits is None:
            if self.curve is not None and self.follows is None:
                object.__setattr__(self, "limits", (0.0, self.curve.length))
            return
        if numbers(self.limits, "joint limits", (2,)).ndim != 1:
            raise InputError(f"joint limits must be (lowest, highest), got {self.limits}")
        if self.kind not in SINGLE:
            raise InputError(f"a {self.kind} joint has no limits, got {self.limits}")
        low, high = self.limits
        if not low < high:
            raise InputError(f"joint limits must be (lowest, highest), got {self.limits}")
        if isinstance(self.follows, Chord | Ackermann):
            raise InputError(
                f"limits of a joint that follows by {type(self.follows).__name__} are not looked "
                f"at: limit '{self.follows.of}'"
            )
        if self.kind == "revolute":
            warn_of_degrees(self.limits, "joint limits")
        object.__setattr__(self, "limits", (float(low), float(high)))


FIXED = Joint()


def units_of(joints: Sequence[Joint]) -> tuple[str, ...]:
    """ "rad", "m" or "1" of each coordinate of the joints."""
    return tuple(unit for joint in joints for unit in joint.parts.units)
