"""Robots, objects, cameras and motions as tables."""

from __future__ import annotations

from robsim.describe.joint import joint
from robsim.describe.values import (
    NoDescription,
    Table,
    builtin,
    coordinates,
    length,
    listed,
    ours,
    pose,
    quantity,
)
from robsim.geometry.inertia import Inertia
from robsim.geometry.primitives import Ball, Block, CameraBody, Mesh, Primitive, Wheel
from robsim.robot.link import Link
from robsim.robot.robot import Robot
from robsim.vision.camera import Camera
from robsim.world.motion import Motion
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

SHAPES: dict[str, type[Primitive]] = {
    "block": Block,
    "wheel": Wheel,
    "camera": CameraBody,
    "ball": Ball,
    "mesh": Mesh,
}
WEIGHTS = {"mass": "kg", "density": "kg/m^3"}


def shape(value: Primitive) -> Table:
    """One primitive; NoDescription if it is somebody's own kind."""
    kind = builtin(SHAPES, value)
    if not isinstance(value.color, str):
        raise NoDescription(f"the color {value.color!r:.40} is not a text")
    table: Table = {"kind": kind}
    for key, given in vars(value).items():
        if key in WEIGHTS:
            table |= {} if given is None else {key: quantity(given, WEIGHTS[key])}
        elif isinstance(given, float):
            table[key] = length(given)
        elif key in ("n", "filename"):
            table[key] = given if isinstance(given, str) else int(given)
        elif key == "scale":
            table[key] = list(given)
    return {**table, "color": value.color, **pose(value.pose)}


def inertia(value: Inertia) -> Table:
    """All of it: moments ixx, iyy, izz, products ixy, ixz, iyz."""
    I = ours(value, Inertia).tensor
    return {
        "mass": quantity(value.mass, "kg"),
        "centre": length(*value.centre),
        "moments": listed(I.diagonal(), "kg m^2"),
        "products": listed((I[0, 1], I[0, 2], I[1, 2]), "kg m^2"),
    }


def link(value: Link) -> Table:
    """One link on its joint."""
    table: Table = {"name": ours(value, Link).name, "parent": value.parent, **joint(value.joint)}
    table["shapes"] = [shape(s) for s in value.shapes]
    if value.inertia is not None:
        table["inertia"] = inertia(value.inertia)
    return {k: v for k, v in table.items() if v not in (None, {}, [])}


def robot(value: Robot) -> Table:
    """A robot link by link."""
    return {
        "name": ours(value, Robot).name,
        "on": value.on,
        **pose(value.base),
        "home": coordinates(value.home, value.coordinate_units),
        "links": [link(k) for k in value.links],
    }


def thing(value: Object) -> Table:
    """An object; marks always in full."""
    return {
        "name": ours(value, Object).name,
        "on": value.on,
        **pose(value.pose),
        "shapes": [shape(s) for s in value.shapes],
        "marks": [length(*mark) for mark in value.marks],
    }


def camera(value: MountedCamera) -> Table:
    """A camera and where it is mounted."""
    lens = ours(ours(value, MountedCamera).camera, Camera)
    table: Table = {"name": value.name, "on": value.on, **pose(value.pose), "K": lens.K.tolist()}
    if lens.size:
        table["size"] = list(lens.size)
    if lens.distortion:
        table["distortion"] = list(lens.distortion)
    if lens.body:
        table["body"] = {k: v for k, v in shape(lens.body).items() if k != "kind"}
    return table


def motion(value: Motion, units: tuple[str, ...]) -> Table:
    """A robot that moves on its own; NoDescription if a function says how."""
    if callable(ours(value, Motion).rates):
        raise NoDescription(f"the motion of '{value.robot}' is Python code")
    return {"robot": value.robot, "rates": coordinates(value.rates, units)}


def scene(value: Scene) -> Table:
    """robots, objects, cameras, motions, display."""
    table: Table = {
        "robots": [robot(r) for r in ours(value, Scene).robots],
        "objects": [thing(o) for o in value.objects],
        "cameras": [camera(c) for c in value.cameras],
        "motions": [motion(m, value.robot(m.robot).velocity_units) for m in value.motions],
        "display": pose(value.display),
    }
    return {k: v for k, v in table.items() if v}
