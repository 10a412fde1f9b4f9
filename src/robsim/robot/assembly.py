"""From frames on joints to the rows that the kernels need."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, frozen
from robsim.base.errors import FrameError, InputError, suggest
from robsim.geometry.curves import Curve
from robsim.geometry.pose import IDENTITY
from robsim.kernels import curve as curve_kernels
from robsim.kernels import tree as kernels
from robsim.robot.joint import (
    GIVEN,
    KINDS,
    SINGLE,
    Ackermann,
    Chord,
    Joint,
    Mimic,
    Rolling,
    Steering,
)

_CODE = {
    "revolute": kernels.REVOLUTE,
    "prismatic": kernels.PRISMATIC,
    "floating": kernels.FLOATING,
    "planar": kernels.PLANAR,
    "unicycle": kernels.UNICYCLE,
    "car": kernels.CAR,
    "rail": kernels.RAIL,
}
VEHICLES = "unicycle", "car"
UPRIGHT = 1e-9  # how far the axis of a wheel may point from where it should


@dataclass(frozen=True)
class Frame:
    """One frame of the tree: it hangs from `parent` by `joint`."""

    name: str
    parent: str
    joint: Joint

    @property
    def label(self) -> str:
        """What its coordinates are called: as its joint, if that has a name, else as the frame."""
        if self.joint.name is None:
            return self.name
        prefix, dot, _ = self.name.rpartition(".")
        return f"{prefix}{dot}{self.joint.name}"

    @property
    def coordinates(self) -> list[str]:
        """Names of those that it has of its own."""
        return [self.label + part for part in self.joint.parts.coordinates]


@dataclass
class Assembly:
    """Puts the frames of a tree into rows, parents first and sources before what follows them."""

    frames: list[Frame]
    where: dict[str, tuple[int, Array]] = field(default_factory=dict)
    moves: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    cars: list[tuple[int, int, Steering]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.first = _first_indices(self.frames)  # coordinates keep the declared order
        self.nq, self.nv = self.first.pop(None)
        self.where["world"] = (0, IDENTITY.matrix)
        self.owners = _owners(self.frames)
        self.ties = _in_order([f for f in self.frames if _is_tied(f.joint)])
        self.rows = _rows(self.frames, self.first)  # of all coordinates, by name
        self.rows |= {frame.label: self.nq + i for i, frame in enumerate(self.ties)}
        for frame in self.ties:
            _check_source(frame, self.owners)
        self.curves: list[Curve] = []
        self.bodies = [(0, 0, 0, -1, -1, 0, 0)]  # rows of `kernels.Joints`
        self.places = [np.eye(4)]  # of each body in its parent
        self.carriers: list[Frame | None] = [None]  # of each body, the frame with its joint
        self.wheels: list[tuple[int, int, int, int]] = []
        self.wheel_numbers: list[tuple[float, float, float]] = []
        self.ratios = 1 + len(self.ties)
        for frame in _parents_first(self.frames):
            self._add(frame)
        self.tied = [self._tie(i, frame) for i, frame in enumerate(self.ties)]

    def joints(self) -> kernels.Joints:
        """The constants for the kernels."""
        return kernels.Joints(
            _table(self.bodies, 7),
            frozen(np.ascontiguousarray(np.stack(self.places)[:, :3])),
            kernels.Ties(
                _table([row for row, _ in self.tied], 5), _numbers([n for _, n in self.tied])
            ),
            kernels.Wheels(_table(self.wheels, 4), _numbers(self.wheel_numbers)),
            _joined(self.curves),
            self.ratios,
        )

    def _add(self, frame: Frame) -> None:
        """A frame, and the body that moves with it."""
        joint, (above, offset) = frame.joint, self.where[frame.parent]
        start = offset @ joint.place.matrix
        if joint.kind == "fixed":
            self.where[frame.name] = (above, frozen(start @ joint.tail.matrix))
            return
        body, own = len(self.bodies), joint.parts
        q, v = self.first[frame.name]
        iq, iv = (q if own.coordinates else -1), (v if own.velocities else -1)
        ix = self.rows.get(frame.label, q)  # of several coordinates the first
        which = bend = 0
        if joint.curve is not None:
            which, bend = self._curve(joint.curve), self.ratios
            self.ratios += 1
        self.where[frame.name] = (body, joint.tail.matrix)
        self.bodies.append((above, _CODE[joint.kind], ix, iq, iv, which, bend))
        self.places.append(start)
        self.carriers.append(frame)
        self._move(frame, body, iv, bend)
        if joint.steering is not None:
            self.cars.append((iq + 3, iv, joint.steering))
        if isinstance(joint.follows, Rolling):
            self._roll(frame, body, iq, joint.follows.radius)

    def _move(self, frame: Frame, body: int, iv: int, bend: int) -> None:
        """What its own velocities do with the body, or that of the coordinate that it follows."""
        joint, ratio = frame.joint, 0
        moves: Sequence[tuple[bool, int]] = joint.parts.moves
        if _is_tied(joint):
            root = self._root(frame)
            if root is None:
                return  # it follows what no velocity moves: a steering angle
            iv, ratio = root, 1 + self.rows[frame.label] - self.nq
            moves = KINDS[joint.kind].moves
        for i, (turns, axis) in enumerate(moves):
            self.moves.append((iv + i, body, int(turns), axis, ratio))
        if bend:
            self.moves.append((iv, body, 1, 2, bend))

    def _root(self, frame: Frame) -> int | None:
        """The velocity that moves a coordinate, through all that it follows."""
        owner = frame
        while _is_tied(owner.joint):
            name = owner.joint.follows.of  # type: ignore[union-attr]
            owner = self.owners[name]
        return None if _steers(owner, name) else self.first[owner.name][1]

    def _tie(self, i: int, frame: Frame) -> tuple[tuple[int, ...], tuple[float, ...]]:
        """A row of `kernels.Ties`: integers and numbers."""
        follows, ratio = frame.joint.follows, 1 + i
        assert follows is not None and not isinstance(follows, Rolling)
        source = self.rows[follows.of]
        if isinstance(follows, Mimic):
            return (kernels.MIMIC, source, ratio, 0, 0), (follows.ratio, follows.offset, 0.0)
        if isinstance(follows, Ackermann):
            return (kernels.ACKERMANN, source, ratio, 0, 0), self._stand(frame)
        curve = self.owners[follows.of].joint.curve
        assert curve is not None and follows.at is not None  # only a rail has a chord
        _check_chord(frame.name, follows, curve)
        which, gives = self._curve(curve), GIVEN.index(follows.gives)
        numbers = follows.length, follows.radius, follows.at
        return (kernels.CHORD, source, ratio, which, gives), numbers

    def _stand(self, frame: Frame) -> tuple[float, float, float]:
        """Wheelbase of the car that a steered wheel is on, and its x and y there."""
        body = self.where[frame.name][0]
        above, start = self.bodies[body][0], self.places[body]
        carrier = self.carriers[above]
        if carrier is None or carrier.joint.steering is None or abs(start[2, 2] - 1) > UPRIGHT:
            raise InputError(f"'{frame.name}' must stand upright on a car, to steer as its wheel")
        return carrier.joint.steering.wheelbase, float(start[0, 3]), float(start[1, 3])

    def _roll(self, frame: Frame, body: int, row: int, radius: float) -> None:
        """A wheel: where its hub is on its vehicle, and what turns it about the vertical."""
        above, hub, steering = self.bodies[body][0], self.places[body], -1
        carrier = self.carriers[above]
        if carrier is not None and _is_tied(carrier.joint):
            steering = self.rows[carrier.label]
            _check_upright(frame.name, carrier.joint, self.places[above])
            aside = float(np.hypot(*hub[:2, 3]))
            if aside > UPRIGHT:
                raise InputError(f"'{frame.name}': its hub is {aside:g} m beside what steers it")
            hub = self.places[above] @ hub
            above = self.bodies[above][0]
            carrier = self.carriers[above]
        if carrier is None or carrier.joint.kind not in VEHICLES:
            raise InputError(f"'{frame.name}' rolls, and stands on no vehicle (unicycle or car)")
        if abs(abs(hub[1, 2]) - 1) > UPRIGHT:
            raise InputError(f"'{frame.name}': its axis must lie across its vehicle, along y")
        first, v = self.ratios, self.first[carrier.name][1]
        self.ratios += 2
        signed = radius * float(np.sign(hub[1, 2]))
        self.wheels.append((row, v, steering, first))
        self.wheel_numbers.append((signed, float(hub[0, 3]), float(hub[1, 3])))
        self.moves += [(v, body, 1, 2, first), (v + 1, body, 1, 2, first + 1)]

    def _curve(self, curve: Curve) -> int:
        if curve not in self.curves:
            self.curves.append(curve)
        return self.curves.index(curve)


def _is_tied(joint: Joint) -> bool:
    """Whether its coordinate depends on others: that of a rolling wheel is a state of its own."""
    return joint.follows is not None and not isinstance(joint.follows, Rolling)


def _check_source(frame: Frame, owners: dict[str, Frame]) -> None:
    """InputError if a frame follows what does not exist, or what nothing can follow."""
    follows = frame.joint.follows
    name: str = follows.of  # type: ignore[union-attr]
    if name not in owners:
        hint = suggest(name, owners, "coordinates")
        raise InputError(f"'{frame.name}' follows '{name}', and there is none; {hint}")
    source, steers = owners[name].joint, _steers(owners[name], name)
    if isinstance(follows, Ackermann):
        fits, wanted = steers, "the steering angle of a car"
    elif isinstance(follows, Chord):
        fits, wanted = source.kind == "rail" and source.follows is None, "a rail of its own speed"
    else:
        fits = steers or (source.kind in SINGLE and not isinstance(source.follows, Rolling))
        wanted = "one coordinate of one joint, or a steering angle"
    if not fits:
        raise InputError(f"'{frame.name}' must follow {wanted}, and '{name}' is none")


def _steers(owner: Frame, name: str) -> bool:
    """Whether a coordinate of this frame is a steering angle; a link may have that name too."""
    return owner.joint.kind == "car" and name.endswith(".steering")


def _check_upright(name: str, steers: Joint, place: Array) -> None:
    """InputError unless what steers a wheel turns about the vertical of its vehicle."""
    if steers.kind != "revolute" or abs(place[2, 2] - 1) > UPRIGHT:
        raise InputError(f"'{name}': what steers it must turn about the vertical, its z up")


def _check_chord(name: str, chord: Chord, curve: Curve) -> None:
    """InputError where a wheel does not fit into a bend, or no second wheel is so far away.

    Wheel centres beside a circle of curvature k are on one of radius |1/k - radius|. Around half of
    it and more, a chord as long as its diameter would jump from one side to the other.
    """
    sharpest = max(curve.bends, key=lambda k: k * chord.radius)
    if sharpest * chord.radius >= 1.0:
        raise InputError(
            f"'{name}': a wheel of radius {abs(chord.radius):g} m does not fit into a bend of "
            f"radius {1 / abs(sharpest):g} m"
        )
    k, turn = curve.pieces[:, 4], curve.pieces[:, 4] * curve.spans
    short = (np.abs(turn) >= np.pi) & (2.0 * (1.0 - chord.radius * k) <= chord.length * np.abs(k))
    if short.any():
        raise InputError(
            f"'{name}': a chord of {chord.length:g} m does not fit on a circle of radius "
            f"{1 / np.abs(k[short]).max():g} m"
        )


def _names(frame: Frame) -> list[str]:
    return [frame.label] if _is_tied(frame.joint) else frame.coordinates


def _owners(frames: Iterable[Frame]) -> dict[str, Frame]:
    """The frame whose joint has a coordinate, by its name; FrameError if two have one name."""
    found: dict[str, Frame] = {}
    for frame in frames:
        for name in _names(frame):
            if name in found:
                raise FrameError(f"two coordinates are called '{name}'")
            found[name] = frame
    return found


def integers(values: ArrayLike) -> NDArray[np.int64]:
    """A read-only copy, as the kernels are compiled for."""
    return frozen(np.array(values, dtype=np.int64))


def _table(rows: Sequence[Sequence[int]], width: int) -> NDArray[np.int64]:
    return integers(np.array(rows, dtype=np.int64).reshape(-1, width))


def _numbers(rows: Sequence[Sequence[float]]) -> Array:
    return frozen(np.array(rows, dtype=np.float64).reshape(-1, 3))


def _joined(curves: Sequence[Curve]) -> curve_kernels.Curves:
    pieces = [np.empty((0, 7)), *(curve.pieces for curve in curves)]
    ends = np.cumsum([len(p) for p in pieces])
    lengths = frozen(np.array([curve.length for curve in curves], dtype=float))
    return curve_kernels.Curves(integers(ends), lengths, frozen(np.concatenate(pieces)))


def _rows(frames: Iterable[Frame], first: dict[str | None, tuple[int, int]]) -> dict[str, int]:
    """The row in q of each coordinate that the tree has of its own, by name."""
    return {
        name: first[frame.name][0] + i
        for frame in frames
        for i, name in enumerate(frame.coordinates)
    }


def _first_indices(frames: list[Frame]) -> dict[str | None, tuple[int, int]]:
    """Of each frame, its first coordinate and velocity; under None, how many there are."""
    first: dict[str | None, tuple[int, int]] = {}
    nq = nv = 0
    for frame in frames:
        if frame.name in first or frame.name == "world":
            raise FrameError(f"two frames are called '{frame.name}'")
        first[frame.name] = (nq, nv)
        own = frame.joint.parts
        nq, nv = nq + len(own.coordinates), nv + len(own.velocities)
    return {**first, None: (nq, nv)}


def _in_order(tied: list[Frame]) -> list[Frame]:
    """Those that follow others, each after what it follows; names are checked by the robot."""
    source = {frame.label: frame.joint.follows.of for frame in tied}  # type: ignore[union-attr]
    depth: dict[str, int] = {}
    for first in source:
        chain: dict[str, None] = {}  # a set in order
        label = first
        while label in source and label not in depth:
            if label in chain:
                raise InputError(f"'{label}' follows itself")
            chain[label] = None
            label = source[label]
        deepest = depth.get(label, -1) + len(chain)
        depth |= {name: deepest - i for i, name in enumerate(chain)}
    return sorted(tied, key=lambda frame: depth[frame.label])


def _parents_first(frames: list[Frame]) -> list[Frame]:
    """The same frames, each after the one it hangs from."""
    number = {frame.name: i for i, frame in enumerate(frames)}
    hung: dict[str, list[int]] = {}
    for i, frame in enumerate(frames):
        hung.setdefault(frame.parent, []).append(i)
    order: list[int] = []
    layer = hung.pop("world", [])
    while layer:
        order += layer
        layer = sorted(i for k in layer for i in hung.pop(frames[k].name, []))
    if hung:
        lost = frames[min(i for some in hung.values() for i in some)]
        if lost.parent in number:
            raise FrameError(f"'{lost.name}' hangs from itself, through '{lost.parent}'")
        raise FrameError(
            f"'{lost.name}' stands on '{lost.parent}', and there is no such frame; "
            f"{suggest(lost.parent, ['world', *number], 'frames')}"
        )
    return [frames[i] for i in order]
