"""Pictures of a scene in its cameras."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.geometry.primitives import Primitive
from robsim.rendering.light import Light
from robsim.rendering.rendered_face import RenderedFace, list_shape_faces, list_target_faces
from robsim.rendering.renderer import Renderer
from robsim.robot.robot import Robot
from robsim.robot.tree import Tree
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object

MOST_PIXELS = 500_000_000  # of all pictures of one call, with their samples
MOST_SAMPLES = 8


@dataclass(frozen=True)
class PictureBodies:
    """The bodies of a scene that its pictures show.

    Attributes
    ----------
    robots, objects, cameras : tuple
        Parts of the scene.
    tree : Tree
        Kinematic tree of their frames.
    """

    robots: tuple[Robot, ...]
    objects: tuple[Object, ...]
    cameras: tuple[MountedCamera, ...]
    tree: Tree


def draw_bodies(
    bodies: PictureBodies,
    q: Array,
    eye: MountedCamera,
    samples: int,
    light: Light,
    background: float,
) -> NDArray[np.float32]:
    """Return the grey values (..., h, w) of bodies at coordinates q (..., nq)."""
    if eye.camera.size is None:
        raise InputError(f"camera '{eye.name}' has no size, which a picture needs")
    lead, (width, height) = q.shape[:-1], eye.camera.size
    if (count := int(np.prod(lead)) * width * height * samples**2) > MOST_PIXELS:
        raise InputError(f"pictures of {count} pixels and samples; at most {MOST_PIXELS}")
    frames = dict(_list_faces(bodies, eye))
    poses = bodies.tree.bodies(move_runs_last(q, 1))

    def find_pose(name: str) -> Pose:
        return Pose(homogeneous_matrix(bodies.tree.frame(poses, name), lead))

    T_c_w = find_pose(eye.name).inv()
    T_c_b = [(T_c_w @ find_pose(name)).matrix.reshape(-1, 4, 4) for name in frames]
    direction = (T_c_w.rotation @ light.unit_direction).reshape(-1, 3)
    renderer = Renderer(eye.camera, list(frames.values()), samples, background)
    images = np.empty((len(direction), height, width), dtype=np.float32)
    for k, toward in enumerate(direction):
        T_here = np.array([T[k] for T in T_c_b]).reshape(-1, 4, 4)
        images[k] = renderer.draw(T_here, (*toward, light.ambient))
    return images.reshape(*lead, height, width)


def _list_faces(
    bodies: PictureBodies, eye: MountedCamera
) -> Iterator[tuple[str, list[RenderedFace]]]:
    """Yield the frames that have faces, and these faces, but not the body of the camera."""
    for robot in bodies.robots:
        for link in robot.links:
            yield from _list_frame_faces(f"{robot.name}.{link.name}", link.shapes)
    for thing in bodies.objects:
        printed = [] if thing.target is None else list_target_faces(thing.target)
        yield from _list_frame_faces(thing.name, thing.shapes, printed)
    for other in bodies.cameras:
        body = other.camera.drawn(Pose.at())
        if body is not None and other.name != eye.name:
            yield from _list_frame_faces(other.name, (body,))


def _list_frame_faces(
    name: str, shapes: tuple[Primitive, ...], printed: list[RenderedFace] | None = None
) -> Iterator[tuple[str, list[RenderedFace]]]:
    """Yield the name of a frame and its faces, if there are any."""
    faces = [face for shape in shapes for face in list_shape_faces(shape)] + (printed or [])
    if faces:
        yield name, faces
