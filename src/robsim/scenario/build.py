"""From the tables of the schema to the values of robsim."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, suggest
from robsim.describe.scene import SHAPES
from robsim.geometry.inertia import Inertia
from robsim.geometry.primitives import Primitive
from robsim.robot.joint import units_of
from robsim.robot.link import Link, coordinate_names
from robsim.robot.robot import Robot
from robsim.scenario import schema
from robsim.scenario.joint import joint
from robsim.scenario.place import pose
from robsim.scenario.problems import Problems, under
from robsim.scenario.quantity import coordinate
from robsim.vision.camera import Camera
from robsim.world.motion import Motion
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

MOST_LINKS_IN_ALL = 1024
POSE_KEYS = set(schema.PoseKeys.model_fields)
T = TypeVar("T", bound=schema.PartTable)
V = TypeVar("V")


def scene(table: schema.SceneTable, problems: Problems, *prefix: str | int) -> Scene:
    """The scene; FileError with all that is wrong."""
    robots = _each(table.robots, robot, problems, *prefix, "robots")
    objects = _each(table.objects, thing, problems, *prefix, "objects")
    cameras = _each(table.cameras, camera, problems, *prefix, "cameras")
    with problems.at(*prefix, "display"):
        display = pose(table.display)
    _check_frames(table, robots, problems, prefix)
    problems.stop()
    made = None
    with problems.at(*prefix):
        with under("motions"):
            motions = tuple(_motion(each, robots) for each in table.motions)
        made = Scene(robots, objects, cameras, motions, display=display)
    return problems.settled(made)


def robot(table: schema.RobotTable) -> Robot:
    """A robot with its tools, where it stands."""
    made = _linked(table)
    for tool in table.tools:
        with under("tools", tool.name):
            made = made.with_tool(_linked(tool), pose(tool), tool.on, tool.bare)
    return replace(made, base=pose(table), on=table.on)


def _linked(table: schema.LinkedTable) -> Robot:
    """A robot in the world, its links and its home."""
    links: list[Link] = []
    for part in table.links:
        with under("links", part.name):
            links.append(_link(part, table.convention, links))
    units = units_of([link.joint for link in links])
    home = None
    if table.home is not None:
        with under("home"):
            home = configuration(table.home, units, coordinate_names(links))
    try:
        return Robot(table.name, tuple(links), home)
    except InputError as error:  # of home, or of links that do not go together
        with under("home" if str(error).startswith(f"{table.name}.home") else "links"):
            raise


def configuration(
    given: Sequence[Any], units: Sequence[str], names: Sequence[str], what: str = "coordinates"
) -> Array:
    """Coordinates or velocities, each in the unit of its joint."""
    if len(given) != len(units):
        expected = ", ".join(names) or "none"
        raise InputError(f"{len(given)} {what}, expected {len(units)}: {expected}")
    values = np.empty(len(units))
    for i, (value, unit) in enumerate(zip(given, units, strict=True)):
        with under(i):
            values[i] = coordinate(value, unit)
    return values


def thing(table: schema.ObjectTable) -> Object:
    """An object; its marks are the vertices of its shapes unless they are given."""
    marks = None if table.marks is None else np.array(table.marks).reshape(-1, 3)
    made = Object(table.name, _shapes(table.shapes), marks, pose(table), table.on)
    if len(made.marks) > schema.MOST_MARKS:
        raise InputError(f"{len(made.marks)} marks; at most {schema.MOST_MARKS}: name them (marks)")
    return made


def camera(table: schema.CameraTable) -> MountedCamera:
    """A camera where it is mounted."""
    size = None if table.size is None else (table.size[0], table.size[1])
    body = None
    if table.body is not None:
        with under("body"):
            body = _brick(table.body)
    K = np.array(_intrinsics(table))
    with under("K"):
        lens = Camera(K, size, body=body)
    with under("distortion"):
        lens = replace(lens, distortion=tuple(table.distortion))
    return MountedCamera(table.name, lens, table.on, pose(table))


def _motion(table: schema.MotionTable, robots: Sequence[Robot]) -> Motion:
    """Its rates are in the units of the robot's velocities."""
    known = {robot.name: robot for robot in robots}
    with under(table.robot):
        if table.robot not in known:
            hint = suggest(table.robot, known, "robots")
            raise InputError(f"no robot '{table.robot}' to move; {hint}")
        robot = known[table.robot]
        with under("rates"):
            rates = configuration(table.rates, robot.velocity_units, robot.velocity_names, "rates")
    return Motion(table.robot, rates)


