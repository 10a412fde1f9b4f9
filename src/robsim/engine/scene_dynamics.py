"""Stages of the dynamics of some joints of a scene, at coordinates of the whole scene."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.kernels.control.control_law import multiply_vector
from robsim.kernels.dynamics.joint_drives import copy_single_rows, place_carrier
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages
from robsim.robot.dynamics_stages import DynamicsStages
from robsim.robot.fk_stages import FKStages
from robsim.robot.rigid_bodies import RigidBodies
from robsim.world.scene import Scene


class SceneDynamics(NamedTuple):
    """Rigid bodies of a scene, and the coordinates of their joints."""

    scene: Scene
    bodies: RigidBodies
    coordinates: list[int]  # indices among the coordinates of the scene, joint by joint


def evaluate_mass_matrix(of: SceneDynamics, inertias: Array) -> Array:
    """Return the mass matrix (n, n) or (n, n, runs) of joints at home, without armature.

    `inertias` (bodies, 10) or (bodies, 10, runs) are the moments of the bodies.
    """
    n, runs = len(of.coordinates), of.bodies.place.shape[3:] + inertias.shape[2:]

    def add(program: Program, rows: BlockRows) -> list[BlockRows]:
        dynamics, H = place_scene(program, of, rows), program.rows(n, n)
        dynamics.add_mass_matrix(H, program.numbers(inertias, 2))
        return [H]

    q = np.repeat(of.scene.home[:, None], max(runs, default=1), axis=1)
    (H,) = evaluate_stages(add, [q], [(n, n)])
    return H if runs else H[..., 0]


def place_scene(program: Program, of: SceneDynamics, q: BlockRows) -> DynamicsStages:
    """Add the stages that place bodies at coordinates q (nq,) of the scene."""
    own = program.rows(len(of.coordinates))
    pairs = [(q[i], own[j]) for j, i in enumerate(of.coordinates)]
    program.add(copy_single_rows, each=pairs)
    dynamics = DynamicsStages(program, of.bodies, own)
    placed = FKStages(program, of.scene.tree.joints, q)
    if any(carrier.body for carrier in dynamics.carriers):
        placed.add()
        place_carriers(program, of.scene, placed, dynamics, None)
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
            program.add(multiply_vector, A=placed.frame_jacobian(T, moves), x=rates, out=twist)
        program.add(
            place_carrier,
            T=T,
            twist=twist,
            rotation=carrier.rotation,
            omega=carrier.omega,
            acceleration=carrier.acceleration,
        )
