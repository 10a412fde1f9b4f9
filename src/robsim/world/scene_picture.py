"""Pictures of a scene in its cameras."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import chain
from threading import Lock
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import InputError
from robsim.declare import fields_of
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Primitive
from robsim.geometry.primitives.unreadable_meshes import warn_unreadable_meshes
from robsim.rendering.development import Development
from robsim.rendering.light import Light
from robsim.rendering.recent_values import RecentValues
from robsim.rendering.rendered_face import RenderedFace, list_shape_faces, list_target_faces
from robsim.rendering.renderer import Renderer
from robsim.rendering.sensor import Sensor
from robsim.robot.robot import Robot
from robsim.robot.tree import RunNumbers, Tree
from robsim.vision.optics import Optics
from robsim.vision.tags.tag import Tag
from robsim.world.mounted_camera import MountedCamera, get_picture_size
from robsim.world.object import Object, PrintedTarget

MOST_PIXELS = 500_000_000  # of all pictures of one call, with their samples
MOST_KEPT_PIXELS = 2_000_000  # with samples, of a camera whose buffers are kept: 24 MB
KEPT_RENDERERS = 64  # of runs with different cameras or tags


class PicturedScene(Protocol):
    """The parts of a scene that its pictures show, as a `Scene` has them."""

    @property
    def robots(self) -> tuple[Robot, ...]:
        """The robots."""

    @property
    def objects(self) -> tuple[Object, ...]:
        """The objects, with their printed targets."""

    @property
    def cameras(self) -> tuple[MountedCamera, ...]:
        """The cameras, whose housings are seen by other cameras."""

    @property
    def tree(self) -> Tree:
        """The kinematic tree of all frames."""

    @property
    def light(self) -> Light:
        """The light."""

    @property
    def background(self) -> float:
        """The grey value of pixels without a body."""


class NoiseKey(NamedTuple):
    """The key of the noise in pictures: a seed, the number (B,) of each run, and the step."""

    seed: int
    runs: NDArray[np.uint64]
    step: int


class CameraPictures:
    """Pictures of one camera at many coordinates of its scene.

    A renderer has one memory, so that one thread may use it at a time, under the `lock`. Raise
    InputError if the camera has no size.
    """

    def __init__(
        self, scene: PicturedScene, eye: MountedCamera, samples: int | None = None
    ) -> None:
        self.scene, self.eye, self.lock = scene, eye, Lock()
        self.size = get_picture_size(eye)
        self.samples = eye.samples if samples is None else samples
        self.frames = list(_list_faces(scene, eye, 0))
        self._quaternions = list(_find_quaternions(scene.robots))
        self._differ = (
            eye.camera.rows.shape[1] > 1
            or any(_has_arrays(thing.tag) for thing in scene.objects if thing.tag)
            or (eye.optics is not None and _has_arrays(eye.optics))
        )
        self._renderer = lru_cache(KEPT_RENDERERS)(self._make_renderer)
        self._development = lru_cache(KEPT_RENDERERS)(self._make_development)

    def draw(
        self, q: Array, runs: RunNumbers = None, T_w_c: Array | None = None
    ) -> NDArray[np.float32]:
        """Return the grey values (B, h, w) at coordinates q (nq, B).

        `runs` (B,) are the indices of the runs, used if numbers of the scene differ from run to
        run. By default the runs come in order. T_w_c (3, 4, B) replaces the pose of the camera.
        """
        width, height = self.size
        T_c_b, light = self.place(q, runs, T_w_c)
        if not self._differ:
            return self._renderer(0).draw_many(T_c_b, light)
        images = np.empty((len(light), height, width), dtype=np.float32)
        for b, image in enumerate(images):
            run = int(b if runs is None else runs[b])
            image[:] = self._renderer(run).draw(T_c_b[b], light[b])
        return images

    def take(
        self,
        q: Array,
        rates: Array,
        key: NoiseKey,
        runs: RunNumbers = None,
        T_w_c: Array | None = None,
    ) -> NDArray[np.uint8]:
        """Return the grey values (B, h, w) at coordinates q (nq, B), with the errors of optics.

        `rates` (nq, B) are the velocities of the coordinates during the exposure. T_w_c (3, 4, B)
        replaces the pose of the camera; it is then at rest, without optics.
        """
        if self.eye.optics is None or T_w_c is not None:
            return round_greys(self.draw(q, runs, T_w_c))
        return np.array([self._take_one(q, rates, key, runs, b) for b in range(q.shape[1])])

    def _take_one(
        self, q: Array, rates: Array, key: NoiseKey, runs: RunNumbers, b: int
    ) -> NDArray[np.uint8]:
        """Return the grey values (h, w) of one run of several."""
        run = b if runs is None else int(runs[b])
        development = self._development(run if self._differ else 0)
        back = development.offsets
        before = np.ascontiguousarray(q[:, b, None] - rates[:, b, None] * back)
        for rows in self._quaternions:
            before[rows] /= np.linalg.norm(before[rows], axis=0)
        T_c_b, light = self.place(before, np.full(len(back), run))
        return development.draw(T_c_b, light, key.seed, int(key.runs[b]), key.step)

    def place(
        self, q: Array, runs: RunNumbers = None, T_w_c: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the poses (B, bodies, 4, 4) in camera axes, and the light (B, 4), at q (nq, B)."""
        tree = self.scene.tree
        poses = tree.bodies(q, runs)
        T_w_c = tree.frame(poses, self.eye.name, runs) if T_w_c is None else T_w_c
        T_c_b = np.zeros((q.shape[1], len(self.frames), 4, 4))
        T_c_b[:, :, 3, 3] = 1.0
        for k, (name, _) in enumerate(self.frames):
            T_c_b[:, k, :3] = np.moveaxis(
                _express_in_camera(T_w_c, tree.frame(poses, name, runs)), -1, 0
            )
        x, y, z = self.scene.light.unit_direction
        toward = T_w_c[0, :3] * x + T_w_c[1, :3] * y + T_w_c[2, :3] * z
        return T_c_b, np.column_stack([*toward, np.full(q.shape[1], self.scene.light.ambient)])

    def _make_development(self, run: int) -> Development:
        """Return the development of the pictures of a run."""
        assert self.eye.optics is not None
        optics, camera = self.eye.optics.of_run(run), self.eye.camera.of_run(run)
        return Development(self._renderer(run), optics, camera)

    def _make_renderer(self, run: int) -> Renderer:
        """Return the renderer of a run."""
        camera = self.eye.camera.of_run(run)
        faces = [faces for _, faces in _list_faces(self.scene, self.eye, run)]
        return Renderer(camera, faces, self.samples, self.scene.background)


