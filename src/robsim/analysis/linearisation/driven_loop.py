"""The linear loop of an experiment whose joints have drives, as a function of its gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.linearisation.discrete_loop import DiscreteLoop
from robsim.analysis.linearisation.drive_derivatives import DriveDerivatives
from robsim.analysis.linearisation.linear_plant import DrivePlant, StateMap
from robsim.analysis.linearisation.linear_response import RANK_TOLERANCE, LinearResponse
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array


@dataclass(frozen=True, eq=False)
class MovedField(VectorField):
    """A vector field, displaced along other velocities than the commanded ones."""

    columns: NDArray[np.int64]

    @property
    def n(self) -> int:
        """The number of velocities of displacements."""
        return int(self.columns.size)

    def displace(self, q: Array, dq: Array) -> Array:
        """Return the states (nq, B) displaced by tangent coordinates dq (n, B)."""
        displaced = q.copy()
        velocities = np.zeros((self.scene.nv, q.shape[1]))
        velocities[self.columns] = dq
        self.scene.tree.flow(displaced, velocities, 1.0)
        return displaced


@dataclass(frozen=True, eq=False)
class DrivenLoop:
    """The loop of n commands and k motions: fixed part + factor * growing part, and the plant.

    The motions (k,) are coordinates of the displacements of all joints on which the command
    depends, commanded or not.
    """

    joint_part: Array  # (n, k)
    image_part: Array  # (n, k)
    fixed_joint_part: Array  # (n, k)
    fixed_image_part: Array  # (n, k)
    basis: Array  # (moved, k) displacements of the motions
    response: LinearResponse
    plant: DrivePlant

    @classmethod
    def of(
        cls, response: LinearResponse, doubled: LinearResponse | None, derivatives: DriveDerivatives
    ) -> Self:
        """Return the loop from the responses at the gains and at twice the gains.

        With `doubled` None the whole response is proportional to the gains.
        """
        now = response.joint_part, response.image_part
        growing, fixed = now, tuple(0.0 * each for each in now)
        if doubled is not None:
            twice = doubled.joint_part, doubled.image_part
            growing = twice[0] - now[0], twice[1] - now[1]
            fixed = now[0] - growing[0], now[1] - growing[1]
        _, sigma, Vt = np.linalg.svd(np.concatenate([*growing, *fixed]), full_matrices=False)
        V = np.ascontiguousarray(Vt[sigma > RANK_TOLERANCE * sigma[0]].T)
        plant = DrivePlant.observe(
            derivatives.map_over, V.T @ derivatives.output, derivatives.experiment.dt
        )
        parts = (growing[0] @ V, growing[1] @ V, fixed[0] @ V, fixed[1] @ V)
        return cls(*parts, V, response, plant)

    def at(self, factor: float, timing: LoopDelays) -> DiscreteLoop:
        """Return the loop with all gains multiplied by a factor."""
        seen, now = (
            factor * self.image_part + self.fixed_image_part,
            factor * self.joint_part + self.fixed_joint_part,
        )
        return DiscreteLoop(seen, now, timing, self.plant)

    def with_image_part(self, image_part: Array) -> DrivenLoop:
        """Return the loop with a command that depends on the images alone, by a growing part."""
        none = np.zeros_like(image_part)
        return replace(
            self,
            image_part=image_part,
            joint_part=none,
            fixed_joint_part=none,
            fixed_image_part=none,
        )

    @cached_property
    def total(self) -> Array:
        """The derivative (n, k) of the command for images without delay."""
        return self.joint_part + self.image_part + self.fixed_joint_part + self.fixed_image_part

    def find_rest(self, torques: Array) -> Array:
        """Return the motions (k, ...) at rest under held torques (m, ...) at the joints."""
        A, B, E = self.plant.whole
        loop = np.eye(len(A)) - A - B @ self.total @ self.plant.output
        return np.asarray(self.plant.output @ np.linalg.solve(loop, E @ torques))


def idealise_joints(
    loop: DrivenLoop, derivatives: DriveDerivatives, joints: Sequence[int]
) -> DrivenLoop:
    """Return the loop with some of the driven joints moving exactly as commanded.

    The reactions on the other joints are those of the drives.
    """
    columns, velocities = derivatives.columns.tolist(), derivatives.joints.velocities
    commands = [columns.index(velocities[j]) for j in joints if velocities[j] in columns]
    s = derivatives.output.shape[1]
    output = np.pad(derivatives.output, ((0, 0), (0, len(commands))))
    for j in joints:
        output[derivatives.moved.tolist().index(velocities[j])] = 0.0
    for i, column in enumerate(commands):
        output[column, s + i] = 1.0

    def map_over(seconds: float) -> StateMap:
        A, B, E = derivatives.map_over(seconds)
        own = np.zeros((len(commands), B.shape[1]))
        own[np.arange(len(commands)), commands] = seconds
        whole = np.eye(s + len(commands))
        whole[:s, :s] = A
        held = np.zeros((len(commands), E.shape[1]))
        return StateMap(whole, np.concatenate([B, own]), np.concatenate([E, held]))

    plant = DrivePlant.observe(map_over, loop.basis.T @ output, derivatives.experiment.dt)
    return replace(loop, plant=plant)
