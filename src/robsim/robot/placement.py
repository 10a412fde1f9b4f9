"""Frames of a tree at configurations that a user gives, without looking anything up again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array, frozen, runs_first, runs_last
from robsim.geometry.pose import homogeneous
from robsim.kernels import kinematics as kernels
from robsim.robot.assembly import integers
from robsim.robot.tree import Tree


class Placement:
    """Some frames of a tree, with the constants by which kernels place them."""

    def __init__(self, tree: Tree, names: Sequence[str]):
        found = [tree.find(name) for name in names]
        offsets = frozen(np.stack([offset[:3] for _, offset in found]))
        self.tree, self.names = tree, names
        self._frames = *tree.packed, integers([body for body, _ in found]), offsets
        self._twists = *self._frames, *tree.moves(tree.carried(names[0]))

    def poses(self, q: Array, out: Array) -> bool:
        """Fill out (..., frames, 4, 4) at q (..., nq); return whether q is known to be usual."""
        if self.tree.compiled:
            usual: bool = kernels.poses(*self._frames, _flat(q), out.reshape(-1))
            return usual
        bodies = self.tree.bodies(runs_last(q, 1))
        placed = [homogeneous(self.tree.frame(bodies, name)) for name in self.names]
        out[:] = np.stack(placed, axis=1).reshape(out.shape)
        return False

    def jacobian(self, q: Array, out: Array) -> bool:
        """Fill out (..., 6, nv) of the first frame at q (..., nq), and return likewise."""
        if self.tree.compiled:
            usual: bool = kernels.jacobians(*self._twists, _flat(q), out.reshape(-1))
            return usual
        bodies = self.tree.bodies(runs_last(q, 1))
        out[:] = runs_first(self.tree.jacobian(bodies, self.names[0]), q.shape[:-1])
        return False


def _flat(q: Array) -> Array:
    return q if q.ndim == 1 else q.reshape(-1)  # one configuration is flat, and to ask is quicker
