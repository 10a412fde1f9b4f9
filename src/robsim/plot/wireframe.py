"""Solids of a scene as line segments and faces, in the frame of the figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate, pairwise

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.pose import IDENTITY
from robsim.geometry.primitives import Primitive
from robsim.plot import palette
from robsim.plot.camera_frustum import build_frustum_edges
from robsim.robot.robot import Robot
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

DrawableShapes = Callable[[Iterable[Primitive]], list[Primitive]]
SolidBuilder = Callable[..., "WireSolid"]  # of a label, a primitive, and optionally a colour
CameraSolidBuilder = Callable[[MountedCamera, float], "WireSolid"]  # of a camera and a depth

MOST_LINKS = 16  # a robot with more links has a single legend entry


@dataclass(frozen=True)
class WireSolid:
    """A solid with its edges as segments (E, 2, 3) and its faces, each (n, 3), in metres.

    Attributes
    ----------
    label : str
        Name in the legend.
    color : str
        Colour "#rrggbb".
    segments : array of shape (E, 2, 3)
        Edges.
    faces : tuple of arrays of shape (n, 3)
        Corners of each face.
    has_border : tuple of bool
        For each face, whether all its sides are edges.
    transparent : bool
        Whether the solid is transparent.
    pictures : tuple of FacePicture
        Pictures on faces, in axes of the frame of the solid. Only pages show them.
    """

    label: str
    color: str
    segments: Array
    faces: tuple[Array, ...] = ()
    has_border: tuple[bool, ...] = ()
    transparent: bool = False
    pictures: tuple[FacePicture, ...] = ()

    @property
    def points(self) -> Array:
        """The end points (P, 3) of all edges, and the corners of all faces."""
        return np.concatenate([self.segments.reshape(-1, 3), *self.faces])


@dataclass(frozen=True)
class ScenePart:
    """A solid in the axes of its frame, or a line from its frame to the frame `to`."""

    frame: str
    wire: WireSolid
    to: str = ""


def list_scene_parts(
    scene: Scene,
    depth: float,
    drawable: DrawableShapes | None = None,
    build: SolidBuilder | None = None,
    build_camera: CameraSolidBuilder | None = None,
) -> list[ScenePart]:
    """Return all solids of a scene; a camera without a body is a frustum of `depth` metres.

    A black camera gets an unused colour if other solids are black. `drawable`, `build` and
    `build_camera` replace `list_drawable_shapes`, `build_shape_solid` and `build_camera_solid`, to
    keep their results.
    """
    drawable, build = drawable or list_drawable_shapes, build or build_shape_solid
    every = [
        part for robot in scene.robots for part in _list_robot_parts(scene, robot, drawable, build)
    ]
    for obj in scene.objects:
        shapes = drawable(obj.solids)
        every += [ScenePart(obj.name, build(obj.name, shape)) for shape in shapes]
    for eye in scene.cameras:
        wire = (build_camera or build_camera_solid)(eye, depth)
        taken = {other.wire.color for other in every}
        free = palette.find_unused_color(taken) if wire.color == palette.BLACK else wire.color
        every.append(ScenePart(eye.name, replace(wire, color=free)))
    return every


def place_scene_parts(scene: Scene, q: Array, depth: float) -> list[WireSolid]:
    """Return all solids of a scene at q (nq,), in the frame of the figures."""
    return [
        place_part(part, partial(compute_display_pose, scene, q=q))
        for part in list_scene_parts(scene, depth)
    ]


def place_part(part: ScenePart, pose: Callable[[str], Array]) -> WireSolid:
    """Return the solid of a part; `pose` returns the pose (4, 4) of a frame by its name."""
    T = pose(part.frame)
    if part.to:
        T_end = pose(part.to)
        return replace(part.wire, segments=np.stack([T[:3, 3], T_end[:3, 3]])[None])
    corners = transform_points(np.concatenate([np.empty((0, 3)), *part.wire.faces]), T)
    ends = list(accumulate(map(len, part.wire.faces), initial=0))
    faces = tuple(corners[i:j] for i, j in pairwise(ends))
    return replace(part.wire, segments=transform_points(part.wire.segments, T), faces=faces)


def place_scene_marks(scene: Scene, q: Array) -> Array:
    """Return the feature points (M, 3) of all objects at q (nq,), in the frame of the figures."""
    points = [
        transform_points(obj.marks, compute_display_pose(scene, obj.name, q))
        for obj in scene.objects
    ]
    return np.concatenate([np.empty((0, 3)), *points])


def list_mark_colors(scene: Scene, first: Mapping[str, int]) -> list[str]:
    """Return the colour of each feature point of all objects, as in the images.

    `first` maps the name of an object to the number of its first point, 0 by default.
    """
    return [color for obj in scene.objects for color in list_object_mark_colors(obj, first)]


def list_object_mark_colors(obj: Object, first: Mapping[str, int]) -> list[str]:
    """Return the colours of the feature points of one object; `first` as in `list_mark_colors`."""
    return [palette.cycle_color(first.get(obj.name, 0) + i) for i in range(len(obj.marks))]


def compute_display_pose(scene: Scene, frame: str, q: Array) -> Array:
    """Return the pose (..., 4, 4) of a frame relative to the frame of the figures."""
    return np.asarray(scene.display.matrix @ scene.pose(frame, q).matrix)


def _list_robot_parts(
    scene: Scene, robot: Robot, drawable: DrawableShapes, build: SolidBuilder
) -> Iterator[ScenePart]:
    """Yield the shapes of a robot by link; without shapes, lines between the frames of its links.

    If the scene has several robots, each has one colour. A robot has a single entry in the legend
    if the scene has several robots, if the robot has many links, if all its shapes have one colour
    other than black, or if several of its links have several colours.
    """
    shapes_by_link = {link.name: drawable(link.shapes) for link in robot.links}
    shapes = [shape for each in shapes_by_link.values() for shape in each]
    several = len(scene.robots) > 1
    one_color = several or all(shape.color == "k" for shape in shapes)
    crowded = several or len(robot.links) > MOST_LINKS
    colors = {shape.color for shape in shapes}
    mixed = sum(len({shape.color for shape in each}) > 1 for each in shapes_by_link.values())
    single_entry = crowded or (not one_color and (len(colors) == 1 or mixed > 1))
    for i, link in enumerate(robot.links):
        own = (
            palette.cycle_color(scene.robots.index(robot))
            if crowded
            else palette.cycle_link_color(i)
        )
        label, frame = robot.name if single_entry else link.name, f"{robot.name}.{link.name}"
        for shape in shapes_by_link[link.name]:
            yield ScenePart(frame, build(label, shape, own if one_color else None))
        if not shapes and link.parent and not link.joint.model.roams:
            yield ScenePart(
                f"{robot.name}.{link.parent}", WireSolid(label, own, np.empty((0, 2, 3))), frame
            )


def list_scene_shapes(scene: Scene) -> dict[str, tuple[Primitive, ...]]:
    """Return the shapes of each link, object and camera of a scene, by frame."""
    links = [(f"{robot.name}.{k.name}", k.shapes) for robot in scene.robots for k in robot.links]
    objects = [(obj.name, obj.solids) for obj in scene.objects]
    bodies = [(eye.name, eye.camera.drawn(IDENTITY)) for eye in scene.cameras]
    return dict([*links, *objects, *((name, (body,) if body else ()) for name, body in bodies)])


def list_drawable_shapes(shapes: Iterable[Primitive]) -> list[Primitive]:
    """Return the shapes to draw; a mesh is replaced by the content of its file, if readable."""
    return [each for shape in shapes for each in shape.shown() if len(each.vertices)]


def build_shape_solid(label: str, shape: Primitive, color: str | None = None) -> WireSolid:
    """Return a primitive as a solid, in its own colour or in another one."""
    (corners, rounds), edges = shape.skin, {tuple(edge) for edge in shape.edges.tolist()}
    faces = tuple(corners[list(face)] for face in rounds)
    sides = [zip(face, face[1:] + face[:1], strict=True) for face in rounds]
    has_border = tuple(all((min(pair), max(pair)) in edges for pair in each) for each in sides)
    shown = palette.convert_color(color or shape.figure_color)
    pictures = tuple(shape.face_pictures.values())
    return WireSolid(label, shown, corners[shape.edges], faces, has_border, pictures=pictures)


def build_camera_solid(eye: MountedCamera, depth: float) -> WireSolid:
    """Return the body of a camera, or the frustum of its field of view."""
    body = eye.camera.drawn(IDENTITY)
    if body is not None:
        return build_shape_solid(eye.name, body)
    edges, faces = build_frustum_edges(eye.camera, depth)
    return WireSolid(eye.name, palette.BLACK, edges, faces, transparent=True)


def transform_points(points: Array, T: Array) -> Array:
    """Return points (..., 3) transformed by T (4, 4)."""
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])
