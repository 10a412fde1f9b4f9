"""Stages of the loads that driven joints carry, and of the model that a drive has of them."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import scale_runs
from robsim.engine.driven_joints import DrivenJoints, count_periods_until
from robsim.kernels.dynamics import joint_drives
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.dynamics_stages import DynamicsStages
from robsim.world.drives.believed_dynamics import BelievedDynamics

NEVER = np.iinfo(np.int32).max  # a step beyond the end of every run


class PayloadStages:
    """Rows and stages of the inertias of the bodies, true and believed."""

    def __init__(
        self, program: Program, joints: DrivenJoints, dynamics: DynamicsStages, dt: float
    ) -> None:
        self.program, self.joints, self.dynamics, self.dt = program, joints, dynamics, dt
        self.model = joints.drive.model
        self.bare = program.numbers(joints.bodies.inertias, 2)
        self.knows_payload = self.model.payload and bool(joints.payloads)
        self.mass = program.number(self.model.mass)
        self.believed = self._believe_inertias()

    def _believe_inertias(self) -> BlockRows:
        """Return the rows of the inertias that the drive believes."""
        if self.knows_payload:
            return self.program.rows(*self.bare.shape)
        links = self.joints.bodies if self.model.payload else self.joints.links_alone
        return self.program.numbers(scale_runs(links.inertias, self.model.mass, 2), 2)

    def believe(self, v: BlockRows, armature: BlockRows) -> BelievedDynamics:
        """Return the dynamics that the drive believes, at joint velocities v."""
        vertical = scale_runs(self.joints.gravity, self.model.gravity, 1)
        return BelievedDynamics(
            self.dynamics, self.believed, self.program.numbers(vertical, 1), v, armature
        )

    def add(self) -> None:
        """Add the stages of the inertias in a period."""
        changed: set[int] = set()
        for load, (body, offset) in self.joints.payloads:
            rows = self.dynamics.inertias[body]
            ends = NEVER if load.released is None else count_periods_until(load.released, self.dt)
            self.program.add(
                joint_drives.attach_payload,
                first=count_periods_until(load.attached, self.dt),
                last=ends,
                payload=self.program.numbers(load.moments_at(offset), 1),
                bodies=rows if body in changed else self.bare[body],
                loaded=rows,
            )
            changed.add(body)
        if self.knows_payload:
            true = self.dynamics.inertias
            self.program.add(
                joint_drives.scale_inertias, factor=self.mass, true=true, believed=self.believed
            )
