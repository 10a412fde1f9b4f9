"""A scene at one configuration as line segments, in the frame of the figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import IDENTITY
from robsim.geometry.primitives import Primitive
from robsim.plot import palette
from robsim.robot.robot import Robot
from robsim.vision.camera import Camera
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene import Scene

_BORDERLESS = ((-0.4, -0.3), (0.4, -0.3), (0.4, 0.3), (-0.4, 0.3))  # drawn without an image size


@dataclass(frozen=True)
class Wire:
    """One solid: its edges as segments (E, 2, 3) and its faces, each (n, 3); metres."""

    label: str
    color: str
    segments: Array
    faces: tuple[Array, ...] = ()

    @property
    def points(self) -> Array:
        """(2 E, 3)."""
        return self.segments.reshape(-1, 3)


def wires(scene: Scene, q: Array, depth: float) -> list[Wire]:
    """All solids at q (nq,). A camera without a body is a pyramid, `depth` metres deep."""
    drawn = [wire for robot in scene.robots for wire in _robot(scene, robot, q)]
    for thing in scene.objects:
        T = displayed(scene, thing.name, q)
        drawn += [
            _shape(thing.name, shape.color, shape, T) for shape in thing.shapes if len(shape.edges)
        ]
    return drawn + [_camera(eye, displayed(scene, eye.name, q), depth) for eye in scene.cameras]


def marks(scene: Scene, q: Array) -> Array:
    """(M, 3) marks of all objects at q (nq,)."""
    placed = [_moved(thing.marks, displayed(scene, thing.name, q)) for thing in scene.objects]
    return np.concatenate([np.empty((0, 3)), *placed])


def mark_colors(scene: Scene, first: Mapping[str, int]) -> list[str]:
    """The colour of each of `marks`: that of its number, as in the image.

    `first` is the number of the first mark of an object, 0 where it is left out.
    """
    return [
        palette.nth(first.get(thing.name, 0) + i)
        for thing in scene.objects
        for i in range(len(thing.marks))
    ]


def displayed(scene: Scene, frame: str, q: Array) -> Array:
    """(..., 4, 4) pose of a frame in that of the figures: gT0 times its pose in the world."""
    T: Array = scene.display.matrix @ scene.pose(frame, q).matrix
    return T


def _robot(scene: Scene, robot: Robot, q: Array) -> Iterator[Wire]:
    """Link by link its shapes; of a robot that has none, lines from frame to frame.

    Among several robots each has one colour, and one entry in the legend. A mesh is a name alone:
    nothing of it is drawn.
    """
    drawn = {link.name: [s for s in link.shapes if len(s.edges)] for link in robot.links}
    shapes = [shape for each in drawn.values() for shape in each]
    several = len(scene.robots) > 1
    plain = several or all(shape.color == "k" for shape in shapes)
    whole = several or (not plain and len({shape.color for shape in shapes}) == 1)
    for i, link in enumerate(robot.links):
        own = palette.nth(scene.robots.index(robot) if several else i - 1)
        label = robot.name if whole else link.name
        T = displayed(scene, f"{robot.name}.{link.name}", q)
        for shape in drawn[link.name]:
            yield _shape(label, own if plain else shape.color, shape, T)
        if not shapes and link.parent and not link.joint.model.roams:
            above = displayed(scene, f"{robot.name}.{link.parent}", q)
            yield Wire(label, own, np.stack([above[:3, 3], T[:3, 3]])[None])


def _shape(label: str, color: str, shape: Primitive, T: Array) -> Wire:
    corners = shape.at(T).vertices
    faces = tuple(corners[list(face)] for face in shape.faces)
    return Wire(label, palette.color(color), corners[shape.edges], faces)


def _camera(eye: MountedCamera, T: Array, depth: float) -> Wire:
    body = eye.camera.drawn(T)
    if body is not None:
        return _shape(eye.name, body.color, body, IDENTITY.matrix)
    centre, rim = T[:3, 3], _moved(depth * _corner_rays(eye.camera), T)
    sides = [(rim[i], rim[(i + 1) % 4]) for i in range(4)]
    edges = np.array([(centre, corner) for corner in rim] + sides)
    return Wire(eye.name, palette.BLACK, edges, tuple(np.stack([centre, *side]) for side in sides))


def _corner_rays(camera: Camera) -> Array:
    """(4, 3) points at unit depth that the corners of the image see, around the image."""
    corners = np.array(_BORDERLESS)
    if camera.size is not None:
        (left, right), (top, bottom) = camera.border
        corners = camera.normalise([(left, top), (right, top), (right, bottom), (left, bottom)])
    return np.column_stack([corners, np.ones(4)])


def _moved(points: Array, T: Array) -> Array:
    """T @ p for points (N, 3)."""
    out: Array = points @ T[:3, :3].T + T[:3, 3]
    return out
