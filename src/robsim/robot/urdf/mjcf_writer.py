"""Conversion of a robot to a MuJoCo model file (MJCF)."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileWarning
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Ball, Block, Capsule, Mesh, Primitive, Wheel
from robsim.robot.joint import Joint, Mimic
from robsim.robot.link import Link
from robsim.robot.tree import Tree
from robsim.robot.urdf.shape_export import color_to_rgba, split_into_solids
from robsim.robot.urdf.urdf_link import TOKEN_INERTIA
from robsim.robot.urdf.urdf_writer import check_exportable
from robsim.robot.urdf.xml_writer import XmlWriter, join_numbers

MJCF_SOLIDS = (Block, Wheel, Ball, Capsule)
LEAST_MASS = 1e-9  # kg, the mass of a body of which only a moment is known
LEAST_MOMENT = 1e-12  # kg m^2, the smallest moment of a body
_FULL_INERTIA = (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)  # the order of MuJoCo's fullinertia


def write_mjcf(name: str, links: Sequence[Link], tree: Tree, path: str | os.PathLike[str]) -> None:
    """Write a MuJoCo model of these links; raise InputError with all that MJCF cannot express."""
    tops = dict(_find_world_bodies(links, tree))
    floating = [name for name, pose in tops.items() if pose is None]
    unsupported = [f"'{name}' floats on a moving link" for name in floating]
    check_exportable(name, links, "MJCF", unsupported)
    text = XmlWriter()
    with text.open_element("mujoco", model=name):
        text.put("compiler", angle="radian", autolimits="true", inertiafromgeom="false")
        with text.open_element("worldbody"):
            for link in links:
                pose = tops.get(link.name)
                if pose is not None:
                    _write_body_tree(text, link, pose, links)
        _write_equalities(text, links)
    text.save(path)
    changes = {
        "meshes of {} are left out, because MuJoCo would open their files": [
            k.name for k in links if any(isinstance(shape, Mesh) for shape in k.shapes)
        ],
        "inertias of {} are changed, because MuJoCo requires masses and moments of a rigid body": [
            k.name for k in links if k.inertial and (k.inertial.defect or not k.inertial.mass)
        ],
    }
    for change, names in changes.items():
        if names:
            message = f"{path}: {change.format(', '.join(names[:9]))}"
            warnings.warn(message, FileWarning, stacklevel=3)  # points at the call of Robot.to_mjcf


def _find_world_bodies(links: Sequence[Link], tree: Tree) -> Iterator[tuple[str, Pose | None]]:
    """Yield the links that are bodies of the world, the base and floating links, with their poses.

    The pose is None for a floating link on a moving link: MuJoCo permits free joints only in the
    world.
    """
    start = links[0].joint.place @ links[0].joint.tail
    yield links[0].name, start
    for link in links:
        if link.joint.kind == "floating":
            body, offset = tree.find(str(link.parent))
            pose = start @ Pose(offset) @ link.joint.place @ link.joint.tail
            yield link.name, None if body else pose


def _write_body_tree(text: XmlWriter, top: Link, pose: Pose, links: Sequence[Link]) -> None:
    """Write a body with its descendants, each inside its parent, except floating links."""
    children: dict[str | None, list[Link]] = {}
    for link in links:
        if link.joint.kind != "floating":
            children.setdefault(link.parent, []).append(link)
    stack: list[tuple[Link, Pose] | None] = [(top, pose)]
    while stack:
        item = stack.pop()
        if item is None:
            text.end()
            continue
        link, where = item
        text.start("body", name=link.name, **_make_pose_attributes(where))
        _write_body_parts(text, link)
        stack.append(None)
        inner = reversed(children.get(link.name, []))
        stack += [(k, k.joint.place @ k.joint.tail) for k in inner]


def _write_body_parts(text: XmlWriter, link: Link) -> None:
    """Write the inertia, the joints and the geoms of one body."""
    inertial = link.inertial
    if inertial is None and link.joint.moves:
        inertial = TOKEN_INERTIA
    if inertial is not None:
        _write_mjcf_inertial(text, inertial)
    _write_mjcf_joints(text, link.joint, link.label)
    for shape in link.shapes:
        for solid in split_into_solids(shape, MJCF_SOLIDS):
            geom, sizes = _find_geom_type(solid)
            color, place = (
                join_numbers(color_to_rgba(solid.color)),
                _make_pose_attributes(solid.pose),
            )
            text.put("geom", type=geom, size=join_numbers(sizes), rgba=color, **place)


def _find_geom_type(solid: Primitive) -> tuple[str, tuple[float, ...]]:
    """Return the type of a geom and its sizes, which are half lengths."""
    match solid:
        case Block():
            return "box", (solid.length / 2, solid.width / 2, solid.height / 2)
        case Wheel():
            return "cylinder", (solid.radius, solid.width / 2)
        case Capsule():
            return "capsule", (solid.radius, solid.length / 2)
        case Ball():
            return "sphere", (solid.radius,)
    raise TypeError(solid)  # a type that MJCF lacks


def _write_mjcf_joints(text: XmlWriter, joint: Joint, name: str) -> None:
    """Write one joint, or three for a planar joint; axes and points are in axes of the body."""
    R, point = joint.tail.rotation, join_numbers(joint.tail.inv().position)
    span = None if joint.limits is None else join_numbers(joint.limits)
    force = None if joint.effort is None else join_numbers((-joint.effort, joint.effort))
    x, y, z = (join_numbers(axis) for axis in R)
    numbers = {"armature": joint.armature, "damping": joint.damping, "frictionloss": joint.friction}
    drive = {"actuatorfrcrange": force, **{key: x or None for key, x in numbers.items()}}
    match joint.kind:
        case "revolute":
            text.put("joint", name=name, type="hinge", pos=point, axis=z, range=span, **drive)
        case "prismatic":
            text.put("joint", name=name, type="slide", axis=z, range=span, **drive)
        case "planar":
            text.put("joint", name=f"{name}.x", type="slide", axis=x)
            text.put("joint", name=f"{name}.y", type="slide", axis=y)
            text.put("joint", name=f"{name}.theta", type="hinge", pos=point, axis=z)
        case "floating":
            text.put("freejoint", name=name)


def _write_equalities(text: XmlWriter, links: Sequence[Link]) -> None:
    """Write the constraints of joints that mimic a coordinate q: offset + ratio q."""
    mimics = [link for link in links if isinstance(link.joint.follows, Mimic)]
    if not mimics:
        return
    with text.open_element("equality"):
        for link in mimics:
            follows = link.joint.follows
            assert isinstance(follows, Mimic)
            name, polynomial = link.label, (follows.offset, follows.ratio, 0, 0, 0)
            text.put("joint", joint1=name, joint2=follows.of, polycoef=join_numbers(polynomial))


def _write_mjcf_inertial(text: XmlWriter, inertia: Inertia) -> None:
    """Write an inertia with the mass and the moments that MuJoCo requires."""
    tensor = _raise_moments(inertia.tensor)
    full, mass = join_numbers(tensor[i, j] for i, j in _FULL_INERTIA), inertia.mass or LEAST_MASS
    text.put("inertial", pos=join_numbers(inertia.centre), mass=mass, fullinertia=full)


def _raise_moments(tensor: Array) -> Array:
    """Return a tensor with positive moments of which none exceeds the sum of the other two.

    The smaller moments are raised; the largest is kept, which often belongs to the axis of the
    joint.
    """
    moments, axes = np.linalg.eigh(tensor)
    raised = np.maximum(moments, LEAST_MOMENT)
    raised[:2] += max(raised[2] - raised[0] - raised[1], 0.0) / 2
    change = raised - moments
    result: Array = tensor + axes * change @ axes.T if change.any() else tensor
    return result


def _make_pose_attributes(pose: Pose) -> dict[str, str | None]:
    """Return the attributes pos and quat (w x y z), each None for the identity."""
    x, y, z, w = pose.quaternion
    is_rotated = not (pose.rotation == np.eye(3)).all()
    return {
        "pos": join_numbers(pose.position) if pose.position.any() else None,
        "quat": join_numbers((w, x, y, z)) if is_rotated else None,
    }
