"""Stages of the dynamics of rigid bodies, and the rows of a program that hold their state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robsim.kernels.dynamics.articulated_bodies import compute_joint_accelerations
from robsim.kernels.dynamics.body_motion import BODY, begin_carrier, place_joints
from robsim.kernels.dynamics.composite_bodies import compute_mass_matrix
from robsim.kernels.dynamics.newton_euler import compute_joint_torques
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.rigid_bodies import RigidBodies

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, in axes of the world


class CarrierRows(NamedTuple):
    """Rows of a body whose motion is given."""

    body: int  # of the tree
    rotation: BlockRows  # (9,) in the world, row by row
    omega: BlockRows  # (3,) in the axes of the body
    acceleration: BlockRows  # (3,) of the origin, without gravity


class DynamicsStages:
    """Rows of a program with the dynamics of rigid bodies, at joint coordinates q (n,).

    Attributes
    ----------
    gravity : BlockRows of shape (3,)
        Acceleration of gravity in axes of the world.
    inertias : BlockRows of shape (n, 10)
        Moments of the bodies, see `RigidBodies`; other stages may write them.
    carriers : list of CarrierRows
        Carriers, at first without rotation and at rest.
    """

    def __init__(self, program: Program, bodies: RigidBodies, q: BlockRows) -> None:
        self.program, self.bodies, self.q = program, bodies, q
        self.gravity = program.constant(GRAVITY)
        self.inertias = program.numbers(bodies.inertias, 2)
        self.place_rows = program.numbers(bodies.place, 3)
        rows = program.rows
        self.carriers = [
            CarrierRows(body, program.constant(np.eye(3).ravel()), rows(3), rows(3))
            for body in bodies.carriers
        ]
        count = len(bodies.carriers)
        states = list(program.rows(count + len(bodies.bodies), BODY))
        self.carrier_states, self.states = states[:count], states[count:]
        self.parents = [states[i] for i in bodies.parents]
        self.on_carrier = [i < count for i in bodies.parents]
        self.zero = program.rows(q.shape[0])

    def place(self) -> None:
        """Add the stage that places the bodies at q."""
        x = [self.q[i] for i in self.bodies.columns]
        each = list(zip(self.place_rows, x, self.states, self.bodies.turns, strict=True))
        self.program.add(place_joints, each=each)

    def _begin(self, gravity: BlockRows | None) -> None:
        """Add the stages of the motion of the carriers."""
        for carrier, state in zip(self.carriers, self.carrier_states, strict=True):
            self.program.add(
                begin_carrier,
                rotation=carrier.rotation,
                omega=carrier.omega,
                acceleration=carrier.acceleration,
                gravity=self.gravity if gravity is None else gravity,
                body=state,
            )

    def add_inverse(
        self,
        v: BlockRows | None,
        a: BlockRows | None,
        tau: BlockRows,
        inertias: BlockRows | None = None,
        gravity: BlockRows | None = None,
    ) -> None:
        """Add the stages of the torques tau (n,) for accelerations a at velocities v.

        None stands for zero. Other inertias and another gravity replace those of the bodies.
        """
        self._begin(gravity)
        rows = (self.zero if v is None else v, self.zero if a is None else a, tau)
        joints = [tuple(each[i] for each in rows) for i in self.bodies.columns]
        known = self.inertias if inertias is None else inertias
        parts = zip(
            *(self.parents, self.states, known, joints, self.bodies.turns, self.on_carrier),
            strict=True,
        )
        each = [(p, s, m, *j, turns, on) for p, s, m, j, turns, on in parts]
        self.program.add(compute_joint_torques, each=each)

    def add_mass_matrix(self, H: BlockRows) -> None:
        """Add the stage of the mass matrix H (n, n) of the joints."""
        count = len(self.carriers)
        above = [max(i - count, -1) for i in self.bodies.parents]
        columns, turns = self.bodies.columns, self.bodies.turns
        each = list(zip(above, columns, self.states, self.inertias, turns, strict=True))
        self.program.add(compute_mass_matrix, H=H, each=each)

    def add_forward(self, v: BlockRows, tau: BlockRows, diagonal: BlockRows, a: BlockRows) -> None:
        """Add the stages of the accelerations a (n,) under torques tau at velocities v.

        `diagonal` (n,) is added to the inertia at each joint.
        """
        self._begin(None)
        joints = [tuple(each[i] for each in (v, tau, diagonal, a)) for i in self.bodies.columns]
        parts = zip(
            *(self.parents, self.states, self.inertias, joints, self.bodies.turns, self.on_carrier),
            strict=True,
        )
        each = [(p, s, m, *j, turns, on) for p, s, m, j, turns, on in parts]
        self.program.add(compute_joint_accelerations, each=each)
