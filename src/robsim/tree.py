"""The kinematic tree: frames on joints, folded into the constants that the kernels need."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.arrays import Array, frozen
from robsim.curves import Curve
from robsim.errors import FrameError, InputError, suggest
from robsim.joint import GIVEN, SINGLE, Ackermann, Chord, Joint, Mimic, Rolling, Steering
from robsim.kernels import curve as curve_kernels
from robsim.kernels import tree as kernels
from robsim.pose import IDENTITY

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


class Tree:
    """Constants of a tree of frames, in the kernels' form. Body 0 is the world.

    A moving joint starts a new body; its tail and every fixed joint behind it are folded into
    constant offsets, so that only joints that move cost anything.
    """

    def __init__(self, frames: Iterable[Frame]):
        built = _Builder(list(frames))
        self.nq, self.nv = built.nq, built.nv
        self.where: dict[str, tuple[int, Array]] = built.where
        self.joints: kernels.Joints = built.joints()
        # of each move: its velocity, body, whether it turns, axis, ratio; by velocity, then body
        self.moved = _integers(np.array(sorted(built.moves), dtype=np.int64).reshape(-1, 5))
        self.velocity, self.body = self.moved[:, 0], self.moved[:, 1]
        self.cars: tuple[tuple[int, int, Steering], ...] = tuple(built.cars)

    def find(self, name: str) -> tuple[int, Array]:
        """The body that carries a frame, and the frame's constant pose in it."""
        if name not in self.where:
            raise FrameError(f"no frame {name!r}; {suggest(name, self.where, 'frames')}")
        return self.where[name]

    def room(self, runs: int) -> kernels.Bodies:
        """Bodies that are not placed yet."""
        poses = np.empty((len(self.joints.parent), 3, 4, runs))
        return kernels.Bodies(poses, np.empty((self.joints.ratios, runs)))

    def bodies(self, q: Array) -> kernels.Bodies:
        """Where all bodies are at coordinates q[n, b]."""
        out = self.room(q.shape[1])
        kernels.bodies(self.joints, q, out)
        return out

    def frame(self, bodies: kernels.Bodies, name: str) -> Array:
        """T[3, 4, b] of a frame."""
        body, offset = self.find(name)
        T = np.empty(bodies.poses.shape[1:])
        kernels.frame(bodies.poses, body, offset, T)
        return T

    def jacobian(self, bodies: kernels.Bodies, name: str) -> Array:
        """J[6, j, b] of a frame's origin in world axes."""
        J = np.empty((6, self.nv, bodies.poses.shape[3]))
        point = np.ascontiguousarray(self.frame(bodies, name)[:, 3])
        kernels.jacobian(bodies, point, self.moves(self.carried(name)), J)
        return J

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move q[n, b] by velocities v[m, b] held for dt, after cars have steered for them."""
        self.steer(q, v, dt)
        self.roll(q, v, dt)

    def steer(self, q: Array, v: Array, dt: float) -> None:
        """Turn the wheels of cars, as far as they get in a period of dt."""
        for row, velocity, s in self.cars:
            kernels.steer(row, velocity, s.wheelbase, s.limit, s.rate, dt, q, v)

    def roll(self, q: Array, v: Array, seconds: float) -> None:
        """Move q[n, b] by velocities v[m, b], cars as they have steered."""
        kernels.integrate(self.joints, self.driven(q, v), seconds, q)

    def driven(self, q: Array, v: Array) -> Array:
        """The velocities v[m, b] as the steering angles of cars allow them."""
        if self.cars:
            v = v.copy()
        for row, velocity, s in self.cars:
            kernels.obey(row, velocity, s.wheelbase, q, v)
        return v

    def carried(self, name: str) -> Array:
        """1.0 for each move that the frame takes part in, else 0.0."""
        rides: Array = self._ancestry[self.find(name)[0]]
        return rides

    def carries(self, name: str) -> Array:
        """1.0 for each velocity that moves the frame, else 0.0."""
        found = np.zeros(self.nv)
        np.maximum.at(found, self.velocity, self.carried(name))
        return frozen(found)

    def moves(self, sign: Array, columns: NDArray[np.int64] | None = None) -> kernels.Moves:
        """For the kernels: what some velocities move (all by default), each move with its sign."""
        if columns is None:
            columns = _integers(np.arange(self.nv))
        chosen = np.isin(self.velocity, columns)
        rows = self.moved[chosen]
        rows[:, 0] = np.searchsorted(columns, rows[:, 0])
        return kernels.Moves(columns, frozen(rows), frozen(sign[chosen]))

    def alone(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Of each of some velocities, the only coordinate that it changes, or -1."""
        joints = self.joints
        single = np.isin(joints.kind, (kernels.REVOLUTE, kernels.PRISMATIC, kernels.RAIL))
        found = np.full(self.nv, -1)
        mine = single & (joints.iv >= 0)
        found[joints.iv[mine]] = joints.iq[mine]
        return _integers(found[columns])

    @cached_property
    def owners(self) -> NDArray[np.int64]:
        """(nv,) the body whose joint has each velocity."""
        joints, found = self.joints, np.empty(self.nv, dtype=np.int64)
        for body in np.argsort(joints.iv, kind="stable"):
            if joints.iv[body] >= 0:
                found[joints.iv[body] :] = body  # until the next one begins
        return frozen(found)

    @property
    def kinds(self) -> NDArray[np.int64]:
        """(nv,) the kind of that joint, see `robsim.kernels.tree`."""
        kinds: NDArray[np.int64] = self.joints.kind[self.owners]
        return kinds

    @cached_property
    def _ancestry(self) -> Array:
        """[body, move]: whether the move carries the body."""
        parent = self.joints.parent
        rows = np.zeros((len(parent), len(self.body)))
        for i in range(1, len(parent)):
            rows[i] = rows[parent[i]] + (self.body == i)
        return frozen(rows)


