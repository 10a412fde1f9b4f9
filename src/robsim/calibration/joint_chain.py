"""The joints between a camera and its target: relative poses of their frames, and Jacobians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_first, move_runs_last
from robsim.world.scene import Scene


@dataclass(frozen=True)
class JointChain:
    """The joints between the frame `on` of a camera and the frame `under` of its target."""

    scene: Scene
    on: str
    under: str

    @property
    def moves(self) -> bool:
        """Whether any joint moves one frame relative to the other."""
        tree = self.scene.tree
        return bool((tree.flag_moves(self.on) != tree.flag_moves(self.under)).any())

    def poses(self, q: Array) -> Array:
        """Return the poses T_m_f (V, 4, 4) of the frame `under` in the frame `on`, at q (V, nq)."""
        return (self.scene.pose(self.on, q).inv() @ self.scene.pose(self.under, q)).matrix

    def rates(self, q: Array, X: Array, columns: NDArray[np.int64]) -> Array:
        """Return the derivatives (V, N, 3, n) of points X (V, N, 3) of the target by joints.

        The points and the derivatives are in axes of the frame `on` of the camera. `columns` are
        the indices of the n joints in the Jacobian of the scene.
        """
        tree, bodies = self.scene.tree, self.scene.tree.bodies(move_runs_last(q, 1))
        T_w_m, T_w_f = (self.scene.pose(name, q).matrix for name in (self.on, self.under))
        P = X @ T_w_m[:, :3, :3].swapaxes(1, 2) + T_w_m[:, None, :3, 3]
        point_rates = [
            self._rigid_rates(J[:, :, columns], P - T[:, None, :3, 3])
            for J, T in (
                (move_runs_first(tree.jacobian(bodies, self.under)), T_w_f),
                (move_runs_first(tree.jacobian(bodies, self.on)), T_w_m),
            )
        ]
        rates = point_rates[0] - point_rates[1]
        return np.asarray(T_w_m[:, None, :3, :3].swapaxes(2, 3) @ rates)

    @staticmethod
    def _rigid_rates(J: Array, arm: Array) -> Array:
        """Return rates (V, N, 3, n) of points at `arm` (V, N, 3) from an origin with Jacobian J."""
        tangential = np.cross(J[:, None, 3:], arm[..., None], axisa=2, axisb=2, axisc=2)
        return np.asarray(J[:, None, :3] + tangential)
