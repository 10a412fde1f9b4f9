"""A sight: one camera looking at one object of a scene, true or believed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.features.feature import Observation
from robsim.geometry.pose import Pose
from robsim.kernels.formulas import jacobian as jacobians
from robsim.kernels.formulas.projection_arrays import Projection
from robsim.kernels.images import projection
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.robot.fk_stages import evaluate_frame_jacobian
from robsim.robot.tree import RunNumbers
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

PairKey = tuple[str, str]  # camera and target


@dataclass(frozen=True, eq=False)
class CameraTarget:
    """A camera and its target in a scene, and how each velocity moves one relative to the other."""

    scene: Scene
    eye: MountedCamera
    target: Object

    @property
    def key(self) -> PairKey:
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
        return make_read_only(moved[~self.scene.prescribed[moved]])

    @property
    def runs(self) -> int:
        """The number of runs of which each has numbers of its own, or 1."""
        marks, camera = np.shape(self.target.marks), self.eye.camera.rows.shape
        return int(max(*marks[2:], camera[1], self.scene.tree.runs))

    def home(self, runs: int) -> Array:
        """Return the coordinates (nq, runs) of the scene with all robots at home."""
        return np.repeat(self.scene.home[:, None], runs, axis=1)

    def project(self, q: Array, runs: RunNumbers = None) -> Projection:
        """Return camera, target and marks in the image at coordinates q (nq, B), of `runs` (B,).

        These matter where numbers of the scene differ from run to run; by default all runs come in
        order.
        """
        tree = self.scene.tree
        bodies = tree.bodies(q, runs)
        T_w_c, T_w_o = (tree.frame(bodies, part.name, runs) for part in (self.eye, self.target))
        return Projection(bodies, T_w_c, T_w_o, *self.image(T_w_c, T_w_o, runs))

    def image(
        self, T_w_c: Array, T_w_o: Array, runs: RunNumbers = None
    ) -> tuple[Array, Array, NDArray[np.int8]]:
        """Return depths (N, B), pixels (N, 2, B) and visibility (N, B) of the marks.

        The poses (3, 4, B) are those of camera and target in a common frame.
        """
        N, both = len(self.target.marks), np.broadcast_arrays(T_w_c, T_w_o)
        seen = self._image(np.concatenate([T.reshape(12, -1) for T in both]), runs)
        pixels, depth, status = seen[: 2 * N], seen[2 * N : 3 * N], seen[3 * N :]
        return depth, pixels.reshape(N, 2, -1), status.astype(np.int8)

    @cached_property
    def _image(self) -> ProgramFunction:
        """The pixels, depths and status of the marks, from the poses of camera and target."""
        program, N = Program(), len(self.target.marks)
        poses, found = program.rows(2, 3, 4), program.rows(4 * N)
        pixels, rest = found[: 2 * N].reshape(N, 2), found[2 * N :]
        self.look(program, *poses, pixels, rest[:N], rest[N:], of=projection.EACH_STATUS)
        return ProgramFunction(program, poses, found, 4 * N)

    def look(
        self,
        program: Program,
        T_w_c: BlockRows,
        T_w_o: BlockRows,
        *image: BlockRows,
        of: int = projection.WORST_STATUS,
    ) -> None:
        """Add the stage that projects the marks, from the rows of poses to those of an `image`.

        These are pixels, depths and status, `of` the first object, of MORE, or of EACH mark.
        """
        camera, (pixels, depth, status) = self.eye.camera, image
        program.add(
            projection.project_to_pixels,
            marks=program.numbers(self.target.marks, 2),
            T_w_c=T_w_c,
            T_w_o=T_w_o,
            camera=program.each(camera.rows),
            bends=camera.bends,
            pixels=pixels,
            depth=depth,
            status=status.flat,
            which=of,
        )

    def jacobian(self, projection: Projection, moves: jacobians.BodyMoves) -> Array:
        """Return J (6, n, B) of some velocities: V_c - V_o = J qdot, in camera axes."""
        return evaluate_frame_jacobian(projection.bodies, projection.T_w_c, moves)

    @property
    def frames(self) -> list[tuple[int, Array]]:
        """The bodies that carry camera and target, each with its constant pose on that body."""
        find = self.scene.tree.find
        return [find(self.eye.name), find(self.target.name)]

    @property
    def camera_moves(self) -> bool:
        """Whether a joint carries the camera."""
        return bool((self.sign > 0).any())

    def observation(self, pixels: Array, depth: Array, T_c_o: Array | None) -> Observation:
        """Return the observation of pixels (N, 2, B) at depths (N, B), near the pose T_c_o."""
        more = {"model": self.target.marks, "guess_last": T_c_o}
        return Observation.of_last(pixels, depth, self.eye.camera, **more)

    def before(self) -> Observation:
        """Return what is seen of the target, turned a little, by a camera well before it."""
        away = 4.0 * float(np.abs(self.target.marks).max()) + 1e-3  # metres
        T_c_o = Pose.at(0.0, 0.0, away, rpy=(0.1, 0.2, 0.3)).matrix[:3, :, None].copy()
        depth, pixels, _ = self.image(np.eye(3, 4)[..., None], T_c_o, np.zeros(1, dtype=np.int64))
        return self.observation(pixels, depth, T_c_o)

    def moves(self, columns: NDArray[np.int64]) -> jacobians.BodyMoves:
        """Return some velocities as the kernels take them, read-only."""
        return self.scene.tree.moves(self.sign, columns)

    def moves_with(self, other: CameraTarget) -> bool:
        """Return whether two sights have one relative motion, riding on the same bodies."""
        find = self.scene.tree.find
        pairs = zip(self.key, other.key, strict=True)
        return all(find(mine)[0] == find(theirs)[0] for mine, theirs in pairs)


def make_camera_target(scene: Scene, camera: str | None, target: str | None) -> CameraTarget:
    """Return the sight of a named camera on a named target; InputError if no joint moves either."""
    found = CameraTarget(scene, scene.camera(camera), scene.object(target))
    if not len(found.target.marks):
        raise InputError(f"object '{found.target.name}' has no marks to look at")
    if not found.columns.size:
        alone = "; what moves on its own is not commanded" if scene.motions else ""
        raise InputError(
            f"no joint moves camera '{found.eye.name}' relative to '{found.target.name}'{alone}"
        )
    return found


def compute_relative_pose(T_w_a: Array, T_w_b: Array) -> Array:
    """Return T_a_b (3, 4, B) from T_w_a and T_w_b (3, 4, B)."""
    R, B = T_w_a[:, :3], T_w_b.copy()
    with np.errstate(all="ignore"):  # a run that went wrong is data
        B[:, 3] -= T_w_a[:, 3]
        T: Array = R[0, :, None] * B[0] + R[1, :, None] * B[1] + R[2, :, None] * B[2]
    return T


def adjoint(T_a_b: Array) -> Array:
    """Return the adjoints (6, 6, B) with V_a = A V_b for one body's twist, from T_a_b (3, 4, B).

    v_a = R v_b + p x (R omega_b), omega_a = R omega_b.
    """
    R, p = T_a_b[:, :3], T_a_b[:, 3]
    A = np.zeros((6, 6, T_a_b.shape[2]))
    A[:3, :3] = A[3:, 3:] = R
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        A[i, 3:] = p[j] * R[k] - p[k] * R[j]
    return A