@dataclass
class _Builder:
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
        self.bodies: list[tuple[int, int, int, int, int, Array, int, int]] = [
            (0, 0, 0, -1, -1, np.eye(4), 0, 0)
        ]
        self.carriers: list[Frame | None] = [None]  # of each body, the frame with its joint
        self.wheels: list[tuple[int, int, int, int]] = []
        self.wheel_numbers: list[tuple[float, float, float]] = []
        self.ratios = 1 + len(self.ties)
        for frame in _parents_first(self.frames):
            self._add(frame)
        self.tied = [self._tie(i, frame) for i, frame in enumerate(self.ties)]

    def joints(self) -> kernels.Joints:
        """The constants for the kernels."""
        parent, kind, ix, iq, iv, place, which, bend = zip(*self.bodies, strict=True)
        places = frozen(np.ascontiguousarray(np.stack(place)[:, :3]))
        return kernels.Joints(
            *(_integers(parent), _integers(kind), _integers(ix), _integers(iq), _integers(iv)),
            places,
            _integers(which),
            _integers(bend),
            _table(kernels.Ties, self.tied, ("numbers",)),
            self._wheels(),
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
        self.bodies.append((above, _CODE[joint.kind], ix, iq, iv, start, which, bend))
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
            moves = Joint(joint.kind, curve=joint.curve).parts.moves
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

    def _tie(self, i: int, frame: Frame) -> tuple[Any, ...]:
        """A row of `kernels.Ties`."""
        follows, ratio = frame.joint.follows, 1 + i
        assert follows is not None and not isinstance(follows, Rolling)
        source = self.rows[follows.of]
        if isinstance(follows, Mimic):
            numbers = (follows.ratio, follows.offset, 0.0)
            return kernels.MIMIC, source, numbers, 0, 0, ratio
        if isinstance(follows, Ackermann):
            return kernels.ACKERMANN, source, self._stand(frame), 0, 0, ratio
        curve = self.owners[follows.of].joint.curve
        assert curve is not None  # only a rail has a chord
        _check_chord(frame.name, follows, curve)
        which = self._curve(curve)
        numbers = (follows.length, follows.radius, follows.at or follows.length)
        return kernels.CHORD, source, numbers, which, GIVEN.index(follows.gives), ratio

    def _stand(self, frame: Frame) -> tuple[float, float, float]:
        """Wheelbase of the car that a steered wheel is on, and its x and y there."""
        body = self.where[frame.name][0]
        above, start = self.bodies[body][0], self.bodies[body][5]
        carrier = self.carriers[above]
        if carrier is None or carrier.joint.steering is None or abs(start[2, 2] - 1) > UPRIGHT:
            raise InputError(f"'{frame.name}' must stand upright on a car, to steer as its wheel")
        return carrier.joint.steering.wheelbase, float(start[0, 3]), float(start[1, 3])

    def _roll(self, frame: Frame, body: int, row: int, radius: float) -> None:
        """A wheel: where its hub is on its vehicle, and what turns it about the vertical."""
        above, hub, steering = self.bodies[body][0], self.bodies[body][5], -1
        carrier = self.carriers[above]
        if carrier is not None and _is_tied(carrier.joint):
            steering = self.rows[carrier.label]
            _check_upright(frame.name, carrier.joint, self.bodies[above][5])
            aside = float(np.hypot(*hub[:2, 3]))
            if aside > UPRIGHT:
                raise InputError(f"'{frame.name}': its hub is {aside:g} m beside what steers it")
            hub = self.bodies[above][5] @ hub
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

    def _wheels(self) -> kernels.Wheels:
        row, velocity, steering, ratio = np.array(self.wheels, dtype=np.int64).reshape(-1, 4).T
        numbers = frozen(np.array(self.wheel_numbers).reshape(-1, 3))
        return kernels.Wheels(
            *(_integers(row), _integers(velocity), _integers(steering), _integers(ratio)), numbers
        )

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


def _integers(values: ArrayLike) -> NDArray[np.int64]:
    return frozen(np.array(values, dtype=np.int64))


def _table(kind: Callable[..., Any], rows: Sequence[tuple[Any, ...]], real: Sequence[str]) -> Any:
    """A NamedTuple of columns from rows; those named `real` are (rows, 3) numbers."""
    fields = kind._fields  # type: ignore[attr-defined]
    columns = zip(*rows, strict=True) if rows else [()] * len(fields)
    return kind(
        *(
            frozen(np.array(column, dtype=float).reshape(-1, 3))
            if name in real
            else _integers(np.array(column, dtype=np.int64))
            for name, column in zip(fields, columns, strict=True)
        )
    )


def _joined(curves: Sequence[Curve]) -> curve_kernels.Curves:
    pieces = [np.empty((0, 7)), *(curve.pieces for curve in curves)]
    ends = np.cumsum([len(p) for p in pieces])
    lengths = frozen(np.array([curve.length for curve in curves], dtype=float))
    return curve_kernels.Curves(_integers(ends), lengths, frozen(np.concatenate(pieces)))


def _rows(frames: Iterable[Frame], first: dict[str | None, tuple[int, int]]) -> dict[str, int]:
    """The row in q of each coordinate that the tree has of its own, by name."""
    rows: dict[str, int] = {}
    for frame in frames:
        for i, name in enumerate(frame.coordinates):
            rows[name] = first[frame.name][0] + i
    return rows


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
