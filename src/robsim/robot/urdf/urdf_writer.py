"""Conversion of a robot to a URDF file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain, count

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives import Ball, Block, Mesh, Primitive, Wheel
from robsim.geometry.rotation import rotation_to_rpy
from robsim.robot.joint import Joint, Mimic
from robsim.robot.link import Link
from robsim.robot.tip import Tip, find_tip
from robsim.robot.urdf.attribute_values import LARGEST_NUMBER, find_axis_rotation
from robsim.robot.urdf.shape_export import color_to_rgba, split_into_solids
from robsim.robot.urdf.urdf_joint import JOINT_TYPES
from robsim.robot.urdf.urdf_link import TOKEN_INERTIA
from robsim.robot.urdf.vocabulary import AXIS_SUFFIX, TAIL_SUFFIX
from robsim.robot.urdf.xml_writer import XmlWriter, join_numbers

URDF_SOLIDS = (Block, Wheel, Ball, Mesh)
ON_AXIS = 1e-14  # metres: largest distance of a link from the axis of its joint, due to rounding


def write_urdf(name: str, links: Sequence[Link], tip: str, path: str | os.PathLike[str]) -> None:
    """Write a URDF file of these links; raise InputError with all that URDF cannot express.

    The tip is written, in an element of RobSim, only if the reader would choose another tip.
    """
    check_exportable(name, links, "URDF")
    text = XmlWriter()
    links = _resolve_mimic_chains(links)
    _check_number_sizes(name, links)
    names, tied = _assign_joint_names(links), _find_coupled_links(links)
    with text.open_element("robot", name=name):
        if find_tip(links) != Tip(tip):
            text.put("robsim", tip=tip)
        for link in links:
            _write_link(text, link)
        for link in links[1:]:
            _write_joint(text, link, names[link.name], tied)
    text.save(path)


def check_exportable(name: str, links: Iterable[Link], what: str, more: Iterable[str] = ()) -> None:
    """Raise InputError for joints and colours that `what` cannot express; `more` lists reasons."""
    reasons = []
    for link in links:
        joint = link.joint
        if joint.model.name not in JOINT_TYPES.values():
            reasons.append(f"'{link.name}' moves as a {joint.model.name}")
        elif joint.follows is not None and not isinstance(joint.follows, Mimic):
            kind = type(joint.follows).__name__
            reasons.append(f"'{link.name}' follows by {kind}, not Mimic")
        for color in (shape.color for shape in link.shapes):
            if not isinstance(color, str) or not color.isprintable():
                reasons.append(f"'{link.name}' has a colour that is no word: {format_value(color)}")
    reasons += more
    if reasons:
        raise InputError(f"robot '{name}' cannot be written as {what}: {'; '.join(reasons)}")


def _check_number_sizes(name: str, links: Iterable[Link]) -> None:
    """Raise InputError for numbers that `read_urdf` would reject."""
    for link in links:
        joint, inertia = link.joint, link.inertial
        values = [*joint.place.position, *joint.tail.position, *(joint.limits or ())]
        values += [joint.damping, joint.friction]
        if isinstance(joint.follows, Mimic):
            values += [joint.follows.ratio, joint.follows.offset]
        if inertia is not None:
            values += [inertia.mass, *inertia.centre, *inertia.tensor.flat]
        largest = max(map(abs, values))
        if largest > LARGEST_NUMBER:
            raise InputError(
                f"robot '{name}' cannot be written as URDF: '{link.name}' has a number of "
                f"{largest:g}, and at most {LARGEST_NUMBER:g} can be read"
            )


def _write_link(text: XmlWriter, link: Link) -> None:
    """Write a link with its inertia and shapes, and an auxiliary link if it is beside its axis."""
    moves, inertial = link.joint.moves, link.inertial
    if moves and inertial is None:
        inertial = TOKEN_INERTIA
    if moves and not _is_on_axis(link.joint):
        with text.open_element("link", name=link.name + AXIS_SUFFIX):
            if inertial is TOKEN_INERTIA:
                _write_inertial(text, TOKEN_INERTIA)
        inertial = None if inertial is TOKEN_INERTIA else inertial
    with text.open_element("link", name=link.name):
        if inertial is not None:
            _write_inertial(text, inertial)
        for tag in ("visual", "collision"):
            for shape in link.shapes:
                for solid in split_into_solids(shape, URDF_SOLIDS):
                    _write_shape(text, tag, solid)


def _write_inertial(text: XmlWriter, inertia: Inertia) -> None:
    """Write an <inertial>."""
    I = inertia.tensor
    with text.open_element("inertial"):
        text.put("origin", xyz=join_numbers(inertia.centre))
        text.put("mass", value=inertia.mass)
        pairs = {f"i{'xyz'[i]}{'xyz'[j]}": float(I[i, j]) for i in range(3) for j in range(i, 3)}
        text.put("inertia", **pairs)


def _write_shape(text: XmlWriter, tag: str, shape: Primitive) -> None:
    """Write a <visual> or <collision>."""
    with text.open_element(tag):
        _write_origin(text, shape.pose)
        with text.open_element("geometry"):
            _write_solid(text, shape)
        if tag == "visual":
            with text.open_element("material", name=shape.color):
                text.put("color", rgba=join_numbers(color_to_rgba(shape.color)))


def _write_solid(text: XmlWriter, shape: Primitive) -> None:
    """Write the element of a solid."""
    match shape:
        case Block():
            text.put("box", size=join_numbers((shape.length, shape.width, shape.height)))
        case Wheel():
            text.put("cylinder", radius=shape.radius, length=shape.width)
        case Ball():
            text.put("sphere", radius=shape.radius)
        case Mesh():
            scale = None if shape.scale == (1.0, 1.0, 1.0) else join_numbers(shape.scale)
            text.put("mesh", filename=shape.filename, scale=scale)


def _write_origin(text: XmlWriter, pose: Pose) -> None:
    """Write an <origin>, or nothing for the identity."""
    xyz = join_numbers(pose.position) if pose.position.any() else None
    rpy = (
        None if (pose.rotation == np.eye(3)).all() else join_numbers(rotation_to_rpy(pose.rotation))
    )
    if xyz or rpy:
        text.put("origin", xyz=xyz, rpy=rpy)


def _resolve_mimic_chains(links: Sequence[Link]) -> list[Link]:
    """Return links with resolved chains of mimics: each follows the last source.

    Pinocchio and yourdfpy do not support chains.
    """
    follows = {k.label: k.joint.follows for k in links}
    return [
        replace(k, joint=replace(k.joint, follows=k.joint.follows.root(follows)))
        if isinstance(k.joint.follows, Mimic)
        else k
        for k in links
    ]


def _find_coupled_links(links: Iterable[Link]) -> set[str]:
    """Return the names of links with coordinates that follow others or are followed.

    Without limits they are written as revolute: Pinocchio supports no continuous joints that mimic.
    """
    follows = {link.name: link.joint.follows for link in links}
    sources = {each.of for each in follows.values() if isinstance(each, Mimic)}
    return {k.name for k in links if follows[k.name] or k.label in sources}


def _assign_joint_names(links: Sequence[Link]) -> dict[str, str]:
    """Return a unique joint name for each link; moving joints take precedence over fixed joints."""
    names = {k.name: k.label for k in links if k.joint.moves}
    taken = set(names.values())
    for link in links[1:]:
        if link.name not in names:
            other = (f"{link.name[:50]}_fixed{i or ''}" for i in count())
            names[link.name] = next(n for n in chain([link.label], other) if n not in taken)
            taken.add(names[link.name])
    return names


def _write_joint(text: XmlWriter, link: Link, name: str, tied: set[str]) -> None:
    """Write the joint of a link, or two with a link between if the link is beside the axis."""
    joint = link.joint
    if joint.limits is None and (joint.kind == "prismatic" or link.name in tied):
        joint = replace(joint, limits=(-LARGEST_NUMBER, LARGEST_NUMBER))
    if not joint.moves:
        _write_joint_element(text, name, link.parent, link.name, joint.place @ joint.tail, joint)
    elif _is_on_axis(joint):
        axis = joint.tail.rotation.T[:, 2]
        _write_joint_element(
            text, name, link.parent, link.name, joint.place @ joint.tail, joint, axis
        )
    else:
        axis = np.array([0.0, 0.0, 1.0])
        _write_joint_element(
            text, name, link.parent, link.name + AXIS_SUFFIX, joint.place, joint, axis
        )
        _write_joint_element(
            text, link.name + TAIL_SUFFIX, link.name + AXIS_SUFFIX, link.name, joint.tail, Joint()
        )


def _is_on_axis(joint: Joint) -> bool:
    """Return whether the frame of the link can be the frame of the joint, moved along its axis."""
    p, R = joint.tail.position, joint.tail.rotation
    match joint.kind:
        case "revolute":
            return bool(np.hypot(p[0], p[1]) <= ON_AXIS)
        case "planar":
            return not p.any() and bool(
                np.abs(find_axis_rotation(R.T[:, 2]) - R.T).max() <= ON_AXIS
            )
        case "floating":
            return joint.tail == IDENTITY
        case _:
            return True


def _write_joint_element(
    text: XmlWriter,
    name: str,
    parent: str | None,
    child: str,
    origin: Pose,
    joint: Joint,
    axis: Array | None = None,
) -> None:
    """Write a <joint>."""
    is_continuous = joint.kind == "revolute" and joint.limits is None
    with text.open_element(
        "joint", name=name, type="continuous" if is_continuous else joint.model.name
    ):
        _write_origin(text, origin)
        text.put("parent", link=parent)
        text.put("child", link=child)
        if axis is not None and joint.kind != "floating":
            text.put("axis", xyz=join_numbers(axis))
        _write_limit(text, joint)
        if joint.damping or joint.friction:
            text.put("dynamics", damping=joint.damping, friction=joint.friction)
        if isinstance(joint.follows, Mimic):
            follows = joint.follows
            text.put("mimic", joint=follows.of, multiplier=follows.ratio, offset=follows.offset)


def _write_limit(text: XmlWriter, joint: Joint) -> None:
    """Write a <limit>, with 0 for unknown speed and effort."""
    lower, upper = joint.limits or (None, None)
    if lower is not None or (joint.kind == "revolute" and (joint.speed or joint.effort)):
        drive = {"effort": joint.effort or 0.0, "velocity": joint.speed or 0.0}
        text.put("limit", lower=lower, upper=upper, **drive)
