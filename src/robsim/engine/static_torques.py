"""Torques that hold driven joints at rest at the start, and their inertias at home."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robsim.base.arrays import Array
from robsim.engine.driven_joints import DrivenJoints
from robsim.engine.payload_stages import scale_runs
from robsim.kernels.control.control_law import multiply_vector
from robsim.kernels.dynamics.joint_drives import copy_single_rows, place_carrier
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages
from robsim.robot.dynamics_stages import DynamicsStages
from robsim.robot.fk_stages import FKStages, add_jacobian_stage
from robsim.world.scene import Scene


class StaticTorques:
    """Gravity loads of the driven joints at coordinates q (nq, runs) of the scene.

    Attributes
    ----------
    load : ndarray of shape (n, runs)
        True loads, with the payloads that are attached from the start.
    fed : ndarray of shape (n, runs)
        Loads as the drive believes them.
    """

    def __init__(self, joints: DrivenJoints, q: Array) -> None:
        self.joints, self.model = joints, joints.drive.model
        true = joints.bodies.inertias
        for load, (body, offset) in joints.payloads:
            if load.attached == 0.0:
                true = _add_to_body(true, body, load.moments_at(offset))
        known = true if self.model.payload else joints.links_alone.inertias
        self.load = self._weigh(q, true, joints.gravity)
        self.fed = self._weigh(
            q,
            scale_runs(known, self.model.mass, 2),
            scale_runs(joints.gravity, self.model.gravity, 1),
        )

    def _weigh(self, q: Array, inertias: Array, gravity: Array) -> Array:
        """Return the gravity loads (n, runs) for given inertias and gravity."""

        def add(program: Program, rows: BlockRows) -> list[BlockRows]:
            dynamics = place_scene(program, self.joints, rows)
            tau = program.rows(len(self.joints.names))
            given = program.numbers(inertias, 2), program.numbers(gravity, 1)
            dynamics.add_inverse(None, None, tau, *given)
            return [tau]

        (tau,) = evaluate_stages(add, [np.ascontiguousarray(q)], [(len(self.joints.names),)])
        return tau

    @cached_property
    def inertia(self) -> Array:
        """Diagonal (n,) or (n, runs) of the believed mass matrix at home, with the armature."""
        diagonal = np.einsum("ii...->i...", evaluate_mass_matrix(self.joints))
        diagonal = scale_runs(diagonal, self.model.mass, 1)
        armature = self.joints.numbers("armature")
        result: Array = diagonal + (armature if diagonal.ndim == 1 else armature[:, None])
        return result


def evaluate_mass_matrix(joints: DrivenJoints) -> Array:
    """Return the mass matrix (n, n) or (n, n, runs) of driven joints at home, without armature."""
    n, runs = len(joints.names), joints.bodies.place.shape[3:] + joints.bodies.inertias.shape[2:]

    def add(program: Program, rows: BlockRows) -> list[BlockRows]:
        dynamics, H = place_scene(program, joints, rows), program.rows(n, n)
        dynamics.add_mass_matrix(H)
        return [H]

    q = np.repeat(joints.scene.home[:, None], max(runs, default=1), axis=1)
    (H,) = evaluate_stages(add, [q], [(n, n)])
    return H if runs else H[..., 0]


def place_scene(program: Program, joints: DrivenJoints, q: BlockRows) -> DynamicsStages:
    """Add the stages that place the bodies of driven joints at coordinates q of the scene."""
    own = program.rows(len(joints.names))
    pairs = [(q[i], own[j]) for j, i in enumerate(joints.coordinates)]
    program.add(copy_single_rows, each=pairs)
    dynamics = DynamicsStages(program, joints.bodies, own)
    placed = FKStages(program, joints.scene.tree.joints, q)
    if any(carrier.body for carrier in dynamics.carriers):
        placed.add()
        place_carriers(program, joints.scene, placed, dynamics, None)
    dynamics.place()
    return dynamics


def place_carriers(
    program: Program,
    scene: Scene,
    placed: FKStages,
    dynamics: DynamicsStages,
    rates: BlockRows | None,
) -> None:
    """Add the stages of the motion of carriers at velocities (nv,) of the scene; None: at rest."""
    for carrier in dynamics.carriers:
        if carrier.body == 0:
            continue
        T, twist = placed.poses[carrier.body], program.rows(6)
        if rates is not None:
            moves = scene.tree.moves(scene.tree.carried(carrier.body))
            J = add_jacobian_stage(program, placed.poses, placed.ratio, T, moves)
            program.add(multiply_vector, A=J, x=rates, out=twist)
        program.add(
            place_carrier,
            T=T,
            twist=twist,
            rotation=carrier.rotation,
            omega=carrier.omega,
            acceleration=carrier.acceleration,
        )


def _add_to_body(inertias: Array, body: int, moments: Array) -> Array:
    """Return inertias (n, 10) or (n, 10, runs) with the moments of a load added to a body."""
    if moments.ndim == 2 and inertias.ndim == 2:
        inertias = np.repeat(inertias[..., None], moments.shape[1], axis=2)
    result = inertias.copy()
    result[body] += moments if moments.ndim == result.ndim - 1 else moments[:, None]
    return result
