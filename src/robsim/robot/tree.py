"""The kinematic tree: the poses of its frames, and their Jacobians."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only, move_runs_last
from robsim.base.errors import FrameError, format_value, is_known_name, suggest_names
from robsim.kernels.control.control_law import copy_rows, multiply_vector
from robsim.kernels.formulas import jacobian as jacobians
from robsim.kernels.formulas import vehicle_motion as motions
from robsim.kernels.formulas.body_arrays import Bodies
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.robot.assembly import Assembly, JointTables, as_int64
from robsim.robot.fk_stages import FKStages, add_jacobian_stage, evaluate_frame_jacobian
from robsim.robot.frame import Frame
from robsim.robot.independent_joint import IndependentJoint
from robsim.robot.integration_stages import add_integration, add_wheel_rolling
from robsim.robot.joint import Steering
from robsim.robot.joints.joint_kind import JointKind

RunNumbers = NDArray[np.int64] | None


class Tree:
    """The constants of a tree of frames, in the kernels' form; body 0 is the world.

    A moving joint starts a new body; its tail and every fixed joint behind it are folded into
    constant offsets, so that only joints that move cost anything.
    """

    def __init__(self, frames: Iterable[Frame]):
        built = Assembly(list(frames))
        self.nq, self.nv = built.nq, built.nv
        self.where: dict[str, tuple[int, Array]] = built.where
        self.joints: JointTables = built.joints()
        self.parent = as_int64([body.parent for body in built.bodies])
        self.models: tuple[JointKind, ...] = tuple(body.kind for body in built.bodies)
        self.members = self.joints.members  # joints with own coordinates
        # those of kinds of the user's own in Python
        self.own: tuple[IndependentJoint, ...] = tuple(
            each for each in self.members if each.is_called
        )
        # of each move: its velocity, body, whether it turns, axis, ratio; by velocity, then body
        self.moved = as_int64(np.array(sorted(built.moves), dtype=np.int64).reshape(-1, 5))
        self.velocity, self.body = self.moved[:, 0], self.moved[:, 1]
        self._moves_of: dict[str, jacobians.BodyMoves] = {}  # by frame, computed once
        self._motions: dict[str, ProgramFunction] = {}  # by frame, made once
        self.cars: tuple[tuple[int, int, Steering], ...] = tuple(built.cars)

    def __getstate__(self) -> dict[str, Any]:
        """Return all but the programs, whose machine code is that of one process."""
        made = "_bodies", "_flow"
        rest = {name: value for name, value in vars(self).items() if name not in made}
        return rest | {"_motions": {}}

    def find(self, name: str) -> tuple[int, Array]:
        """Return the body that carries a frame, and the frame's constant pose in it."""
        if not is_known_name(name, self.where):
            raise FrameError(
                f"no frame {format_value(name)}; {suggest_names(name, self.where, 'frames')}"
            )
        return self.where[name]

    def bodies(self, q: Array, runs: RunNumbers = None) -> Bodies:
        """Return the poses of all bodies at coordinates q[n, b], which are those of `runs` (b,).

        These matter where constants differ from run to run; by default all runs come in order.
        """
        found = self._bodies(self._with_own(q), runs)
        count = 12 * len(self.parent)
        poses = found[:count].reshape(len(self.parent), 3, 4, -1)
        return Bodies(poses, found[count:])

    @cached_property
    def _bodies(self) -> ProgramFunction:
        """The poses and ratios from coordinates, and the motions and twists of own kinds."""
        placed, _ = self._placed(Program())
        count = 12 * len(self.parent) + self.joints.ratios
        return ProgramFunction(placed.program, placed.q, placed.poses, count)

    def motion(self, name: str, q: Array, v: Array, runs: RunNumbers = None) -> tuple[Array, Array]:
        """Return the pose (3, 4, B) of a frame, and its twist (6, B) in its own axes."""
        if name not in self._motions:
            self._motions[name] = self._motion(name)
        found = self._motions[name](np.concatenate([self._with_own(q), v]), runs)
        return found[:12].reshape(3, 4, -1), found[12:]

    def _motion(self, name: str) -> ProgramFunction:
        program = Program()
        placed, v = self._placed(program, self.nv)
        moves = self.moves(self.carried(name))
        (T,) = placed.frames([self.find(name)])
        J = add_jacobian_stage(program, placed.poses, placed.ratio, T, moves)
        found = program.rows(18)
        program.add(copy_rows, rows=T.flat, to=found[:12])
        program.add(multiply_vector, A=J, x=v, out=found[12:])
        return ProgramFunction(program, placed.q, found, 18)

    def _placed(self, program: Program, more: int = 0) -> tuple[FKStages, BlockRows]:
        """Return the bodies in a program, from coordinates and what own kinds say of them.

        With some more rows that are given, below them.
        """
        q = program.rows(self.nq)
        given = [(program.rows(3, 4), program.rows(each.twists)) for each in self.own]
        last = program.rows(more)
        placed = FKStages(program, self.joints, q)
        for each, rows in zip(self.own, given, strict=True):
            placed.take(each, *rows)
        placed.add()
        return placed, last

    def _with_own(self, q: Array) -> Array:
        """Return coordinates q, and below them what joints of own kinds say of them."""
        return np.concatenate([q, *(part for each in self.own for part in each.at(q))])

    @cached_property
    def runs(self) -> int:
        """The number of runs of which each has constants of its own, or 1."""
        offsets = (len(offset) for _, offset in self.where.values() if offset.ndim > 2)
        places = self.joints.place.shape[3:]
        return max((*offsets, *places), default=1)

    @property
    def compiled(self) -> bool:
        """Whether the whole tree is compiled: no joint is of a user's own kind."""
        return not self.own

    def frame(self, bodies: Bodies, name: str, runs: RunNumbers = None) -> Array:
        """Return the pose T[3, 4, b] of a frame, of `runs` as in `bodies`."""
        body, offset = self.find(name)
        A, B = bodies.poses[body], move_runs_last(offset, 2)
        B = B if runs is None or offset.ndim == 2 else B[..., runs]
        with np.errstate(all="ignore"):  # a run that went wrong is data
            T: Array = A[:, 0, None] * B[0]
            T = (T + A[:, 1, None] * B[1]) + A[:, 2, None] * B[2]
            T[:, 3] += A[:, 3]
        return T

    def jacobian(self, bodies: Bodies, name: str) -> Array:
        """Return the Jacobian J[6, j, b] of a frame's origin in world axes."""
        here = np.repeat(np.eye(3, 4)[..., None], bodies.poses.shape[3], axis=2)
        here[:, 3] = self.frame(bodies, name)[:, 3]
        if name not in self._moves_of:
            self._moves_of[name] = self.moves(self.carried(name))
        return evaluate_frame_jacobian(bodies, here, self._moves_of[name])

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move q[n, b] by velocities v[m, b] held for dt, after the cars have steered for them."""
        rates = v.copy()
        for row, velocity, s in self.cars:
            motions.turn_steering_angle(row, velocity, s.wheelbase, s.limit, s.rate, dt, q, v)
            motions.set_yaw_rate(row, velocity, s.wheelbase, q, rates)
        self.flow(q, rates, dt)

    def flow(self, q: Array, v: Array, seconds: float) -> None:
        """Move q[n, b] along the motions of velocities v[m, b], without the limits of steering."""
        if q.size:
            q[:] = self._flow(np.concatenate([q, v, np.full((1, q.shape[1]), seconds)]))
        for each in self.own:
            each.advance(q, v, seconds)

    @cached_property
    def _flow(self) -> ProgramFunction:
        """The coordinates after velocities were held, from both and the seconds."""
        program = Program()
        q, v, dt = program.rows(self.nq), program.rows(self.nv), program.rows()
        if self.joints.wheels:
            placed = FKStages(program, self.joints, q)
            placed.follow()
            add_wheel_rolling(program, self.joints, q, v, placed.ratio, dt)
        add_integration(program, self.joints, q, list(v), dt)
        return ProgramFunction(program, q, q, self.nq)

    def carried(self, name: str) -> Array:
        """Return 1.0 for each move that affects the frame, else 0.0."""
        rides: Array = self._ancestry[self.find(name)[0]]
        return rides

    def carries(self, name: str) -> Array:
        """Return 1.0 for each velocity that moves the frame, else 0.0."""
        found = np.zeros(self.nv)
        np.maximum.at(found, self.velocity, self.carried(name))
        return make_read_only(found)

    def moves(self, sign: Array, columns: NDArray[np.int64] | None = None) -> jacobians.BodyMoves:
        """Return the moves of some velocities (default: all) with their signs, for the kernels."""
        if columns is None:
            columns = as_int64(np.arange(self.nv))
        wanted = np.zeros(self.nv, dtype=np.bool_)
        wanted[columns] = True
        chosen = wanted[self.velocity]
        rows = self.moved[chosen]
        rows[:, 0] = np.searchsorted(columns, rows[:, 0])
        return jacobians.BodyMoves(columns, make_read_only(rows), make_read_only(sign[chosen]))

    def alone(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the only coordinate that each of some velocities changes, or -1."""
        return as_int64(self._alone[columns])

    @cached_property
    def _alone(self) -> NDArray[np.int64]:
        """The only coordinate (nv,) that each velocity changes, or -1."""
        found = np.full(self.nv, -1)
        for member in self.members:
            if not member.rolls:
                numbers = np.array(member.kind.alone)
                found[member.v] = np.where(numbers >= 0, member.q.start + numbers, -1)
        return as_int64(found)

    @cached_property
    def owners(self) -> NDArray[np.int64]:
        """The body (nv,) whose joint has each velocity."""
        found = np.empty(self.nv, dtype=np.int64)
        for member in self.members:
            found[member.v] = member.body
        return make_read_only(found)

    def kinds(self, columns: NDArray[np.int64]) -> list[JointKind]:
        """Return the kind of the joint that has each of some velocities."""
        return [self.models[body] for body in self.owners[columns]]

    @cached_property
    def _ancestry(self) -> Array:
        """The table [body, move] of whether the move carries the body."""
        rows = np.zeros((len(self.parent), len(self.body)))
        for i in range(1, len(self.parent)):
            rows[i] = rows[self.parent[i]] + (self.body == i)
        return make_read_only(rows)