def _intrinsics(table: schema.CameraTable) -> list[list[float]]:
    parts = [key for key in ("focal", "center", "skew") if getattr(table, key) is not None]
    if table.K is not None:
        if parts:
            raise InputError(f"K and {', '.join(parts)}: give K alone, or focal and its companions")
        return table.K
    if table.focal is None:
        raise InputError(
            "focal is missing: give K = [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] "
            "or focal = [fx, fy], in pixels"
        )
    if table.center is None and table.size is None:
        raise InputError("center is missing: give it, or size, whose middle it then is")
    (fx, fy), (cx, cy) = table.focal, table.center or [(n - 1) / 2 for n in table.size or ()]
    return [[fx, table.skew or 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def _link(table: schema.LinkTable, convention: str, before: list[Link]) -> Link:
    """A link; it hangs from the one before it unless it says otherwise."""
    if not before and (table.parent or table.joint != "fixed" or table.dh):
        raise InputError(
            "the first link is the base: it has no parent, joint or dh; a robot that moves as a "
            "whole gets a base link first, and then its moving link"
        )
    parent = table.parent or (before[-1].name if before else None)
    shapes = _shapes(table.shapes)
    return Link(table.name, parent, joint(table, convention), shapes, _inertia(table.inertia))


def _inertia(table: schema.InertiaTable | None) -> Inertia | None:
    if table is None:
        return None
    tensor = np.diag(table.moments)
    for (i, j), product in zip(((0, 1), (0, 2), (1, 2)), table.products, strict=True):
        tensor[i, j] = tensor[j, i] = product
    with under("inertia"):
        return Inertia(table.mass, table.centre, tensor)


def _shapes(tables: Iterable[schema.ShapeTable]) -> tuple[Primitive, ...]:
    made: list[Primitive] = []
    for i, table in enumerate(tables):
        with under("shapes", i):
            made.append(_brick(table))
    return tuple(made)


def _brick(table: Any) -> Any:
    """A shape of the kind that the table says; a table without one is the body of a camera."""
    given = {key: value for key, value in table if key not in POSE_KEYS and key != "kind"}
    if "scale" in given:
        given["scale"] = tuple(given["scale"])
    return SHAPES[getattr(table, "kind", "camera")](**given, pose=pose(table))


def _each(
    tables: Sequence[T], build: Callable[[T], V], problems: Problems, *prefix: str | int
) -> tuple[V, ...]:
    """What each table says, with the problems of all of them."""
    made = []
    for table in tables:
        with problems.at(*prefix, table.name):
            made.append(build(table))
    return tuple(made)


def _check_frames(
    table: schema.SceneTable,
    robots: Sequence[Robot],
    problems: Problems,
    prefix: Iterable[str | int],
) -> None:
    """What each thing stands on must exist."""
    kinds: dict[str, Sequence[schema.PartTable]] = {
        "robots": table.robots,
        "objects": table.objects,
        "cameras": table.cameras,
    }
    frames = ["world", *(f"{r.name}.{k.name}" for r in table.robots for k in r.links)]
    carried = [f"{r.name}.{k.name}" for r in robots for k in r.links]
    frames += [name for name in carried if name not in frames]
    unknown = {r.name for r in table.robots if r.tools} - {r.name for r in robots}
    if len(frames) > MOST_LINKS_IN_ALL:
        problems.add("robots", f"more than {MOST_LINKS_IN_ALL} links in all")
        return
    frames += [part.name for part in (*table.objects, *table.cameras)]
    for kind, parts in kinds.items():
        for part in parts:
            if part.on not in frames and part.on.partition(".")[0] not in unknown:
                with problems.at(*prefix, kind, part.name, "on"):
                    raise InputError(f"no frame {part.on!r}; {suggest(part.on, frames, 'frames')}")