def _express_in_camera(T_w_c: Array, T_w_b: Array) -> Array:
    """Return T_c_b (3, 4, B) from T_w_c and T_w_b (3, 4, B)."""
    from_camera = np.array(np.broadcast_to(T_w_b, (*T_w_b.shape[:2], T_w_c.shape[2])))
    from_camera[:, 3] -= T_w_c[:, 3]
    R = T_w_c[:, :3, None]  # sums one by one, so that the bits do not depend on the batch
    T: Array = R[0] * from_camera[0] + R[1] * from_camera[1] + R[2] * from_camera[2]
    return T


def warn_missing_meshes(scene: PicturedScene) -> None:
    """Issue one FileWarning if meshes are missing in pictures of a scene."""
    parts = [link.shapes for robot in scene.robots for link in robot.links]
    shapes = chain(*parts, *(thing.shapes for thing in scene.objects))
    warn_unreadable_meshes(shapes, with_unknown=True)


def draw_scene(
    scene: PicturedScene, q: Array, eye: MountedCamera, samples: int
) -> NDArray[np.float32]:
    """Return the grey values (..., h, w) of a scene at coordinates q (..., nq)."""
    lead, (width, height) = q.shape[:-1], get_picture_size(eye)
    if (count := int(np.prod(lead)) * width * height * samples**2) > MOST_PIXELS:
        raise InputError(f"pictures of {count} pixels and samples; at most {MOST_PIXELS}")
    pictures = _find_pictures(scene, eye, samples)
    with pictures.lock:
        return pictures.draw(move_runs_last(q, 1)).reshape(*lead, height, width)


