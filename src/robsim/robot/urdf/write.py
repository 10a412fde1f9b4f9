"""Conversion of a robot to a URDF file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain, count

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives import Ball, Block, Mesh, Primitive, Wheel
from robsim.geometry.rotation import rpy_of
from robsim.robot.joint import Joint, Mimic
from robsim.robot.link import Link
from robsim.robot.tip import Tip, find_tip
from robsim.robot.urdf.joints import KINDS
from robsim.robot.urdf.parts import TOKEN
from robsim.robot.urdf.solids import plain, rgba
from robsim.robot.urdf.text import Text, spaced
from robsim.robot.urdf.values import LARGEST, frame_of
from robsim.robot.urdf.words import AXIS, TAIL

SOLIDS = (Block, Wheel, Ball, Mesh)
ON_AXIS = 1e-14  # metres by which rounding may put a link beside the axis of its joint


def write(name: str, links: Sequence[Link], tip: str, path: str | os.PathLike[str]) -> None:
    """Write a URDF file of these links; InputError names what the format cannot express.

    The tip is written, in an element of ours, only where the links do not suggest it.
    """
    check(name, links, "URDF")
    text = Text()
    links = _unchained(links)
    _check_numbers(name, links)
    names, tied = _joint_names(links), _tied(links)
    with text.inside("robot", name=name):
        if find_tip(links) != Tip(tip):
            text.put("robsim", tip=tip)
        for link in links:
            _link(text, link)
        for link in links[1:]:
            _joint(text, link, names[link.name], tied)
    text.save(path)


def check(name: str, links: Iterable[Link], what: str, more: Iterable[str] = ()) -> None:
    """Raise InputError with all that neither URDF nor MJCF can express, and with `more`."""
    wrong = []
    for link in links:
        joint = link.joint
        if joint.model.name not in KINDS.values():
            wrong.append(f"'{link.name}' moves as a {joint.model.name}")
        elif joint.follows is not None and not isinstance(joint.follows, Mimic):
            kind = type(joint.follows).__name__
            wrong.append(f"'{link.name}' follows by {kind}, not Mimic")
        for color in (shape.color for shape in link.shapes):
            if not isinstance(color, str) or not color.isprintable():
                wrong.append(f"'{link.name}' has a colour that is no word: {said(color)}")
    wrong += more
    if wrong:
        raise InputError(f"robot '{name}' cannot be written as {what}: {'; '.join(wrong)}")


def _check_numbers(name: str, links: Iterable[Link]) -> None:
    """Raise InputError for numbers that our reader would not take."""
    for link in links:
        joint, inertia = link.joint, link.inertial
        given = [*joint.place.position, *joint.tail.position, *(joint.limits or ())]
        if isinstance(joint.follows, Mimic):
            given += [joint.follows.ratio, joint.follows.offset]
        if inertia is not None:
            given += [inertia.mass, *inertia.centre, *inertia.tensor.flat]
        largest = max(map(abs, given))
        if largest > LARGEST:
            raise InputError(
                f"robot '{name}' cannot be written as URDF: '{link.name}' has a number of "
                f"{largest:g}, and at most {LARGEST:g} can be read"
            )


def _link(text: Text, link: Link) -> None:
    moves, inertial = link.joint.moves, link.inertial
    if moves and inertial is None:
        inertial = TOKEN
    if moves and not _reaches(link.joint):
        with text.inside("link", name=link.name + AXIS):
            if inertial is TOKEN:
                _inertial(text, TOKEN)
        inertial = None if inertial is TOKEN else inertial
    with text.inside("link", name=link.name):
        if inertial is not None:
            _inertial(text, inertial)
        for tag in ("visual", "collision"):
            for shape in link.shapes:
                for solid in plain(shape, SOLIDS):
                    _shape(text, tag, solid)


def _inertial(text: Text, inertia: Inertia) -> None:
    I = inertia.tensor
    with text.inside("inertial"):
        text.put("origin", xyz=spaced(inertia.centre))
        text.put("mass", value=inertia.mass)
        pairs = {f"i{'xyz'[i]}{'xyz'[j]}": float(I[i, j]) for i in range(3) for j in range(i, 3)}
        text.put("inertia", **pairs)


def _shape(text: Text, tag: str, shape: Primitive) -> None:
    with text.inside(tag):
        _origin(text, shape.pose)
        with text.inside("geometry"):
            _solid(text, shape)
        if tag == "visual":
            with text.inside("material", name=shape.color):
                text.put("color", rgba=spaced(rgba(shape.color)))


def _solid(text: Text, shape: Primitive) -> None:
    match shape:
        case Block():
            text.put("box", size=spaced((shape.length, shape.width, shape.height)))
        case Wheel():
            text.put("cylinder", radius=shape.radius, length=shape.width)
        case Ball():
            text.put("sphere", radius=shape.radius)
        case Mesh():
            scale = None if shape.scale == (1.0, 1.0, 1.0) else spaced(shape.scale)
            text.put("mesh", filename=shape.filename, scale=scale)


def _origin(text: Text, pose: Pose) -> None:
    """Write an <origin>, or nothing for the identity."""
    xyz = spaced(pose.position) if pose.position.any() else None
    rpy = None if (pose.rotation == np.eye(3)).all() else spaced(rpy_of(pose.rotation))
    if xyz or rpy:
        text.put("origin", xyz=xyz, rpy=rpy)


def _unchained(links: Sequence[Link]) -> list[Link]:
    """Return links whose chains of mimics are resolved: each follows the last source.

    Pinocchio and yourdfpy know no others.
    """
    follows = {k.label: k.joint.follows for k in links}
    return [
        replace(k, joint=replace(k.joint, follows=k.joint.follows.root(follows)))
        if isinstance(k.joint.follows, Mimic)
        else k
        for k in links
    ]


def _tied(links: Iterable[Link]) -> set[str]:
    """Return the names of links whose coordinates follow others or are followed.

    Without limits they are written as revolute: Pinocchio has no continuous joints that mimic.
    """
    follows = {link.name: link.joint.follows for link in links}
    sources = {each.of for each in follows.values() if isinstance(each, Mimic)}
    return {k.name for k in links if follows[k.name] or k.label in sources}


def _joint_names(links: Sequence[Link]) -> dict[str, str]:
    """Return a unique joint name for each link; fixed joints give way to moving ones."""
    names = {k.name: k.label for k in links if k.joint.moves}
    taken = set(names.values())
    for link in links[1:]:
        if link.name not in names:
            other = (f"{link.name[:50]}_fixed{i or ''}" for i in count())
            names[link.name] = next(n for n in chain([link.label], other) if n not in taken)
            taken.add(names[link.name])
    return names


def _joint(text: Text, link: Link, name: str, tied: set[str]) -> None:
    """Write the joint of a link, or two with a link between if it is beside the axis."""
    joint = link.joint
    if joint.limits is None and (joint.kind == "prismatic" or link.name in tied):
        joint = replace(joint, limits=(-LARGEST, LARGEST))
    if not joint.moves:
        _hinge(text, name, link.parent, link.name, joint.place @ joint.tail, joint)
    elif _reaches(joint):
        axis = joint.tail.rotation.T[:, 2]
        _hinge(text, name, link.parent, link.name, joint.place @ joint.tail, joint, axis)
    else:
        axis = np.array([0.0, 0.0, 1.0])
        _hinge(text, name, link.parent, link.name + AXIS, joint.place, joint, axis)
        _hinge(text, link.name + TAIL, link.name + AXIS, link.name, joint.tail, Joint())


def _reaches(joint: Joint) -> bool:
    """Return whether the link's frame can be the frame of the joint, moved along its axis."""
    p, R = joint.tail.position, joint.tail.rotation
    match joint.kind:
        case "revolute":
            return bool(np.hypot(p[0], p[1]) <= ON_AXIS)
        case "planar":
            return not p.any() and bool(np.abs(frame_of(R.T[:, 2]) - R.T).max() <= ON_AXIS)
        case "floating":
            return joint.tail == IDENTITY
        case _:
            return True


def _hinge(
    text: Text,
    name: str,
    parent: str | None,
    child: str,
    origin: Pose,
    joint: Joint,
    axis: Array | None = None,
) -> None:
    free = joint.kind == "revolute" and joint.limits is None
    with text.inside("joint", name=name, type="continuous" if free else joint.model.name):
        _origin(text, origin)
        text.put("parent", link=parent)
        text.put("child", link=child)
        if axis is not None and joint.kind != "floating":
            text.put("axis", xyz=spaced(axis))
        _limit(text, joint)
        if isinstance(joint.follows, Mimic):
            follows = joint.follows
            text.put("mimic", joint=follows.of, multiplier=follows.ratio, offset=follows.offset)


def _limit(text: Text, joint: Joint) -> None:
    """Write a <limit>, with 0 for unknown speed and effort."""
    lower, upper = joint.limits or (None, None)
    if lower is not None or (joint.kind == "revolute" and (joint.speed or joint.effort)):
        drive = {"effort": joint.effort or 0.0, "velocity": joint.speed or 0.0}
        text.put("limit", lower=lower, upper=upper, **drive)
