"""Stages of forward kinematics, and the rows of a program that hold the poses of bodies."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import groupby

import numpy as np

from robsim.base.arrays import Array, move_runs_last
from robsim.kernels.bodies import forward_kinematics
from robsim.kernels.control.control_law import compute_camera_jacobian, copy_rows
from robsim.kernels.formulas.body_arrays import Bodies
from robsim.kernels.formulas.jacobian import BodyMoves
from robsim.kernels.machine.block_rows import Address, BlockRows
from robsim.kernels.machine.program import Blocks, Program, evaluate_stages
from robsim.robot.assembly import JointTables
from robsim.robot.independent_joint import IndependentJoint
from robsim.robot.joints.joint_kind import BodyRows

_IDENTITY_POSE = np.eye(3, 4)[None]
_NO_POSES: Mapping[int, Array] = {}


class FKStages:
    """Rows of a program with the poses of the bodies of a tree, at coordinates q (nq,).

    Parameters
    ----------
    program : Program
        Program that the stages are added to.
    joints : JointTables
        Constants of the tree.
    q : Rows of shape (nq,)
        Coordinates.
    still : dict, optional
        Constant poses (3, 4) by body. No stage places these bodies.

    Attributes
    ----------
    poses : Rows of shape (bodies, 3, 4)
        Poses of all bodies in the world.
    ratio : Rows of shape (ratios,)
        Ratios between the velocities of coordinates and the motions of bodies.
    """

    def __init__(
        self,
        program: Program,
        joints: JointTables,
        q: BlockRows,
        still: Mapping[int, Array] = _NO_POSES,
    ) -> None:
        self.program, self.joints, self.q, (self.nq,) = program, joints, q, q.shape
        own = [each for each in joints.members if each.kind.own]
        self._python_joints = [each for each in own if each.is_called]
        poses = np.repeat(_IDENTITY_POSE, len(joints.bodies), axis=0)
        for body, pose in still.items():
            poses[body] = pose
        self.poses, self._still = program.constant(poses), still.keys()
        self.ratio = program.constant(np.ones(joints.ratios))
        motions = program.rows(len(own), 3, 4)
        self.place = program.numbers(joints.place, 3)
        self._poses, self._places = list(self.poses), list(self.place)  # one per body
        self._motion_rows = {each.body: rows for each, rows in zip(own, motions, strict=True)}
        self._jacobians: dict[tuple[int | bytes, ...], BlockRows] = {}

    def add(self) -> None:
        """Add the stages: dependent coordinates first, then bodies after their parents."""
        if self._python_joints:
            self.program.call(self._evaluate_python_kinds)
        self.follow()
        self._add_compiled_kinds()
        moved = (i for i in range(1, len(self.joints.bodies)) if i not in self._still)
        bodies = [self._collect_body_rows(i) for i in moved]
        for _, members in groupby(bodies, lambda each: each.body.kind.fused):
            group = list(members)
            group[0].body.kind.add_placing(self, group)

    def follow(self) -> None:
        """Add the stages of dependent coordinates, and of the ratios of rolling wheels."""
        self._followers = self.program.rows(len(self.joints.ties))
        for i, tie in enumerate(self.joints.ties):
            source_ratio = max(1 + tie.source - self.nq, 0)
            tie.follows.add_stages(
                self,
                tie.curve,
                source=self._coordinate_row(tie.source),
                x=self._followers[i],
                ratio=self.ratio[1 + i],
                source_ratio=self.ratio[source_ratio],
                numbers=self.program.constant(tie.numbers),
            )
        for wheel in self.joints.wheels:
            self.program.add(
                forward_kinematics.compute_wheel_ratios,
                steering=self._coordinate_row(wheel.steering) if wheel.steering >= 0 else None,
                ratio=self.ratio[wheel.ratio : wheel.ratio + 2],
                numbers=self.program.constant(wheel.numbers),
            )

    def _add_compiled_kinds(self) -> None:
        """Add the stages of the motions and twists of joints of compiled user kinds."""
        for each in self.joints.members:
            if each.kind.placing is not None:
                self.program.add(
                    each.kind.placing,
                    q=self.q[each.q],
                    numbers=self.program.constant(each.constants),
                    motion=self._motion_rows[each.body],
                    twists=self._twist_rows(each).reshape(-1, 6),
                )

    def take(self, own: IndependentJoint, motion: BlockRows, twists: BlockRows) -> None:
        """Use these rows as motion and twists of a joint of a Python kind."""
        self._motion_rows[own.body] = motion
        self.program.add(copy_rows, rows=twists, to=self._twist_rows(own))
        self._python_joints.remove(own)

    def _evaluate_python_kinds(self, blocks: Blocks, step: int) -> None:
        """Write the motions and twists of joints of Python kinds."""
        q = blocks.get(self.q)
        for each in self._python_joints:
            motion, twists = each.at(q)
            blocks.put(self._motion_rows[each.body], motion)
            blocks.put(self._twist_rows(each), twists)

    def _twist_rows(self, own: IndependentJoint) -> BlockRows:
        """Return the rows of the twists of a joint of a user's kind."""
        return self.ratio[own.first : own.first + own.twists]

    def frames(self, some: list[tuple[int, Array]]) -> list[BlockRows]:
        """Return the rows of the poses of frames (body, constant pose of the frame in the body)."""
        each = []
        for body, offset in some:
            T = self.program.rows(3, 4)
            last = offset[:3] if offset.ndim == 2 else move_runs_last(offset[..., :3, :], 2)
            each.append((self._poses[body], self.program.numbers(last, 2), T))
        self.program.add(forward_kinematics.compose_frames, each=each)
        return [T for _, _, T in each]

    def frame_jacobian(self, T: BlockRows, moves: BodyMoves) -> BlockRows:
        """Return the rows of the Jacobian (6, n) of a frame at T, in its own axes.

        A second call for the same rows and velocities adds no stage.
        """
        key = int(T), moves.rows.tobytes(), moves.sign.tobytes(), moves.columns.size
        if key not in self._jacobians:
            J = _add_jacobian_stage(self.program, self.poses, self.ratio, T, moves)
            self._jacobians[key] = J
        return self._jacobians[key]

    def base_jacobian(self, T: BlockRows, moves: BodyMoves) -> BlockRows:
        """Return the rows of the Jacobian (6, n) of a frame at T, in axes of the world."""
        here = self.program.constant(np.eye(3, 4))
        for r in range(3):
            self.program.add(copy_rows, rows=T[r, 3:], to=here[r, 3:])
        return _add_jacobian_stage(self.program, self.poses, self.ratio, here, moves)

    def _collect_body_rows(self, i: int) -> BodyRows:
        """Return the rows of a body, its parent and its joint."""
        body = self.joints.bodies[i]
        x = self._motion_rows[i] if i in self._motion_rows else self._coordinate_row(body.x)
        return BodyRows(self._poses[body.parent], self._places[i], x, self._poses[i], body)

    def _coordinate_row(self, i: int) -> BlockRows:
        """Return the row of an independent or dependent coordinate."""
        return self.q[i] if i < self.nq else self._followers[i - self.nq]

    @cached_property
    def curves(self) -> dict[str, Address]:
        """Tables of the curves of all rails."""
        tables = zip(("first", "lengths", "pieces"), self.joints.curves, strict=True)
        return {name: self.program.address(array) for name, array in tables}


def evaluate_frame_jacobian(bodies: Bodies, T: Array, moves: BodyMoves) -> Array:
    """Return the Jacobian (6, n, B) of a frame at T (3, 4, B), rows (v, omega) in its own axes."""

    def add(
        program: Program, poses: BlockRows, ratios: BlockRows, T: BlockRows
    ) -> tuple[BlockRows]:
        return (_add_jacobian_stage(program, poses, ratios, T, moves),)

    (J,) = evaluate_stages(add, [bodies.poses, bodies.ratio, T], [(6, moves.columns.size)])
    return J


def _add_jacobian_stage(
    program: Program, poses: BlockRows, ratios: BlockRows, T: BlockRows, moves: BodyMoves
) -> BlockRows:
    """Add the stage of the Jacobian of a frame in its own axes, and return its rows (6, n)."""
    J = program.rows(6, moves.columns.size)
    table = np.column_stack([moves.rows, moves.sign]).astype(np.int64)
    each = list(map(tuple, table.tolist()))
    program.add(compute_camera_jacobian, poses=poses, ratios=ratios, T_w_c=T, J=J, moves=each)
    return J
