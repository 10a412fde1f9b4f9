"""Dynamics of the joints as a drive believes them, as rows of a program."""

from __future__ import annotations

from dataclasses import dataclass

from robsim.kernels.dynamics.joint_drives import accelerate_motors
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.dynamics_stages import DynamicsStages


@dataclass(frozen=True, eq=False)
class BelievedDynamics:
    """Stages of a drive's model at the true coordinates.

    Attributes
    ----------
    stages : DynamicsStages
        Placed bodies of the truth.
    inertias : BlockRows of shape (bodies, 10)
        Believed inertias.
    gravity : BlockRows of shape (3,)
        Believed acceleration of gravity.
    v : BlockRows of shape (n,)
        Velocities of the joints.
    armature : BlockRows of shape (n,)
        Inertias of the motors.
    """

    stages: DynamicsStages
    inertias: BlockRows
    gravity: BlockRows
    v: BlockRows
    armature: BlockRows

    def add_gravity(self, torque: BlockRows) -> None:
        """Add the stages of the believed gravity load (n,)."""
        self.stages.add_inverse(None, None, torque, self.inertias, self.gravity)

    def add_inverse(self, acceleration: BlockRows, torque: BlockRows) -> None:
        """Add the stages of the torques (n,) that give believed accelerations (n,)."""
        self.stages.add_inverse(self.v, acceleration, torque, self.inertias, self.gravity)
        motors = {"armature": self.armature, "a": acceleration}
        self.stages.program.add(accelerate_motors, **motors, torque=torque)
