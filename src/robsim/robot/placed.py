"""The stages that place the bodies of a tree, and where in a program their poses stand."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from itertools import groupby

import numpy as np

from robsim.base.arrays import Array, runs_last
from robsim.kernels.bodies import placing
from robsim.kernels.control.commanding import copied, jacobian
from robsim.kernels.formulas import joints as kinds
from robsim.kernels.formulas.jacobian import Moves
from robsim.kernels.formulas.ties import ACKERMANN, MIMIC
from robsim.kernels.formulas.tree import BEND, CURVE, IX, KIND, PARENT, Bodies, Joints
from robsim.kernels.machine.program import Blocks, Program, evaluated
from robsim.kernels.machine.rows import Address, Rows
from robsim.kernels.machine.stage import Stage
from robsim.robot.member import OwnMotion

STAGES: dict[int, Stage] = {
    kinds.REVOLUTE: placing.turn,
    kinds.PRISMATIC: placing.slide,
    kinds.FLOATING: placing.fly,
    kinds.PLANAR: placing.glide,
    kinds.UNICYCLE: placing.glide,
    kinds.CAR: placing.glide,
    kinds.OWN: placing.carry,
}
COORDINATES = {  # of joints that have several
    kinds.FLOATING: 7,
    kinds.PLANAR: 3,
    kinds.UNICYCLE: 3,
    kinds.CAR: 3,
}

_STILL = np.eye(3, 4)[None]


class Placed:
    """The rows of a program in which the bodies of a tree stand, at coordinates q (nq,).

    `poses` are those of all bodies, `ratio` the ratios by which velocities move bodies, `motions`
    the poses of joints of the user's kinds.
    """

    def __init__(self, program: Program, joints: Joints, q: Rows) -> None:
        self.program, self.joints, self.q, (self.nq,) = program, joints, q, q.shape
        self._rows = joints.rows.tolist()
        own = [i for i, row in enumerate(self._rows) if row[KIND] == kinds.OWN]
        self.poses = program.constant(np.repeat(_STILL, len(self._rows), axis=0))
        self.ratio = program.constant(np.ones(joints.ratios))
        self.motions = program.rows(len(own), 3, 4)
        self.place = program.numbers(joints.place, 3)
        self._poses, self._places = list(self.poses), list(self.place)  # body by body
        self._motion = dict(zip(own, self.motions, strict=True))

    def add(self) -> None:
        """Add the stages: what depends on others first, then bodies after their parents."""
        self.follow()
        self._stage()
        bodies = range(1, len(self._rows))
        for stage, some in groupby(bodies, lambda i: STAGES.get(self._rows[i][KIND])):
            for each in [list(some)] if stage else [[i] for i in some]:
                self._bodies(stage, each)

    def follow(self) -> None:
        """Add the stages of coordinates that depend on others, and of the ratios of wheels."""
        self._followers = self.program.rows(len(self.joints.ties.rows))
        for i in range(len(self.joints.ties.rows)):
            self._tie(i)
        for (_, _, steered, first), numbers in zip(*self.joints.wheels, strict=True):
            self.program.add(
                placing.spin,
                steering=self._x(steered) if steered >= 0 else None,
                ratio=self.ratio[first : first + 2],
                numbers=self.program.constant(numbers),
            )

    def _stage(self) -> None:
        """Add the stages of the motions and twists of joints of the user's compiled kinds."""
        for each in self.joints.staged:
            self.program.add(
                each.member.kind.placing,
                q=self.q[each.member.q],
                numbers=self.program.constant(each.constants),
                motion=self._motion[each.member.body],
                twists=self._twists(each).reshape(-1, 6),
            )

    def take(self, own: OwnMotion, motion: Rows, twists: Rows) -> None:
        """Let a joint of a user's kind have its motion and twists from given rows."""
        self._motion[own.member.body] = motion
        self.program.add(copied, rows=twists, to=self._twists(own))

    def prepare(self, own: Iterable[OwnMotion], blocks: Blocks) -> None:
        """Write the motions and twists of joints of the user's kinds."""
        q = blocks.get(self.q)
        for each in own:
            motion, twists = each.at(q)
            blocks.put(self._motion[each.member.body], motion)
            blocks.put(self._twists(each), twists)

    def _twists(self, own: OwnMotion) -> Rows:
        return self.ratio[own.first : own.first + own.twists]

    def frames(self, some: list[tuple[int, Array]]) -> list[Rows]:
        """Return the rows of the poses of frames, each on a body at a constant offset."""
        each = []
        for body, offset in some:
            T = self.program.rows(3, 4)
            last = offset[:3] if offset.ndim == 2 else runs_last(offset[..., :3, :], 2)
            each.append((self._poses[body], self.program.numbers(last, 2), T))
        self.program.add(placing.frames, each=each)
        return [T for _, _, T in each]

    def _bodies(self, stage: Stage | None, some: list[int]) -> None:
        each = []
        for i in some:
            row = self._rows[i]
            given = self._motion[i] if i in self._motion else self._coordinates(row)
            each.append((self._poses[row[PARENT]], self._places[i], given, self._poses[i]))
        if stage is None:
            self._rail(some[0], *each[0])
        else:
            self.program.add(stage, each=each)

    def _coordinates(self, row: list[int]) -> Rows:
        """Return the rows of the coordinates that move a body: one, or several of the tree."""
        count, x = COORDINATES.get(row[KIND], 0), row[IX]
        return self.q[x : x + count] if count else self._x(x)

    def _rail(self, i: int, parent: Rows, place: Rows, s: Rows, T: Rows) -> None:
        row = self._rows[i]
        bend = self.ratio[row[BEND]]
        given = {"parent": parent, "place": place, "s": s, "T": T, "curvature": bend}
        self.program.add(placing.ride, **self._curves, which=row[CURVE], **given)
        if row[IX] >= self.nq:  # a curvature per metre of a rail that follows another coordinate
            slope = self.joints.ties.rows[row[IX] - self.nq, 2]
            self.program.add(placing.scale, curvature=bend, slope=self.ratio[slope])

    def _tie(self, i: int) -> None:
        ties, add = self.joints.ties, self.program.add
        kind, source, row, which, gives = ties.rows[i]
        above = 0 if source < self.nq else ties.rows[source - self.nq, 2]
        rows = {
            "source": self._x(source),
            "x": self._followers[i],
            "ratio": self.ratio[row],
            "above": self.ratio[above],
            "numbers": self.program.constant(ties.numbers[i]),
        }
        if kind == MIMIC:
            add(placing.mimic, **rows)
        elif kind == ACKERMANN:
            add(placing.steer, **rows)
        else:
            add(placing.hang, **self._curves, **rows, which=which, what=gives)

    def _x(self, i: int) -> Rows:
        """Return the row of a coordinate: of the tree, or of those that depend on others."""
        return self.q[i] if i < self.nq else self._followers[i - self.nq]

    @cached_property
    def _curves(self) -> dict[str, Address]:
        """The tables of the curves of all rails."""
        tables = zip(("first", "lengths", "pieces"), self.joints.curves, strict=True)
        return {name: self.program.address(array) for name, array in tables}


