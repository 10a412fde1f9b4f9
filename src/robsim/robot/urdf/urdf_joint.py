"""Conversion of <joint> elements to joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robsim.base.errors import format_value, suggest_names
from robsim.base.xml_elements import Element
from robsim.geometry.pose import IDENTITY, Pose
from robsim.robot.joint import Joint, Mimic
from robsim.robot.joints.joint_registry import find_joint_kind
from robsim.robot.urdf.attribute_values import (
    LARGEST_NUMBER,
    find_axis_rotation,
    read_attribute_number,
    read_attribute_vector,
    read_origin_pose,
)
from robsim.robot.urdf.diagnostics import Diagnostics
from robsim.robot.urdf.vocabulary import (
    TAIL_SUFFIX,
    find_child,
    make_safe_name,
    read_safe_name,
    require_attribute,
)

JOINT_TYPES: dict[str, str] = {
    "fixed": "fixed",
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "floating": "floating",
    "planar": "planar",
}
UNIT_AXIS = 1e-3  # largest deviation of the length of an axis from 1, for rounded numbers
SHORTEST_AXIS = 1e-6


@dataclass(frozen=True)
class UrdfJoint:
    """Joint of a file, with the names of its parent and child links in the file."""

    element: Element
    name: str
    parent: str
    child: str
    joint: Joint


def read_joint(
    element: Element, tails: Mapping[str, Element], findings: Diagnostics
) -> UrdfJoint | None:
    """Return the joint of a <joint> element, or None if its names are wrong.

    The mapping `tails` holds the fixed joints behind auxiliary links of our writer.
    """
    name, kind = read_safe_name(element, findings), _read_joint_type(element, findings)
    ends = [_read_connected_link(element, tag, findings) for tag in ("parent", "child")]
    place = read_origin_pose(element, findings)
    rotation = _read_axis_rotation(element, kind, findings)
    speed, effort = _read_drive_limits(element, kind, findings)
    damping, friction = _read_resistances(element, kind, findings)
    limits = _read_position_limits(element, kind, findings)
    follows = _read_mimic(element, kind, findings)
    if name is None or kind is None or ends[0] is None or ends[1] is None:
        return None
    below, tail = ends[1], IDENTITY
    if below in tails:
        tail = read_origin_pose(tails[below], findings)
        below = tails[below].attributes["name"].removesuffix(TAIL_SUFFIX)
    joint = Joint(
        JOINT_TYPES[kind],
        place @ rotation,
        rotation.inv() @ tail,
        limits,
        name=name if name != make_safe_name(below, "link") else None,
        speed=speed,
        effort=effort,
        damping=damping,
        friction=friction,
        follows=follows,
    )
    return UrdfJoint(element, name, ends[0], below, joint)


def _read_joint_type(element: Element, findings: Diagnostics) -> str | None:
    """Return the type of the joint, or None after an error."""
    kind = require_attribute(element, "type", findings)
    if kind is not None and kind not in JOINT_TYPES:
        findings.error(
            element,
            f"no joint type {format_value(kind)}; {suggest_names(kind[:40], JOINT_TYPES, 'types')}",
        )
        return None
    return kind


def _read_connected_link(element: Element, tag: str, findings: Diagnostics) -> str | None:
    """Return the link name of the parent or the child, or None after an error."""
    end = find_child(element, tag)
    if end is None:
        findings.error(element, f"<{tag}> is missing; it must be given")
        return None
    return require_attribute(end, "link", findings)


def _read_axis_rotation(element: Element, kind: str | None, findings: Diagnostics) -> Pose:
    """Return a rotation that takes z to the axis of the joint, which is x by default."""
    tag = find_child(element, "axis")
    axis = np.array([1.0, 0.0, 0.0])
    if tag is not None:
        xyz = read_attribute_vector(tag, "xyz", findings)
        axis = axis if xyz is None else xyz
    if kind in (None, "fixed", "floating"):
        return IDENTITY
    length = float(np.linalg.norm(axis))
    if tag is not None and length < SHORTEST_AXIS:
        findings.error(tag, f"the axis is zero; a {kind} joint needs one, as in xyz='0 0 1'")
        return IDENTITY
    if tag is not None and abs(length - 1) > UNIT_AXIS:
        findings.odd(tag, f"the axis has length {length:.6g}, and is read with length 1")
    T = np.eye(4)
    T[:3, :3] = find_axis_rotation(axis / length)
    return Pose(T)


def _read_drive_limits(
    element: Element, kind: str | None, findings: Diagnostics
) -> tuple[float | None, float | None]:
    """Return the largest speed and effort, each None if it is missing or 0."""
    limit = find_child(element, "limit")
    if limit is None or kind not in ("revolute", "continuous", "prismatic"):
        return None, None
    values = []
    for name in ("velocity", "effort"):
        if name not in limit.attributes:
            findings.odd(limit, f"{name} is missing, which the specification requires")
        value = read_attribute_number(limit, name, findings, 0.0, most=np.inf) or 0.0
        if value < 0:
            findings.error(limit, f"{name} is {value:g}; it must not be below 0")
        values.append(value if value > 0 else None)
    return values[0], values[1]


def _read_resistances(
    element: Element, kind: str | None, findings: Diagnostics
) -> tuple[float, float]:
    """Return the damping and the friction of a joint, each 0 if it is missing."""
    dynamics = find_child(element, "dynamics")
    if dynamics is None or kind not in ("revolute", "continuous", "prismatic"):
        return 0.0, 0.0
    values = []
    for name in ("damping", "friction"):
        value = read_attribute_number(dynamics, name, findings, 0.0) or 0.0
        if value < 0:
            findings.odd(dynamics, f"{name} is {value:g}, which would drive the joint; left out")
        values.append(max(value, 0.0))
    return values[0], values[1]


def _read_position_limits(
    element: Element, kind: str | None, findings: Diagnostics
) -> tuple[float, float] | None:
    """Return (lower, upper), or None for a joint without limits or after an error."""
    limit = find_child(element, "limit")
    if kind not in ("revolute", "prismatic"):
        return None
    if limit is None:
        can = "; or write type 'continuous'" if kind == "revolute" else ""
        findings.error(element, f"<limit> is missing; a {kind} joint needs lower and upper{can}")
        return None
    lower, upper = (
        read_attribute_number(limit, name, findings, 0.0, np.inf) for name in ("lower", "upper")
    )
    if (
        lower is None or upper is None or -lower == upper == LARGEST_NUMBER
    ):  # as our writer, no limits
        return None
    message = _describe_wrong_limits(lower, upper)
    if message is not None:
        findings.error(limit, message)
        return None
    if lower == upper or (lower <= -LARGEST_NUMBER and upper >= LARGEST_NUMBER):
        findings.odd(limit, f"lower {lower:g} and upper {upper:g} are read as without limits")
        return None
    for name, value in (("lower", lower), ("upper", upper)):
        if abs(value) > LARGEST_NUMBER:
            findings.odd(
                limit, f"{name} {value:g} is read as {np.copysign(LARGEST_NUMBER, value):g}"
            )
    return max(lower, -LARGEST_NUMBER), min(upper, LARGEST_NUMBER)


def _describe_wrong_limits(lower: float, upper: float) -> str | None:
    """Return an error message for wrong limits, or None."""
    if lower > upper:
        return f"lower {lower:g} is above upper {upper:g}; it must be below"
    if lower == upper != 0:
        return f"lower and upper are both {lower:g}; write type 'fixed', or let it move"
    if lower >= LARGEST_NUMBER or upper <= -LARGEST_NUMBER:
        return f"lower {lower:g} and upper {upper:g}: at most {LARGEST_NUMBER:g} is allowed"
    return None


def _read_mimic(element: Element, kind: str | None, findings: Diagnostics) -> Mimic | None:
    """Return the coupling of a <mimic> element, or None without one or after an error."""
    mimic = find_child(element, "mimic")
    if mimic is None:
        return None
    if kind == "fixed":
        findings.odd(mimic, "a fixed joint cannot follow another; left out")
        return None
    of = require_attribute(mimic, "joint", findings)
    ratio = read_attribute_number(mimic, "multiplier", findings, 1.0)
    offset = read_attribute_number(mimic, "offset", findings, 0.0)
    if kind is not None and not find_joint_kind(JOINT_TYPES[kind]).single:
        findings.error(mimic, f"a {kind} joint cannot follow another; it has no single coordinate")
        return None
    if of is None or ratio is None or offset is None:
        return None
    return Mimic(make_safe_name(of, "joint"), ratio, offset)
