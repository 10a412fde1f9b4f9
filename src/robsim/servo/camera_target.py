"""A camera-target pair: one camera that observes one object of a scene, true or believed."""

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

PairKey = tuple[str, str]  # names of camera and target


@dataclass(frozen=True, eq=False)
class CameraTarget:
    """A camera and its target in a scene, with their relative motion by each velocity."""

    scene: Scene
    eye: MountedCamera
    target: Object

    @property
    def key(self) -> PairKey:
        """Names of camera and target."""
        return self.eye.name, self.target.name

    @cached_property
    def sign(self) -> Array:
        """Sign of each motion of the tree: 1 if it carries the camera, -1 the target, else 0."""
        tree = self.scene.tree
        return tree.flag_moves(self.eye.name) - tree.flag_moves(self.target.name)

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """Indices of the commanded velocities that move the camera relative to the target."""
        moving = np.unique(self.scene.tree.velocity[self.sign != 0])
        return make_read_only(moving[~self.scene.prescribed[moving]])

    @property
    def runs(self) -> int:
        """Number of runs with individual numbers in the scene, or 1."""
        marks, camera = np.shape(self.target.marks), self.eye.camera.rows.shape
        return int(max(*marks[2:], camera[1], self.scene.tree.runs))

    def in_scene(self, scene: Scene) -> CameraTarget:
        """Return the pair of the same names in another scene."""
        return CameraTarget(scene, scene.camera(self.eye.name), scene.object(self.target.name))

    def home(self, runs: int) -> Array:
        """Return the coordinates (nq, runs) of the scene with all robots at home."""
        return np.repeat(self.scene.home[:, None], runs, axis=1)

    def project(self, q: Array, runs: RunNumbers = None) -> Projection:
        """Return poses of camera and target and the image of the marks at coordinates q (nq, B).

        `runs` (B,) are the indices of the runs, used if numbers of the scene differ from run to
        run. By default the runs come in order.
        """
        tree = self.scene.tree
        bodies = tree.bodies(q, runs)
        T_w_c, T_w_o = (tree.frame(bodies, part.name, runs) for part in (self.eye, self.target))
        return Projection(bodies, T_w_c, T_w_o, *self.image(T_w_c, T_w_o, runs))

    def image(
        self, T_w_c: Array, T_w_o: Array, runs: RunNumbers = None
    ) -> tuple[Array, Array, NDArray[np.int8]]:
        """Return depths (N, B), pixels (N, 2, B) and visibility (N, B) of the marks.

        T_w_c and T_w_o (3, 4, B) are the poses of camera and target in a common frame.
        """
        N, poses = len(self.target.marks), np.broadcast_arrays(T_w_c, T_w_o)
        values = self._image_function(np.concatenate([T.reshape(12, -1) for T in poses]), runs)
        pixels, depth, status = values[: 2 * N], values[2 * N : 3 * N], values[3 * N :]
        return depth, pixels.reshape(N, 2, -1), status.astype(np.int8)

    @cached_property
    def _image_function(self) -> ProgramFunction:
        """Function from poses of camera and target to pixels, depths and status of the marks."""
        program, N = Program(), len(self.target.marks)
        poses, values = program.rows(2, 3, 4), program.rows(4 * N)
        pixels, rest = values[: 2 * N].reshape(N, 2), values[2 * N :]
        self.add_projection(program, *poses, pixels, rest[:N], rest[N:], of=projection.EACH_STATUS)
        return ProgramFunction(program, poses, values, 4 * N)

    def add_projection(
        self,
        program: Program,
        T_w_c: BlockRows,
        T_w_o: BlockRows,
        *image: BlockRows,
        of: int = projection.WORST_STATUS,
    ) -> None:
        """Add the stage that projects the marks, from the rows of two poses to rows of an image.

        `image` are the rows of pixels, depths and status. `of` selects the status: WORST_STATUS
        (the worst of all marks), CONTINUED_STATUS (the same, together with objects projected
        before), or EACH_STATUS (one for each mark).
        """
        camera, (pixels, depth, status) = self.eye.camera, image
        program.add(
            projection.project_to_pixels,
            marks=program.numbers(self.target.marks, 2),
            T_w_c=T_w_c,
            T_w_o=T_w_o,
            camera=program.each(camera.rows),
            lens=camera.lens_kind,
            pixels=pixels,
            depth=depth,
            status=status.flat,
            mode=of,
        )

    def jacobian(self, projection: Projection, moves: jacobians.BodyMoves) -> Array:
        """Return J (6, n, B) with V_c - V_o = J qdot for some velocities, in camera axes."""
        return evaluate_frame_jacobian(projection.bodies, projection.T_w_c, moves)

    @property
    def frames(self) -> list[tuple[int, Array]]:
        """Bodies of camera and target, each with the pose of camera or target on its body."""
        find = self.scene.tree.find
        return [find(self.eye.name), find(self.target.name)]

    @property
    def camera_moves(self) -> bool:
        """Whether a joint carries the camera."""
        return bool((self.sign > 0).any())

    def observation(self, pixels: Array, depth: Array, T_c_o: Array | None) -> Observation:
        """Return the observation of pixels (N, 2, B) at depths (N, B) with the pose guess T_c_o."""
        more = {"model": self.target.marks, "guess_last": T_c_o}
        return Observation.of_last(pixels, depth, self.eye.camera, **more)

    def observe_from_front(self) -> Observation:
        """Return the observation of the slightly rotated target by a camera well in front of it.

        Camera and marks of the first run stand for all runs.
        """
        distance = 4.0 * float(np.abs(self.target.marks).max()) + 1e-3  # metres
        T_c_o = Pose.at(0.0, 0.0, distance, rpy=(0.1, 0.2, 0.3)).matrix[:3, :, None].copy()
        first = np.zeros(1, dtype=np.int64)
        depth, pixels, _ = self.image(np.eye(3, 4)[..., None], T_c_o, first)
        marks, camera = np.asarray(self.target.marks), self.eye.camera.of_runs(first)
        model = marks if marks.ndim == 2 else marks[..., :1]
        return Observation.of_last(pixels, depth, camera, model=model, guess_last=T_c_o)

    def moves(self, columns: NDArray[np.int64]) -> jacobians.BodyMoves:
        """Return the motions by some velocities in the form of the kernels, read-only."""
        return self.scene.tree.moves(self.sign, columns)

    def moves_with(self, other: CameraTarget) -> bool:
        """Return whether the same bodies carry both pairs: they then have one relative motion."""
        find = self.scene.tree.find
        pairs = zip(self.key, other.key, strict=True)
        return all(find(mine)[0] == find(theirs)[0] for mine, theirs in pairs)


def make_camera_target(scene: Scene, camera: str | None, target: str | None) -> CameraTarget:
    """Return the pair of a named camera and a named target.

    Raises InputError if the target has no marks, or if no joint moves one relative to the other.
    """
    pair = CameraTarget(scene, scene.camera(camera), scene.object(target))
    if not len(pair.target.marks):
        raise InputError(f"object '{pair.target.name}' has no marks to look at")
    if not pair.columns.size:
        alone = "; prescribed motions are not commanded" if scene.motions else ""
        raise InputError(
            f"no joint moves camera '{pair.eye.name}' relative to '{pair.target.name}'{alone}"
        )
    return pair


def compute_relative_pose(T_w_a: Array, T_w_b: Array) -> Array:
    """Return T_a_b (3, 4, B) from T_w_a and T_w_b (3, 4, B)."""
    R, B = T_w_a[:, :3], T_w_b.copy()
    with np.errstate(all="ignore"):  # a run may contain NaN
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