def frame_jacobian(bodies: Bodies, T: Array, moves: Moves) -> Array:
    """Return the Jacobian (6, n, B) of a frame at T (3, 4, B), rows (v, omega) in its own axes."""

    def add(program: Program, poses: Rows, ratios: Rows, T: Rows) -> tuple[Rows]:
        return (add_jacobian(program, poses, ratios, T, moves),)

    (J,) = evaluated(add, [bodies.poses, bodies.ratio, T], [(6, moves.columns.size)])
    return J


def add_base_jacobian(program: Program, poses: Rows, ratios: Rows, T: Rows, moves: Moves) -> Rows:
    """Add the stages of the Jacobian of a frame at T in axes of the world, and return its rows."""
    here = program.constant(np.eye(3, 4))
    for r in range(3):
        program.add(copied, rows=T[r, 3:], to=here[r, 3:])
    return add_jacobian(program, poses, ratios, here, moves)


def add_jacobian(program: Program, poses: Rows, ratios: Rows, T: Rows, moves: Moves) -> Rows:
    """Add the stage of the Jacobian of a frame in its own axes, and return its rows (6, n)."""
    J = program.rows(6, moves.columns.size)
    table = np.column_stack([moves.rows, moves.sign]).astype(np.int64)
    each = list(map(tuple, table.tolist()))
    program.add(jacobian, poses=poses, ratios=ratios, T_w_c=T, J=J, moves=each)
    return J