def _find_pictures(scene: PicturedScene, eye: MountedCamera, samples: int) -> CameraPictures:
    """Return the pictures of a camera; the last ones are kept."""

    def build() -> CameraPictures:
        return CameraPictures(scene, eye, samples)

    width, height = get_picture_size(eye)
    if width * height * samples**2 > MOST_KEPT_PIXELS:
        return build()
    held = scene.robots, scene.objects, scene.cameras
    key = (*map(id, held), eye.name, samples, scene.light, scene.background)
    return _RECENT.find(key, held, build)


def _find_quaternions(robots: Iterable[Robot]) -> Iterator[slice]:
    """Yield the rows of the unit quaternions among the coordinates of robots."""
    start = 0
    for link in (link for robot in robots for link in robot.links):
        size = len(link.joint.parts.coordinates)
        if link.joint.model.free:
            yield slice(start + size - 4, start + size)
        start += size


_RECENT: RecentValues[CameraPictures] = RecentValues(4)


def _has_arrays(value: Tag | Optics) -> bool:
    """Return whether a number of a tag or of optics differs from run to run."""
    return any(np.ndim(vars(value)[each.name]) for each in fields_of(type(value)))


def round_greys(images: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return whole grey values from 0 to 255."""
    whole = np.rint(images)
    np.maximum(whole, 0.0, out=whole)
    np.minimum(whole, 255.0, out=whole)
    greys: NDArray[np.uint8] = whole.astype(np.uint8)
    return greys


def develop_pictures(
    images: NDArray[np.float32], eye: MountedCamera, seed: int
) -> NDArray[np.uint8]:
    """Return the grey values of light (..., h, w); the run of a picture is its number."""
    if eye.optics is None:
        return round_greys(images)
    sensor = Sensor(eye.optics, eye.camera)
    pictures = images.reshape(-1, *images.shape[-2:])
    developed = [sensor.develop(each, seed, run) for run, each in enumerate(pictures)]
    return np.array(developed, dtype=np.uint8).reshape(images.shape)


def _list_faces(
    scene: PicturedScene, eye: MountedCamera, run: int
) -> Iterator[tuple[str, list[RenderedFace]]]:
    """Yield the frames that have faces, and these faces, but not the body of the camera."""
    for robot in scene.robots:
        for link in robot.links:
            yield from _list_frame_faces(f"{robot.name}.{link.name}", link.shapes)
    for thing in scene.objects:
        target = get_target_of_run(thing, run)
        printed = list_target_faces(target) if isinstance(target, PrintedTarget) else []
        yield from _list_frame_faces(thing.name, thing.shapes, printed)
    for other in scene.cameras:
        body = other.camera.drawn(Pose.at())
        if body is not None and other.name != eye.name:
            yield from _list_frame_faces(other.name, (body,))


def get_target_of_run(thing: Object, run: int) -> PrintedTarget | FacePicture | None:
    """Return the printed target of an object, or the picture under its marks, in one run."""
    target = thing.mark_target
    if isinstance(target, Tag) and _has_arrays(target):
        return replace(target, size=float(np.asarray(target.size)[run]))
    return target


def _list_frame_faces(
    name: str, shapes: tuple[Primitive, ...], printed: list[RenderedFace] | None = None
) -> Iterator[tuple[str, list[RenderedFace]]]:
    """Yield the name of a frame and its faces, if there are any."""
    faces = [face for shape in shapes for face in list_shape_faces(shape)] + (printed or [])
    if faces:
        yield name, faces
