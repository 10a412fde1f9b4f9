"""Stages of the joints that drives move by torques, in sub-steps of a period."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.engine.driven_joints import DrivenJoints
from robsim.engine.payload_stages import PayloadStages
from robsim.engine.scene_dynamics import place_carriers
from robsim.engine.static_torques import StaticTorques
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.dynamics import joint_drives
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.dynamics_stages import DynamicsStages
from robsim.world.drives.drive_rows import DriveRows

if TYPE_CHECKING:
    from robsim.engine.plant import Plant


class DriveStages:
    """Rows and stages of the driven joints of a scene.

    Attributes
    ----------
    columns : list of int
        Indices of the velocities of the driven joints.
    torque, saturation : BlockRows of shape (nv,)
        Torques in the last sub-step, and shares of the last period in which they were limited;
        zero for other joints.
    unstable : BlockRows
        1 for runs whose joints became unstable.
    """

    def __init__(self, plant: Plant, joints: DrivenJoints) -> None:
        self.plant, self.joints, self.program = plant, joints, plant.program
        self.columns = joints.velocities
        rows, constant, n = self.program.rows, self.program.constant, len(joints.names)
        weights = StaticTorques(joints, plant.start.T)
        bounds = joints.limits[:, None]
        self.load = np.clip(weights.load, -bounds, bounds)  # a heavier load pulls the joint down
        self.torque = self.program.each(self._spread(self.load))
        self.saturation = rows(plant.scene.nv)
        first = self.program.size
        self.v, self.q, self.command, self.hold = (rows(n) for _ in range(4))
        self.net, self.diagonal, self.a, self.h = rows(n), rows(n), rows(n), rows()
        self.unstable, self.count = rows(), constant(float(joints.parts))
        numbers = [joints.numbers(part) for part in ("armature", "damping", "friction")]
        self.armature, self.damping, self.friction = (
            self.program.numbers(each, 1) for each in numbers
        )
        self.dynamics = DynamicsStages(self.program, joints.bodies, self.q)
        self.dynamics.gravity = constant(joints.gravity)
        self.loads = PayloadStages(self.program, joints, self.dynamics, plant.seconds)
        self.drive_rows = self._make_drive_rows(weights)
        self.add_torques = joints.drive.bind(self.drive_rows, plant.numbers)
        if not callable(self.add_torques):
            raise InputError(
                f"{joints.drive.label}.bind: expected a function that adds the stages of a "
                f"sub-step, got {format_value(self.add_torques)}"
            )
        self.held = joints.drive.count_held_substeps(joints.seconds, joints.parts)
        self.state = BlockRows(first, (self.program.size - first,))

    def _spread(self, torques: Array) -> Array:
        """Return torques (n, runs) of the driven joints among those of all joints (nv, runs)."""
        spread = np.zeros((self.plant.scene.nv, torques.shape[1]))
        spread[self.columns] = torques
        return spread

    def _make_drive_rows(self, weights: StaticTorques) -> DriveRows:
        """Return the rows that the drive reads and writes."""
        joints, rows, n = self.joints, self.program.rows, len(self.joints.names)
        return DriveRows(
            self.program,
            joints.names,
            self.plant.seconds,
            joints.parts,
            self.h,
            self.command,
            self.v,
            self.q,
            gap=self.program.each(joints.drive.settle(weights.inertia, self.load, weights.fed)),
            torque=rows(n),
            slope=rows(n),
            saturation=rows(n),
            limits=self.program.constant(joints.limits),
            damping=self.damping,
            friction=self.friction,
            share=self.program.constant(1.0 / joints.parts),
            inertia=weights.inertia,
            load=self.load,
            fed=weights.fed,
            believed=self.loads.believe(self.v, self.armature),
        )

    def add(
        self, dt: BlockRows, q: BlockRows, speed: BlockRows, rates: BlockRows, proceeds: bool
    ) -> None:
        """Add the stages that move the coordinates q of a scene over a time dt.

        `rates` (nv,) are the velocities of the joints that move ideally. Unless the motion
        `proceeds`, the state of the joints is restored afterwards.
        """
        program, drives, state = self.program, self.drive_rows, self.state
        if not proceeds:
            before = program.rows(state.size)
            program.add(copy_rows, rows=state, to=before)
        self._copy(zip([q[i] for i in self.joints.coordinates], self.q, strict=True))
        wanted = [self.plant.wanted[i] for i in self.columns]
        self._copy(zip(wanted, self.command, strict=True))
        plant = self.plant
        place_carriers(program, plant.scene, plant.placed, self.dynamics, rates)
        self.loads.add()
        times = {"parts": self.count, "dt": dt, "h": self.h}
        program.add(joint_drives.begin_substeps, saturation=drives.saturation, **times)
        self._add_substeps()
        self._copy(zip(self.q, [q[i] for i in self.joints.coordinates], strict=True))
        self._copy(zip(self.v, [speed[i] for i in self.columns], strict=True))
        if not proceeds:
            program.add(copy_rows, rows=before, to=state)
            return
        for rows, to in ((drives.torque, self.torque), (drives.saturation, self.saturation)):
            self._copy(zip(rows, [to[i] for i in self.columns], strict=True))

    def _add_substeps(self) -> None:
        """Add the stages of all sub-steps, which are alike but for held torques."""
        calls = self.program.calls
        first = len(calls)
        self.dynamics.place()
        self.add_torques()
        middle = len(calls)
        self._add_motion()
        sampled, held = calls[first:], calls[middle:]
        del calls[first:]
        if self.held > 1:
            self.dynamics.place()
            held = [*calls[first:], *held]
            del calls[first:]
        calls += (sampled + held * (self.held - 1)) * (self.joints.parts // self.held)

    def _add_motion(self) -> None:
        """Add the stages that move the joints by their torques over a sub-step."""
        drives, add = self.drive_rows, self.program.add
        constants = {"armature": self.armature, "damping": self.damping, "friction": self.friction}
        forces = {"torque": drives.torque, "slope": drives.slope, "v": self.v, "hold": self.hold}
        results = {"net": self.net, "diagonal": self.diagonal}
        add(joint_drives.resist_motion, h=self.h, **constants, **forces, **results)
        self.dynamics.add_forward(self.v, self.net, self.diagonal, self.a)
        add(
            joint_drives.advance_joints,
            h=self.h,
            command=self.command,
            friction=self.friction,
            a=self.a,
            v=self.v,
            q=self.q,
            gap=drives.gap,
            hold=self.hold,
            unstable=self.unstable,
        )

    def _copy(self, pairs: Iterable[tuple[BlockRows, BlockRows]]) -> None:
        """Add the stage that copies single rows."""
        self.program.add(joint_drives.copy_single_rows, each=list(pairs))
