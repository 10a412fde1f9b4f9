"""A scene at one configuration as line segments, in the frame of the figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import IDENTITY
from robsim.geometry.primitives import Primitive
from robsim.plot import palette
from robsim.robot.robot import Robot
from robsim.vision.camera import Camera
from robsim.vision.plane import with_one
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

MOST_LINKS = 16  # of a robot with a legend entry for each link, at most
_BORDERLESS = ((-0.4, -0.3), (0.4, -0.3), (0.4, 0.3), (-0.4, 0.3))  # drawn without an image size


@dataclass(frozen=True)
class Wire:
    """A solid with its edges as segments (E, 2, 3) and its faces, each (n, 3), in metres.

    `bordered` tells for each face whether all its sides are edges. A `sheer` solid is transparent.
    """

    label: str
    color: str
    segments: Array
    faces: tuple[Array, ...] = ()
    bordered: tuple[bool, ...] = ()
    sheer: bool = False

    @property
    def points(self) -> Array:
        """The end points (P, 3) of all edges, and the corners of all faces."""
        return np.concatenate([self.segments.reshape(-1, 3), *self.faces])


@dataclass(frozen=True)
class Part:
    """A solid in the axes of the frame of a scene that carries it, or a line to another frame."""

    frame: str
    wire: Wire
    to: str = ""


def parts(scene: Scene, depth: float) -> list[Part]:
    """Return all solids of a scene, with a pyramid for a camera without a body.

    The pyramid is `depth` metres deep.

    A black camera among other black things gets an unused colour.
    """
    found = [part for robot in scene.robots for part in _robot(scene, robot)]
    for thing in scene.objects:
        shapes = shown(thing.shapes)
        found += [Part(thing.name, shape_wire(thing.name, shape)) for shape in shapes]
    for eye in scene.cameras:
        wire = camera(eye, depth)
        taken = {other.wire.color for other in found}
        free = palette.unused(taken) if wire.color == palette.BLACK else wire.color
        found.append(Part(eye.name, replace(wire, color=free)))
    return found


def wires(scene: Scene, q: Array, depth: float) -> list[Wire]:
    """Return the `parts` of a scene where they are at q (nq,), in the frame of the figures."""
    return [placed(part, partial(displayed, scene, q=q)) for part in parts(scene, depth)]


def placed(part: Part, pose: Callable[[str], Array]) -> Wire:
    """Return the wire of a part where the poses (4, 4) of its frames are, asked for by name."""
    T = pose(part.frame)
    if part.to:
        there = pose(part.to)
        return replace(part.wire, segments=np.stack([T[:3, 3], there[:3, 3]])[None])
    faces = tuple(moved(face, T) for face in part.wire.faces)
    return replace(part.wire, segments=moved(part.wire.segments, T), faces=faces)


def marks(scene: Scene, q: Array) -> Array:
    """Return the marks (M, 3) of all objects at q (nq,)."""
    placed = [moved(thing.marks, displayed(scene, thing.name, q)) for thing in scene.objects]
    return np.concatenate([np.empty((0, 3)), *placed])


def mark_colors(scene: Scene, first: Mapping[str, int]) -> list[str]:
    """Return the colour of each of `marks`: that of its number, as in the image.

    `first` is the number of the first mark of an object, 0 where it is left out.
    """
    return [color for thing in scene.objects for color in colors_of(thing, first)]


def colors_of(thing: Object, first: Mapping[str, int]) -> list[str]:
    """Return the colours of the marks of an object, likewise."""
    return [palette.nth(first.get(thing.name, 0) + i) for i in range(len(thing.marks))]


def displayed(scene: Scene, frame: str, q: Array) -> Array:
    """Return the pose (..., 4, 4) of a frame in that of the figures: gT0 times its own."""
    return np.asarray(scene.display.matrix @ scene.pose(frame, q).matrix)


def _robot(scene: Scene, robot: Robot) -> Iterator[Part]:
    """Yield the shapes of a robot link by link; without any, lines from frame to frame.

    Among several robots each has one colour, and one entry in the legend. A robot with one colour,
    or several links of several colours, has one entry, too.
    """
    drawn = {link.name: shown(link.shapes) for link in robot.links}
    shapes = [shape for each in drawn.values() for shape in each]
    several = len(scene.robots) > 1
    plain = several or all(shape.color == "k" for shape in shapes)
    crowded = several or len(robot.links) > MOST_LINKS
    colors = {shape.color for shape in shapes}
    mixed = sum(len({shape.color for shape in each}) > 1 for each in drawn.values())
    whole = crowded or (not plain and (len(colors) == 1 or mixed > 1))
    for i, link in enumerate(robot.links):
        own = palette.nth(scene.robots.index(robot)) if crowded else palette.link(i)
        label, frame = robot.name if whole else link.name, f"{robot.name}.{link.name}"
        for shape in drawn[link.name]:
            yield Part(frame, shape_wire(label, shape, own if plain else None))
        if not shapes and link.parent and not link.joint.model.roams:
            yield Part(f"{robot.name}.{link.parent}", Wire(label, own, np.empty((0, 2, 3))), frame)


def shapes_of(scene: Scene) -> dict[str, tuple[Primitive, ...]]:
    """Return the shapes that each link, object and camera of a scene has, by its frame."""
    links = [(f"{robot.name}.{k.name}", k.shapes) for robot in scene.robots for k in robot.links]
    things = [(thing.name, thing.shapes) for thing in scene.objects]
    bodies = [(eye.name, eye.camera.drawn(IDENTITY)) for eye in scene.cameras]
    return dict([*links, *things, *((name, (body,) if body else ()) for name, body in bodies)])


def shown(shapes: Iterable[Primitive]) -> list[Primitive]:
    """Return what is drawn of shapes: of a mesh what its file holds, and nothing without it."""
    return [each for shape in shapes for each in shape.shown() if len(each.vertices)]


def shape_wire(label: str, shape: Primitive, color: str | None = None) -> Wire:
    """Return the wire of a primitive, in its own colour or another."""
    (corners, rounds), edges = shape.skin, {tuple(edge) for edge in shape.edges.tolist()}
    faces = tuple(corners[list(face)] for face in rounds)
    sides = [zip(face, face[1:] + face[:1], strict=True) for face in rounds]
    bordered = tuple(all((min(pair), max(pair)) in edges for pair in each) for each in sides)
    return Wire(label, palette.color(color or shape.color), corners[shape.edges], faces, bordered)


def camera(eye: MountedCamera, depth: float) -> Wire:
    """Return the body of a camera, or the pyramid of its field of view."""
    body = eye.camera.drawn(IDENTITY)
    if body is not None:
        return shape_wire(eye.name, body)
    centre, rim = np.zeros(3), depth * corner_rays(eye.camera)
    sides = [(rim[i], rim[(i + 1) % 4]) for i in range(4)]
    edges = np.array([(centre, corner) for corner in rim] + sides)
    faces = tuple(np.stack([centre, *side]) for side in sides)
    return Wire(eye.name, palette.BLACK, edges, faces, sheer=True)


def border_corners(camera: Camera) -> Array:
    """Return the corners (4, 2) of the image, clockwise from the upper left one."""
    (left, right), (top, bottom) = camera.border
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])


def corner_rays(camera: Camera) -> Array:
    """Return the points (4, 3) at unit depth on the rays through the image corners."""
    corners = np.array(_BORDERLESS)
    if camera.size is not None:
        corners = camera.normalise(border_corners(camera))
    return with_one(corners)


def moved(points: Array, T: Array) -> Array:
    """Return points (..., 3) transformed by T."""
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])
