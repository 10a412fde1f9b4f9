"""Kinematic tree: poses of its frames, and their Jacobians."""

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
from robsim.robot.fk_stages import FKStages, evaluate_frame_jacobian
from robsim.robot.frame import Frame
from robsim.robot.independent_joint import IndependentJoint
from robsim.robot.integration_stages import add_integration, add_wheel_rolling
from robsim.robot.joint import Steering
from robsim.robot.joints.joint_kind import JointKind

RunNumbers = NDArray[np.int64] | None


class Tree:
    """Constants of a tree of frames, in the form of the kernels; body 0 is the world.

    A moving joint starts a new body. Its tail and all fixed joints behind it are folded into
    constant offsets, so only moving joints cost time.
    """

    def __init__(self, frames: Iterable[Frame]):
        assembly = Assembly(list(frames))
        self.nq, self.nv = assembly.nq, assembly.nv
        self.where: dict[str, tuple[int, Array]] = assembly.where
        self.joints: JointTables = assembly.joints()
        self.parent = as_int64([body.parent for body in assembly.bodies])
        self.models: tuple[JointKind, ...] = tuple(body.kind for body in assembly.bodies)
        self.members = self.joints.members  # joints with independent coordinates
        # joints of Python kinds
        self.own: tuple[IndependentJoint, ...] = tuple(
            each for each in self.members if each.is_called
        )
        # rows (velocity, body, whether it turns, axis, ratio), sorted by velocity, then body
        self.moved = as_int64(np.array(sorted(assembly.moves), dtype=np.int64).reshape(-1, 5))
        self.velocity, self.body = self.moved[:, 0], self.moved[:, 1]
        self._frame_moves: dict[str, jacobians.BodyMoves] = {}  # cache by frame
        self._motions: dict[str, ProgramFunction] = {}  # cache by frame
        self.cars: tuple[tuple[int, int, Steering], ...] = tuple(assembly.cars)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out compiled programs: their code addresses are valid in this process only."""
        programs = "_bodies", "_flow"
        rest = {name: value for name, value in vars(self).items() if name not in programs}
        return rest | {"_motions": {}}

    def find(self, name: str) -> tuple[int, Array]:
        """Return the body that carries a frame, and the constant pose of the frame in the body."""
        if not is_known_name(name, self.where):
            raise FrameError(
                f"no frame {format_value(name)}; {suggest_names(name, self.where, 'frames')}"
            )
        return self.where[name]

    def bodies(self, q: Array, runs: RunNumbers = None) -> Bodies:
        """Return the poses of all bodies at coordinates q[n, b].

        If constants differ between runs, the indices `runs` (b,) select the constants of the
        columns of q. Default: all runs.
        """
        values = self._bodies(self._append_python_kinds(q), runs)
        count = 12 * len(self.parent)
        poses = values[:count].reshape(len(self.parent), 3, 4, -1)
        return Bodies(poses, values[count:])

    @cached_property
    def _bodies(self) -> ProgramFunction:
        """Function from coordinates, with motions and twists of Python kinds, to the poses."""
        stages, _ = self._build_program(Program())
        count = 12 * len(self.parent) + self.joints.ratios
        return ProgramFunction(stages.program, stages.q, stages.poses, count)

    def motion(self, name: str, q: Array, v: Array, runs: RunNumbers = None) -> tuple[Array, Array]:
        """Return the pose (3, 4, B) of a frame, and its twist (6, B) in its own axes."""
        if name not in self._motions:
            self._motions[name] = self._build_motion(name)
        values = self._motions[name](np.concatenate([self._append_python_kinds(q), v]), runs)
        return values[:12].reshape(3, 4, -1), values[12:]

    def _build_motion(self, name: str) -> ProgramFunction:
        """Return the function that computes the pose and the twist of a frame."""
        program = Program()
        stages, v = self._build_program(program, self.nv)
        moves = self.moves(self.flag_moves(name))
        (T,) = stages.frames([self.find(name)])
        J = stages.frame_jacobian(T, moves)
        output = program.rows(18)
        program.add(copy_rows, rows=T.flat, to=output[:12])
        program.add(multiply_vector, A=J, x=v, out=output[12:])
        return ProgramFunction(program, stages.q, output, 18)

    def _build_program(self, program: Program, more: int = 0) -> tuple[FKStages, BlockRows]:
        """Return the bodies in a program, and `more` rows after its inputs.

        The inputs are the coordinates, and the motions and twists of joints of Python kinds.
        """
        q = program.rows(self.nq)
        inputs = [(program.rows(3, 4), program.rows(each.twists)) for each in self.own]
        last = program.rows(more)
        stages = FKStages(program, self.joints, q)
        for each, rows in zip(self.own, inputs, strict=True):
            stages.take(each, *rows)
        stages.add()
        return stages, last

    def _append_python_kinds(self, q: Array) -> Array:
        """Return coordinates q, followed by motions and twists of joints of Python kinds."""
        return np.concatenate([q, *(part for each in self.own for part in each.at(q))])

    @cached_property
    def runs(self) -> int:
        """Number of runs with their own constants, or 1."""
        offsets = (len(offset) for _, offset in self.where.values() if offset.ndim > 2)
        places = self.joints.place.shape[3:]
        return max((*offsets, *places), default=1)

    @property
    def compiled(self) -> bool:
        """Whether the whole tree is compiled, without joints of Python kinds."""
        return not self.own

    def frame(self, bodies: Bodies, name: str, runs: RunNumbers = None) -> Array:
        """Return the pose T[3, 4, b] of a frame, for `runs` as in `bodies`."""
        body, offset = self.find(name)
        A, B = bodies.poses[body], move_runs_last(offset, 2)
        B = B if runs is None or offset.ndim == 2 else B[..., runs]
        with np.errstate(all="ignore"):  # failed runs hold NaN
            T: Array = A[:, 0, None] * B[0]
            T = (T + A[:, 1, None] * B[1]) + A[:, 2, None] * B[2]
            T[:, 3] += A[:, 3]
        return T

    def jacobian(self, bodies: Bodies, name: str) -> Array:
        """Return the Jacobian J[6, j, b] of the origin of a frame, in world axes."""
        here = np.repeat(np.eye(3, 4)[..., None], bodies.poses.shape[3], axis=2)
        here[:, 3] = self.frame(bodies, name)[:, 3]
        if name not in self._frame_moves:
            self._frame_moves[name] = self.moves(self.flag_moves(name))
        return evaluate_frame_jacobian(bodies, here, self._frame_moves[name])

    def advance(self, q: Array, v: Array, dt: float) -> None:
        """Move q[n, b] by velocities v[m, b] over dt, after the cars have steered for them."""
        rates = v.copy()
        for row, velocity, s in self.cars:
            motions.turn_steering_angle(row, velocity, s.wheelbase, s.limit, s.rate, dt, q, v)
            motions.set_yaw_rate(row, velocity, s.wheelbase, q, rates)
        self.flow(q, rates, dt)

    def flow(self, q: Array, v: Array, seconds: float) -> None:
        """Move q[n, b] along the motions of velocities v[m, b], without limits of steering."""
        if q.size:
            q[:] = self._flow(np.concatenate([q, v, np.full((1, q.shape[1]), seconds)]))
        for each in self.own:
            each.advance(q, v, seconds)

    def between(self, a: Array, b: Array, share: Array) -> Array:
        """Return coordinates q[n, b] between a and b, for `share` (b,) from 0 to 1."""
        q = np.empty(a.shape)
        for _, kind, rows, *_ in self.members:
            q[rows] = kind.between(a[rows].T, b[rows].T, share).T
        return q

    @cached_property
    def _flow(self) -> ProgramFunction:
        """Function from coordinates, velocities and seconds to the coordinates afterwards."""
        program = Program()
        q, v, dt = program.rows(self.nq), program.rows(self.nv), program.rows()
        if self.joints.wheels:
            stages = FKStages(program, self.joints, q)
            stages.follow()
            add_wheel_rolling(program, self.joints, q, v, stages.ratio, dt)
        add_integration(program, self.joints, q, list(v), dt)
        return ProgramFunction(program, q, q, self.nq)

    def flag_moves(self, name: str) -> Array:
        """Return 1.0 for each move that affects the frame, else 0.0."""
        signs: Array = self._ancestry[self.find(name)[0]]
        return signs

    def carried(self, body: int) -> Array:
        """Return 1.0 for each move that carries a body, else 0.0."""
        signs: Array = self._ancestry[body]
        return signs

    def flag_velocities(self, name: str) -> Array:
        """Return 1.0 for each velocity that moves the frame, else 0.0."""
        signs = np.zeros(self.nv)
        np.maximum.at(signs, self.velocity, self.flag_moves(name))
        return make_read_only(signs)

    def moves(self, sign: Array, columns: NDArray[np.int64] | None = None) -> jacobians.BodyMoves:
        """Return the moves of some velocities with their signs, for the kernels. Default: all."""
        if columns is None:
            columns = as_int64(np.arange(self.nv))
        is_selected = np.zeros(self.nv, dtype=np.bool_)
        is_selected[columns] = True
        chosen = is_selected[self.velocity]
        rows = self.moved[chosen]
        rows[:, 0] = np.searchsorted(columns, rows[:, 0])
        return jacobians.BodyMoves(columns, make_read_only(rows), make_read_only(sign[chosen]))

    def alone(self, columns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the index of the only coordinate that each of some velocities changes, or -1."""
        return as_int64(self._alone[columns])

    @cached_property
    def _alone(self) -> NDArray[np.int64]:
        """Index (nv,) of the only coordinate that each velocity changes, or -1."""
        coordinates = np.full(self.nv, -1)
        for member in self.members:
            if not member.rolls:
                numbers = np.array(member.kind.alone)
                coordinates[member.v] = np.where(numbers >= 0, member.q.start + numbers, -1)
        return as_int64(coordinates)

    @cached_property
    def owners(self) -> NDArray[np.int64]:
        """Body (nv,) with the joint of each velocity."""
        bodies = np.empty(self.nv, dtype=np.int64)
        for member in self.members:
            bodies[member.v] = member.body
        return make_read_only(bodies)

    def kinds(self, columns: NDArray[np.int64]) -> list[JointKind]:
        """Return the kind of the joint of each of some velocities."""
        return [self.models[body] for body in self.owners[columns]]

    @cached_property
    def _ancestry(self) -> Array:
        """Table [body, move] with 1 if the move carries the body, else 0."""
        rows = np.zeros((len(self.parent), len(self.body)))
        for i in range(1, len(self.parent)):
            rows[i] = rows[self.parent[i]] + (self.body == i)
        return make_read_only(rows)
