"""A sight: one camera looking at one object of a scene, true or believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError
from robsim.features import Observation
from robsim.kernels import jacobian as jacobians
from robsim.kernels import sight as kernels
from robsim.kernels import viewing
from robsim.kernels.program import Function, Program
from robsim.kernels.sight import Projection
from robsim.kernels.tree import Bodies
from robsim.robot.placed import frame_jacobian
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

Key = tuple[str, str]  # camera and target
MARKS = ("depth", "pixels", "visibility")  # what a projection holds of each mark


@dataclass(frozen=True, eq=False)
class Sight:
    """A camera and its target in a scene, and how each velocity moves one relative to the other."""

    scene: Scene
    eye: MountedCamera
    target: Object

    @property
    def key(self) -> Key:
        """The names of camera and target."""
        return self.eye.name, self.target.name

    @cached_property
    def sign(self) -> Array:
        """The sign of each move of the tree: 1 if it carries the camera, -1 the target, else 0."""
        tree = self.scene.tree
        return tree.carried(self.eye.name) - tree.carried(self.target.name)

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """The velocities that move the camera relative to the target, and can be commanded."""
        moved = np.unique(self.scene.tree.velocity[self.sign != 0])
        return frozen(moved[~self.scene.prescribed[moved]])

    def project(self, q: Array) -> Projection:
        """Return camera, target and marks in the image at coordinates q (nq, B)."""
        bodies, tree = self.scene.tree.bodies(q), self.scene.tree
        T_w_c, T_w_o = tree.frame(bodies, self.eye.name), tree.frame(bodies, self.target.name)
        runs, N = q.shape[1], len(self.target.marks)
        seen = self._image(np.concatenate([T_w_c.reshape(12, runs), T_w_o.reshape(12, runs)]))
        pixels, depth, status = seen[: 2 * N], seen[2 * N : 3 * N], seen[3 * N :]
        pixels = pixels.reshape(N, 2, runs)
        return Projection(bodies, T_w_c, T_w_o, depth, pixels, status.astype(np.int8))

    @cached_property
    def _image(self) -> Function:
        """The pixels, depths and status of the marks, from the poses of camera and target."""
        program, N = Program(), len(self.target.marks)
        poses, found = program.rows(24), program.rows(4 * N)
        rows = program.constant(self.target.marks), N, poses, poses + 12
        camera, bends = program.constant(self.numbers), bool(self.eye.camera.lens.any())
        out = found, found + 2 * N, found + 3 * N
        program.add(viewing.project, *rows, camera, bends, *out, viewing.EACH)
        return Function(program, poses, found, 4 * N)

    @cached_property
    def numbers(self) -> Array:
        """The numbers of the camera, in the order of `robsim.kernels.viewing`."""
        eye = self.constants
        return np.concatenate([eye.K.ravel(), eye.lens, eye.border.ravel(), [eye.valid_radius]])

    def jacobian(self, projection: Projection, moves: jacobians.Moves) -> Array:
        """Return J (6, n, B) of some velocities: V_c - V_o = J qdot, in camera axes."""
        return frame_jacobian(projection.bodies, projection.T_w_c, moves)

    @cached_property
    def constants(self) -> kernels.Eye:
        """The constants of camera and target for the kernels."""
        find, camera = self.scene.tree.find, self.eye.camera
        return kernels.Eye(
            *find(self.eye.name),
            *find(self.target.name),
            self.target.marks,
            camera.K,
            camera.lens,
            camera.border,
            camera.valid_radius,
            bool((self.sign > 0).any()),
        )

    def observation(self, pixels: Array, depth: Array, T_c_o: Array | None) -> Observation:
        """Return the observation of pixels (N, 2, B) at depths (N, B), near the pose T_c_o."""
        seen = Observation.of(pixels, depth, self.eye.camera)
        seen.model, seen.guess_last = self.target.marks, T_c_o
        return seen

    def moves(self, columns: NDArray[np.int64]) -> jacobians.Moves:
        """Return some velocities as the kernels take them, read-only."""
        return self.scene.tree.moves(self.sign, columns)

    def moves_with(self, other: Sight) -> bool:
        """Return whether two sights have one relative motion, riding on the same bodies."""
        find = self.scene.tree.find
        pairs = zip(self.key, other.key, strict=True)
        return all(find(mine)[0] == find(theirs)[0] for mine, theirs in pairs)


def sight(scene: Scene, camera: str | None, target: str | None) -> Sight:
    """Return the sight of a named camera on a named target; InputError if no joint moves either."""
    found = Sight(scene, scene.camera(camera), scene.object(target))
    if not len(found.target.marks):
        raise InputError(f"object '{found.target.name}' has no marks to look at")
    if not found.columns.size:
        alone = "; what moves on its own is not commanded" if scene.motions else ""
        raise InputError(
            f"no joint moves camera '{found.eye.name}' relative to '{found.target.name}'{alone}"
        )
    return found


def relative(T_w_a: Array, T_w_b: Array) -> Array:
    """Return T_a_b (3, 4, B) from T_w_a and T_w_b (3, 4, B)."""
    R, B = T_w_a[:, :3], T_w_b.copy()
    with np.errstate(all="ignore"):  # a run that went wrong is data
        B[:, 3] -= T_w_a[:, 3]
        T: Array = R[0, :, None] * B[0] + R[1, :, None] * B[1] + R[2, :, None] * B[2]
    return T


def joined(projections: Sequence[Projection], runs: int) -> Projection:
    """Return all marks of several projections in one, with the poses of the first."""
    if len(projections) == 1:
        return projections[0]
    if not projections:
        return _blind(runs)
    parts = (np.concatenate([getattr(one, name) for one in projections]) for name in MARKS)
    return Projection(*projections[0][:3], *parts)


def _blind(runs: int) -> Projection:
    """Return the projection of no camera, without poses and marks."""
    sizes: list[tuple[int, ...]] = [(3, 4), (), (4,), (4,), (), (2,)]
    poses, ratio, *others = (np.empty((0, *n, runs)) for n in sizes)
    T_w_c, T_w_o, depth, pixels = others
    status = np.empty((0, runs), np.int8)
    return Projection(Bodies(poses, ratio), T_w_c, T_w_o, depth, pixels, status)


def adjoint(T_a_b: Array) -> Array:
    """Return the adjoint (6, 6) with V_a = A V_b for one body's twist, from T_a_b (3, 4, 1).

    v_a = R v_b + p x (R omega_b), omega_a = R omega_b.
    """
    R, (x, y, z) = T_a_b[:, :3, 0], T_a_b[:, 3, 0]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.block([[R, cross @ R], [np.zeros((3, 3)), R]])
