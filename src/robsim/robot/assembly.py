"""Conversion of frames on joints to the tables of the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import FrameError, InputError
from robsim.geometry.curves import Curve
from robsim.geometry.pose import IDENTITY
from robsim.kernels.formulas.plane_curves import CurveTable
from robsim.robot.frame import (
    Frame,
    check_coupling_source,
    is_steering_angle,
    sort_coupled_frames,
    sort_parents_first,
)
from robsim.robot.independent_joint import IndependentJoint
from robsim.robot.joint import FIXED, Chord, Joint, Rolling, Steering
from robsim.robot.joints.car import STEERING_ROW
from robsim.robot.joints.couplings import UPRIGHT_TOLERANCE, Coupling
from robsim.robot.joints.joint_kind import JointKind


class Body(NamedTuple):
    """Body of a tree, and the joint that moves it; body 0 is the world."""

    parent: int
    kind: JointKind
    x: int  # first coordinate; independent coordinates are counted first, then dependent ones
    curve: int = 0  # index of the curve of a rail
    bend: int = 0  # index of the ratio that holds the curvature of a rail
    slope: int = 0  # index of the ratio of a rail that follows another coordinate


class DependentCoordinate(NamedTuple):
    """Coordinate that follows another coordinate; dependent coordinate i has the ratio 1 + i."""

    follows: Coupling
    source: int  # row of the other coordinate
    curve: int  # index of the curve of a chord
    numbers: tuple[float, float, float]


class RollingWheel(NamedTuple):
    """Wheel that rolls below its vehicle."""

    q: int  # row of the angle of the wheel
    v: int  # row of the speed of the vehicle; its turn rate is in the next row
    steering: int  # row of the coordinate that steers the wheel, or -1
    ratio: int  # ratio of wheel rate to vehicle speed; the next ratio belongs to the turn rate
    numbers: tuple[float, float, float]  # radius, and x and y of the hub on the vehicle


class JointTables(NamedTuple):
    """Constants of a tree, with one row for each body; body 0 is the world."""

    bodies: tuple[Body, ...]
    place: Array  # (bodies, 3, 4)
    members: tuple[IndependentJoint, ...]  # joints with independent coordinates
    ties: tuple[DependentCoordinate, ...]  # dependent coordinates, sources first
    wheels: tuple[RollingWheel, ...]
    curves: CurveTable
    ratios: int  # number of ratios


@dataclass
class Assembly:
    """Conversion of the frames of a tree to bodies, in the order of the kernels.

    Parents come before their children, and sources before dependent coordinates.
    """

    frames: list[Frame]
    where: dict[str, tuple[int, Array]] = field(default_factory=dict)
    moves: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    cars: list[tuple[int, int, Steering]] = field(default_factory=list)
    members: list[IndependentJoint] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)
    wheels: list[RollingWheel] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.nq = self.nv = 0
        self.first: dict[str, tuple[int, int]] = {}  # first coordinate and velocity by frame
        self.owners: dict[str, Frame] = {}  # frame of each coordinate, by the coordinate's name
        self.rows: dict[str, int] = {}  # row of each coordinate, by its name
        for frame in self.frames:
            self._assign_rows(frame)
        self.where["world"] = (0, IDENTITY.matrix)
        tied = sort_coupled_frames([f for f in self.frames if f.joint.is_coupled])
        self.rows |= {frame.label: self.nq + i for i, frame in enumerate(tied)}
        for frame in tied:
            check_coupling_source(frame, self.owners)
        self.bodies = [Body(0, FIXED.model, 0)]
        self.places = [np.eye(4)]  # pose of the joint of each body in the parent body
        self.carriers: list[Frame | None] = [None]  # frame with the joint of each body
        self.ratios = 1 + len(tied)
        for frame in sort_parents_first(self.frames):
            self._add_frame(frame)
        self.ties = [self._make_dependency(frame) for frame in tied]

    def _assign_rows(self, frame: Frame) -> None:
        """Assign rows of coordinates and velocities to a frame, in the order of declaration."""
        if frame.name in self.first or frame.name == "world":
            raise FrameError(f"two frames are called '{frame.name}'")
        self.first[frame.name] = self.nq, self.nv
        for name in [frame.label] if frame.joint.is_coupled else frame.coordinates:
            if name in self.owners:
                raise FrameError(f"two coordinates are called '{name}'")
            self.owners[name] = frame
        self.rows |= {name: self.nq + i for i, name in enumerate(frame.coordinates)}
        self.nq += len(frame.joint.parts.coordinates)
        self.nv += len(frame.joint.parts.velocities)

    def joints(self) -> JointTables:
        """Return the constants of all joints."""
        return JointTables(
            tuple(self.bodies),
            _stack_places(self.places),
            tuple(self.members),
            tuple(self.ties),
            tuple(self.wheels),
            _stack_curves(self.curves),
            self.ratios,
        )

    def _add_frame(self, frame: Frame) -> None:
        """Add a frame, and the body that moves with it."""
        joint, (above, offset) = frame.joint, self.where[frame.parent]
        start = offset @ joint.place.matrix
        if not joint.moves:
            self.where[frame.name] = (above, make_read_only(start @ joint.tail.matrix))
            return
        body, parts = len(self.bodies), joint.parts
        q, v = self.first[frame.name]
        x = self.rows.get(frame.label, q)  # the first row if a joint has several coordinates
        curve = bend = 0
        if joint.curve is not None:
            curve, bend = self._find_curve_index(joint.curve), self.ratios
            self.ratios += 1
        self.where[frame.name] = (body, joint.tail.matrix)
        slope = max(1 + x - self.nq, 0)
        self.bodies.append(Body(above, joint.model, x, curve, bend, slope))
        self.places.append(start)
        self.carriers.append(frame)
        if parts.coordinates:
            self._add_independent(joint, body, q, v)
        self._add_moves(frame, body, v, bend)
        if joint.steering is not None:
            self.cars.append((q + STEERING_ROW, v, joint.steering))
        if isinstance(joint.follows, Rolling):
            self._add_rolling_wheel(frame, body, q, joint.follows.radius)

    def _add_independent(self, joint: Joint, body: int, q: int, v: int) -> None:
        """Add a joint with independent coordinates, which start at rows q and v."""
        parts = joint.parts
        rows = slice(q, q + len(parts.coordinates)), slice(v, v + len(parts.velocities))
        rolls = joint.follows is not None
        self.members.append(IndependentJoint(body, joint.model, *rows, rolls, self.ratios))
        if joint.model.own:
            moves = self.members[-1].moves
            self.moves += moves
            self.ratios += len(moves)

    def _add_moves(self, frame: Frame, body: int, v: int, bend: int) -> None:
        """Add the motions of a body by its own velocities, or by the velocity that it follows."""
        joint, ratio = frame.joint, 0
        moves: Sequence[tuple[bool, int]] = joint.parts.moves
        if joint.is_coupled:
            root = self._find_root_velocity(frame)
            if root is None:
                return  # the source is a steering angle, which no velocity moves
            v, ratio = root, 1 + self.rows[frame.label] - self.nq
            moves = joint.model.moves
        for i, (turns, axis) in enumerate(moves):
            self.moves.append((v + i, body, int(turns), axis, ratio))
        if bend:
            self.moves.append((v, body, 1, 2, bend))

    def _find_root_velocity(self, frame: Frame) -> int | None:
        """Return the row of the velocity that moves a coordinate, or None if there is none."""
        owner = frame
        while owner.joint.is_coupled:
            name = owner.joint.follows.of  # type: ignore[union-attr]
            owner = self.owners[name]
        return None if is_steering_angle(owner, name) else self.first[owner.name][1]

    def _make_dependency(self, frame: Frame) -> DependentCoordinate:
        """Return the dependence of a coupled coordinate on its source."""
        follows = frame.joint.follows
        assert follows is not None and follows.is_coupled
        curve = self._find_chord_curve(frame) if follows.on_a_curve else 0
        numbers = self._locate_steered_wheel(frame) if follows.on_a_car else follows.constants
        return DependentCoordinate(follows, self.rows[follows.of], curve, numbers)

    def _find_chord_curve(self, frame: Frame) -> int:
        """Return the index of the rail curve of a chord."""
        follows = frame.joint.follows
        assert isinstance(follows, Chord)
        curve = self.owners[follows.of].joint.curve
        assert curve is not None  # only a rail has a chord
        follows.check(frame.name, curve)
        return self._find_curve_index(curve)

    def _locate_steered_wheel(self, frame: Frame) -> tuple[float, float, float]:
        """Return the wheelbase of the car of a steered wheel, and x and y of the wheel."""
        body = self.where[frame.name][0]
        above, start = self.bodies[body].parent, _check_same_in_runs(frame.name, self.places[body])
        carrier = self.carriers[above]
        if (
            carrier is None
            or carrier.joint.steering is None
            or abs(start[2, 2] - 1) > UPRIGHT_TOLERANCE
        ):
            raise InputError(f"'{frame.name}' must stand upright on a car, to steer as its wheel")
        return carrier.joint.steering.wheelbase, float(start[0, 3]), float(start[1, 3])

    def _add_rolling_wheel(self, frame: Frame, body: int, row: int, radius: float) -> None:
        """Add a rolling wheel with the position of its hub on its vehicle and its steering row."""
        above, hub, steering = (
            self.bodies[body].parent,
            _check_same_in_runs(frame.name, self.places[body]),
            -1,
        )
        carrier = self.carriers[above]
        if carrier is not None and carrier.joint.is_coupled:
            steering = self.rows[carrier.label]
            _check_upright_steering(
                frame.name, carrier.joint, _check_same_in_runs(frame.name, self.places[above])
            )
            offset = float(np.hypot(*hub[:2, 3]))
            if offset > UPRIGHT_TOLERANCE:
                raise InputError(
                    f"'{frame.name}': its hub is {offset:g} m beside its steering axis"
                )
            hub = self.places[above] @ hub
            above = self.bodies[above].parent
            carrier = self.carriers[above]
        if carrier is None or not carrier.joint.model.wheeled:
            raise InputError(f"'{frame.name}' rolls, and stands on no vehicle (unicycle or car)")
        if abs(abs(hub[1, 2]) - 1) > UPRIGHT_TOLERANCE:
            raise InputError(f"'{frame.name}': its axis must lie across its vehicle, along y")
        first, v = self.ratios, self.first[carrier.name][1]
        self.ratios += 2
        numbers = radius * float(np.sign(hub[1, 2])), float(hub[0, 3]), float(hub[1, 3])
        self.wheels.append(RollingWheel(row, v, steering, first, numbers))
        self.moves += [(v, body, 1, 2, first), (v + 1, body, 1, 2, first + 1)]

    def _find_curve_index(self, curve: Curve) -> int:
        """Return the index of a curve, which is added if it is new."""
        if curve not in self.curves:
            self.curves.append(curve)
        return self.curves.index(curve)


def _check_same_in_runs(name: str, place: Array) -> Array:
    """Return the pose of a wheel on its vehicle; raise InputError if it differs between runs."""
    if place.ndim > 2:
        raise InputError(f"'{name}': the place of a wheel on its vehicle cannot differ by run")
    return place


def _check_upright_steering(name: str, carrier: Joint, place: Array) -> None:
    """Raise InputError unless the steering joint of a wheel is vertical on its vehicle."""
    if not carrier.model.turns or abs(place[2, 2] - 1) > UPRIGHT_TOLERANCE:
        raise InputError(f"'{name}': its steering joint must turn about the vertical, with z up")


def as_int64(values: ArrayLike) -> NDArray[np.int64]:
    """Return a read-only int64 copy, the type that the compiled kernels accept."""
    return make_read_only(np.array(values, dtype=np.int64))


def _stack_places(places: Sequence[Array]) -> Array:
    """Return poses (bodies, 3, 4), or (bodies, 3, 4, B) if some differ between runs."""
    shape = max((place.shape for place in places), key=len)
    poses = np.stack([np.broadcast_to(place, shape) for place in places])[..., :3, :]
    last = poses if poses.ndim == 3 else np.moveaxis(poses, 1, -1)
    return make_read_only(np.ascontiguousarray(last))


def _stack_curves(curves: Sequence[Curve]) -> CurveTable:
    """Return the tables of all curves for the kernels."""
    pieces = [np.empty((0, 7)), *(curve.pieces for curve in curves)]
    ends = np.cumsum([len(p) for p in pieces])
    lengths = make_read_only(np.array([curve.length for curve in curves], dtype=float))
    return CurveTable(as_int64(ends), lengths, make_read_only(np.concatenate(pieces)))
