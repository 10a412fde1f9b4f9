"""One camera looking at one object of a scene: the truth of it, or a belief about it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array
from robsim.errors import InputError
from robsim.kernels import sight as kernels
from robsim.kernels import tree
from robsim.scene import Mounted, Object, Scene


class Look(NamedTuple):
    """One instant, in the kernels' layout: poses of all bodies, the camera, the marks."""

    bodies: Array  # (bodies, 3, 4, B)
    T_w_c: Array  # (3, 4, B)
    T_w_o: Array  # (3, 4, B)
    points: Array  # (N, 3, B) marks in camera axes
    depth: Array  # (N, B)
    pixels: Array  # (N, 2, B), NaN behind the camera
    visibility: NDArray[np.int8]  # (N, B) of `Visibility`


@dataclass(frozen=True)
class Sight:
    """A camera and its target in a scene, and how every velocity moves one against the other."""

    scene: Scene
    eye: Mounted
    target: Object

    @cached_property
    def sign(self) -> Array:
        """(nv,): 1 where a velocity carries the camera, -1 the target, 0 both or neither."""
        tree = self.scene.tree
        return tree.carries(self.eye.name) - tree.carries(self.target.name)

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """The velocities that move the camera relative to the target."""
        return np.flatnonzero(self.sign)

    @cached_property
    def camera_moves(self) -> bool:
        """Whether a joint carries the camera; if none does, joints carry the target."""
        return bool((self.sign > 0).any())

    def look(self, q: Array) -> Look:
        """What is where, for coordinates q (nq, B)."""
        runs, marks = q.shape[1], len(self.target.marks)
        seen = Look(
            np.empty((self._bodies, 3, 4, runs)),
            np.empty((3, 4, runs)),
            np.empty((3, 4, runs)),
            np.empty((marks, 3, runs)),
            np.empty((marks, runs)),
            np.empty((marks, 2, runs)),
            np.empty((marks, runs), np.int8),
        )
        kernels.look(*self._tree, q, *self._constants, *seen)
        return seen

    def jacobian(self, look: Look) -> Array:
        """(6, n, B) of the n `columns`: V_c - V_o = J qdot, in camera axes."""
        J = np.empty((6, self.columns.size, look.T_w_c.shape[-1]))
        tree.camera_jacobian(look.bodies, look.T_w_c, *self._velocities, J)
        return J

    @cached_property
    def _bodies(self) -> int:
        return len(self.scene.tree.parent)

    @cached_property
    def _tree(self) -> tuple[Any, ...]:
        tree = self.scene.tree
        return tree.parent, tree.kind, tree.iq, tree.place

    @cached_property
    def _constants(self) -> tuple[Any, ...]:
        find, camera = self.scene.tree.find, self.eye.camera
        lens = camera.K, camera.lens, camera.border, camera.reach
        return *find(self.eye.name), *find(self.target.name), self.target.marks, *lens

    @cached_property
    def _velocities(self) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.int64], Array]:
        tree, chosen = self.scene.tree, self.columns
        arrays = tree.body[chosen], tree.angular[chosen], tree.axis[chosen], self.sign[chosen]
        for array in arrays:  # read-only like those of the tree: kernels are compiled once
            array.flags.writeable = False
        return arrays


def sight(scene: Scene, camera: str | None, target: str | None) -> Sight:
    """The sight of a named camera on a named target; InputError if nothing moves one of them."""
    found = Sight(scene, scene.camera(camera), scene.object(target))
    if not len(found.target.marks):
        raise InputError(f"object '{found.target.name}' has no marks to look at")
    if not found.columns.size:
        raise InputError(
            f"no joint moves camera '{found.eye.name}' relative to '{found.target.name}'"
        )
    return found
