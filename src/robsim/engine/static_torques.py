"""Torques that hold driven joints at rest at the start, and their inertias at home."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from robsim.base.arrays import Array, align_runs, scale_runs
from robsim.engine.driven_joints import DrivenJoints, count_periods_until
from robsim.engine.scene_dynamics import evaluate_mass_matrix, place_scene
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages


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
            if count_periods_until(load.attached, joints.seconds) == 0:
                true = _add_to_body(true, body, load.moments_at(offset))
        known = self.known = true if self.model.payload else joints.links_alone.inertias
        self.load = self._weigh(q, true, joints.gravity)
        self.fed = self._weigh(
            q,
            scale_runs(known, self.model.mass, 2),
            scale_runs(joints.gravity, self.model.gravity, 1),
        )

    def _weigh(self, q: Array, inertias: Array, gravity: Array) -> Array:
        """Return the gravity loads (n, runs) for given inertias and gravity."""

        def add(program: Program, rows: BlockRows) -> list[BlockRows]:
            dynamics = place_scene(program, self.joints.dynamics, rows)
            tau = program.rows(len(self.joints.names))
            given = program.numbers(inertias, 2), program.numbers(gravity, 1)
            dynamics.add_inverse(None, None, tau, *given)
            return [tau]

        (tau,) = evaluate_stages(add, [np.ascontiguousarray(q)], [(len(self.joints.names),)])
        return tau

    @cached_property
    def inertia(self) -> Array:
        """Diagonal (n,) or (n, runs) of the believed mass matrix at home, with the armature.

        It contains the loads at the start that the model includes.
        """
        joints = self.joints
        is_bare = self.known is joints.bodies.inertias  # as in the check of the mass matrix
        M = joints.mass_matrix if is_bare else evaluate_mass_matrix(joints.dynamics, self.known)
        diagonal = scale_runs(np.einsum("ii...->i...", M), self.model.mass, 1)
        result: Array = np.add(*align_runs(diagonal, joints.numbers("armature"), axes=1))
        return result


def _add_to_body(inertias: Array, body: int, moments: Array) -> Array:
    """Return inertias (n, 10) or (n, 10, runs) with the moments of a load added to a body."""
    if moments.ndim == 2 and inertias.ndim == 2:
        inertias = np.repeat(inertias[..., None], moments.shape[1], axis=2)
    result = inertias.copy()
    result[body] += moments if moments.ndim == result.ndim - 1 else moments[:, None]
    return result
