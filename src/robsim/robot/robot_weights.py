"""Inertias of a robot for its dynamics, with checks that name links, joints and files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.inertia import Inertia
from robsim.kernels.dynamics.body_rows import FLOATING
from robsim.robot.joint import Joint
from robsim.robot.link import Link
from robsim.robot.rigid_bodies import RigidBodies
from robsim.robot.robot_origin import RobotOrigin
from robsim.robot.tree import Tree

SMALLEST_INERTIA = 1e-12  # kg m^2 or kg; the joints of watches have more


def describe_source(name: str, origin: RobotOrigin | None) -> str:
    """Return the name of a robot in messages, with the file that it was read from."""
    return f"robot '{name}'{describe_origin(origin)}"


def describe_origin(origin: RobotOrigin | None) -> str:
    """Return the file or the library model of a robot in brackets, or an empty text."""
    source = None if origin is None else origin.urdf or origin.model
    return f" (from {source})" if source else ""


def list_link_inertias(robot: str, links: Sequence[Link]) -> list[tuple[str, Inertia]]:
    """Return links with their inertias; InputError, naming `robot`, if there are none."""
    inertias = [(link.name, link.inertial) for link in links]
    known = [(name, inertia) for name, inertia in inertias if inertia is not None]
    if not known:
        raise InputError(
            f"{robot} has no inertias, which dynamics needs: give links an inertia, or shapes a "
            "mass or a density"
        )
    return known


def collect_bodies(robot: str, links: Sequence[Link], tree: Tree) -> RigidBodies:
    """Return the rigid bodies of a robot; InputError, naming `robot`, if it has no dynamics."""
    known = list_link_inertias(robot, links)
    try:
        return RigidBodies.of(tree, known)
    except InputError as error:
        raise InputError(f"{robot}: {error}") from None


def sum_joint_numbers(
    joints: Iterable[tuple[str, Joint]], tree: Tree, bodies: RigidBodies, part: str
) -> Array:
    """Return armature, damping or friction (n,) or (n, runs) at each velocity.

    `joints` are frames with the joints that move them. A mimicking joint adds its armature and
    damping by the square of its ratio, and its friction by the magnitude of its ratio.
    """
    index = {body.tree_body: body for body in bodies.bodies}
    power = 1 if part == "friction" else 2
    total: list[Any] = [0.0] * bodies.n
    for frame, joint in joints:
        body = index.get(tree.find(frame)[0]) if joint.moves else None
        if body is not None:
            total[body.velocity] += abs(body.ratio) ** power * getattr(joint, part)
    return np.stack(np.broadcast_arrays(*total)) if total else np.zeros(0)


def find_singular_joint(bodies: RigidBodies, matrix: Array) -> int | None:
    """Return the body in the tree whose joint moves no inertia, or None if M is positive definite.

    The mass matrix M is factored as L' D L (Featherstone 2008, section 6.5), from the tips to the
    base, so that a number in D is the inertia that a joint moves while the joints behind it are
    free.
    """
    rest = matrix.copy()
    for body in reversed([each for each in bodies.bodies if not each.mimics]):
        for k in range(body.velocity, body.velocity + (6 if body.kind == FLOATING else 1)):
            if not rest[k, k] > SMALLEST_INERTIA:
                return body.tree_body
            rest -= np.outer(rest[k], rest[k]) / rest[k, k]
    return None


def describe_singular_joint(robot: str, links: Sequence[Link], tree: Tree, body: int) -> str:
    """Return the message about a joint that moves no inertia."""
    carried = [link for link in links if tree.find(link.name)[0] == body]
    names = ", ".join(f"'{link.name}'" for link in carried)
    joint = next(link for link in carried if link.joint.moves)
    return (
        f"{robot}: the mass matrix is not positive, as joint '{joint.label}' moves no inertia: "
        f"give an inertia to one of its links ({names}), or an armature to the joint"
    )
