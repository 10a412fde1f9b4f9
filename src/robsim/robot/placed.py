"""The stages that place the bodies of a tree, and where in a program their poses stand."""

from __future__ import annotations

from collections.abc import Iterable
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


class Placed:
    """The rows of a program in which the bodies of a tree stand, at coordinates in rows from q.

    `poses` is the first of twelve rows for each body, `ratio` the first of the ratios by which
    velocities move bodies, `motions` that of the poses of joints of the user's kinds.
    """

    def __init__(self, program: Program, joints: Joints, q: int, nq: int) -> None:
        self.program, self.joints, self.q, self.nq = program, joints, q, nq
        bodies, own = len(joints.rows), joints.rows[:, KIND] == kinds.OWN
        self.poses = program.constant(np.tile(np.eye(4)[:3].ravel(), bodies))
        self.ratio = program.constant(np.ones(joints.ratios))
        self.motions = program.rows(12 * int(own.sum()))
        self.place = program.numbers(joints.place, 3)
        self._motion = {
            i: self.motions + 12 * n for n, i in enumerate(np.flatnonzero(own).tolist())
        }
        self._curves = self._kept_curves()

    def add(self) -> None:
        """Add the stages: what depends on others first, then bodies after their parents."""
        self.follow()
        self._stage()
        bodies = range(1, len(self.joints.rows))
        for stage, some in groupby(bodies, lambda i: STAGES.get(int(self.joints.rows[i, KIND]))):
            for each in [list(some)] if stage else [[i] for i in some]:
                self._bodies(stage, each)

    def follow(self) -> None:
        """Add the stages of coordinates that depend on others, and of the ratios of wheels."""
        self._followers = self.program.rows(len(self.joints.ties.rows))
        for i in range(len(self.joints.ties.rows)):
            self._tie(i)
        for row, numbers in zip(*self.joints.wheels, strict=True):
            given = self.program.constant(numbers)
            steering = self._x(row[2]) if row[2] >= 0 else -1
            self.program.add(placing.spin, steering, self.ratio + row[3], given)

    def _stage(self) -> None:
        """Add the stages of the motions and twists of joints of the user's compiled kinds."""
        for each in self.joints.staged:
            stage, numbers = each.member.kind.placing, self.program.constant(each.constants)
            motion, twists = self._motion[each.member.body], self.ratio + each.first
            self.program.add(stage, self.q + each.member.q.start, numbers, motion, twists)

    def take(self, own: OwnMotion, motion: int, twists: int) -> None:
        """Let a joint of a user's kind have its motion and twists from given rows."""
        self._motion[own.member.body] = motion
        self.program.add(copied, own.twists, twists, self.ratio + own.first)

    def prepare(self, own: Iterable[OwnMotion], blocks: Blocks) -> None:
        """Write the motions and twists of joints of the user's kinds."""
        q = blocks.get(self.q, self.nq)
        for each in own:
            motion, twists = each.at(q)
            blocks.put(self._motion[each.member.body], motion)
            blocks.put(self.ratio + each.first, twists)

    def body(self, i: int) -> int:
        """Return the first row of the pose of a body."""
        return self.poses + 12 * i

    def frames(self, some: list[tuple[int, Array]]) -> list[int]:
        """Return the first rows of the poses of frames, each on a body at a constant offset."""
        found, numbers = [], [len(some)]
        for body, offset in some:
            found.append(self.program.rows(12))
            last = offset[:3] if offset.ndim == 2 else runs_last(offset[..., :3, :], 2)
            at = self.program.numbers(last, 2)
            numbers += [self.body(body), at, found[-1]]
        self.program.add(placing.frames, *numbers)
        return found

    def _bodies(self, stage: Stage | None, some: list[int]) -> None:
        numbers = [len(some)]
        for i in some:
            parent, x = self.joints.rows[i, PARENT], self._x(self.joints.rows[i, IX])
            given = self._motion.get(i, x)
            numbers += [self.body(parent), self.place + 12 * i, given, self.body(i)]
        if stage is None:
            (i,) = some
            self._rail(i, numbers[1:])
        else:
            self.program.add(stage, *numbers)

    def _rail(self, i: int, numbers: list[int]) -> None:
        row = self.joints.rows[i]
        bend = self.ratio + row[BEND]
        self.program.add(placing.ride, *self._curves, row[CURVE], *numbers, bend)
        if row[IX] >= self.nq:  # a curvature per metre of a rail that follows another coordinate
            slope = self.joints.ties.rows[row[IX] - self.nq, 2]
            self.program.add(placing.scale, bend, self.ratio + slope)

    def _tie(self, i: int) -> None:
        ties = self.joints.ties
        kind, source, row, which, gives = ties.rows[i]
        above = 0 if source < self.nq else ties.rows[source - self.nq, 2]
        given = self.program.constant(ties.numbers[i])
        rows = (self._x(source), self._followers + i, self.ratio + row, self.ratio + above, given)
        if kind == MIMIC:
            self.program.add(placing.mimic, 1, *rows)
        elif kind == ACKERMANN:
            self.program.add(placing.steer, *rows)
        else:
            self.program.add(placing.hang, *self._curves, *rows, which, gives)

    def _x(self, i: int) -> int:
        """Return the row of a coordinate: of the tree, or of those that depend on others."""
        return self.q + i if i < self.nq else self._followers + i - self.nq

    def _kept_curves(self) -> tuple[int, ...]:
        first, length, pieces = self.joints.curves
        addresses = (self.program.address(array) for array in (first, length, pieces))
        return (*addresses, len(length), len(pieces))


def frame_jacobian(bodies: Bodies, T: Array, moves: Moves) -> Array:
    """Return the Jacobian (6, n, B) of a frame at T (3, 4, B), rows (v, omega) in its own axes."""
    n = moves.columns.size

    def add(program: Program, poses: int, ratio: int, T: int) -> tuple[int]:
        return (add_jacobian(program, poses, ratio, T, moves),)

    (J,) = evaluated(add, [bodies.poses, bodies.ratio, T], [(6, n)])
    return J


def add_base_jacobian(program: Program, poses: int, ratio: int, T: int, moves: Moves) -> int:
    """Add the stages of the Jacobian of a frame at T in axes of the world, and return its rows."""
    here = program.constant(np.eye(3, 4))
    for r in (3, 7, 11):
        program.add(copied, 1, T + r, here + r)
    return add_jacobian(program, poses, ratio, here, moves)


def add_jacobian(program: Program, poses: int, ratio: int, T: int, moves: Moves) -> int:
    """Add the stage of the Jacobian of a frame in its own axes, and return its rows (6, n)."""
    n, J = moves.columns.size, program.rows(6 * moves.columns.size)
    table = np.column_stack([moves.rows, moves.sign]).astype(np.int64)
    program.add(jacobian, poses, ratio, T, J, n, len(table), *table.ravel())
    return J
