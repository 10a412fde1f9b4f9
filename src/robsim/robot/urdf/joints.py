"""Conversion of <joint> to Joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from robsim.base.elements import Element
from robsim.base.errors import said, suggest
from robsim.geometry.pose import IDENTITY, Pose
from robsim.robot.joint import Joint, Mimic
from robsim.robot.joints.registry import kind_of
from robsim.robot.urdf.findings import Findings
from robsim.robot.urdf.values import LARGEST, frame_of, number, origin, vector
from robsim.robot.urdf.words import TAIL, child, named, needed, safe

KINDS: dict[str, str] = {
    "fixed": "fixed",
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "floating": "floating",
    "planar": "planar",
}
UNIT_AXIS = 1e-3  # how far the length of an axis may be from 1, as numbers are rounded
SHORTEST_AXIS = 1e-6


@dataclass(frozen=True)
class Hinge:
    """A joint and the names, as written in the file, of the links that it connects."""

    element: Element
    name: str
    parent: str
    child: str
    joint: Joint


def hinge(element: Element, tails: Mapping[str, Element], findings: Findings) -> Hinge | None:
    """Return the joint of a <joint> element, or None if its names are wrong.

    `tails` holds the fixed joints behind links that the writer added.
    """
    name, kind = named(element, findings), _kind(element, findings)
    ends = [_end(element, tag, findings) for tag in ("parent", "child")]
    place = origin(element, findings)
    turn = _turn(element, kind, findings)
    speed, effort = _drive(element, kind, findings)
    limits = _limits(element, kind, findings)
    follows = _mimic(element, kind, findings)
    if name is None or kind is None or ends[0] is None or ends[1] is None:
        return None
    below, tail = ends[1], IDENTITY
    if below in tails:
        tail = origin(tails[below], findings)
        below = tails[below].attributes["name"].removesuffix(TAIL)
    joint = Joint(
        KINDS[kind],
        place @ turn,
        turn.inv() @ tail,
        limits,
        name=name if name != safe(below, "link") else None,
        speed=speed,
        effort=effort,
        follows=follows,
    )
    return Hinge(element, name, ends[0], below, joint)


def _kind(element: Element, findings: Findings) -> str | None:
    kind = needed(element, "type", findings)
    if kind is not None and kind not in KINDS:
        findings.error(element, f"no joint type {said(kind)}; {suggest(kind[:40], KINDS, 'types')}")
        return None
    return kind


def _end(element: Element, tag: str, findings: Findings) -> str | None:
    """Return the link name of the parent or the child."""
    end = child(element, tag)
    if end is None:
        findings.error(element, f"<{tag}> is missing; it must be given")
        return None
    return needed(end, "link", findings)


def _turn(element: Element, kind: str | None, findings: Findings) -> Pose:
    """Return a rotation that takes z to the axis of the joint, which is x by default."""
    given = child(element, "axis")
    axis = np.array([1.0, 0.0, 0.0])
    if given is not None:
        read = vector(given, "xyz", findings)
        axis = axis if read is None else read
    if kind in (None, "fixed", "floating"):
        return IDENTITY
    length = float(np.linalg.norm(axis))
    if given is not None and length < SHORTEST_AXIS:
        findings.error(given, f"the axis is zero; a {kind} joint needs one, as in xyz='0 0 1'")
        return IDENTITY
    if given is not None and abs(length - 1) > UNIT_AXIS:
        findings.odd(given, f"the axis has length {length:.6g}, and is read with length 1")
    T = np.eye(4)
    T[:3, :3] = frame_of(axis / length)
    return Pose(T)


def _drive(
    element: Element, kind: str | None, findings: Findings
) -> tuple[float | None, float | None]:
    """Return the largest speed and effort; None where it is missing or 0."""
    limit = child(element, "limit")
    if limit is None or kind not in ("revolute", "continuous", "prismatic"):
        return None, None
    found = []
    for name in ("velocity", "effort"):
        if name not in limit.attributes:
            findings.odd(limit, f"{name} is missing, which the specification asks for")
        value = number(limit, name, findings, 0.0, most=np.inf) or 0.0
        if value < 0:
            findings.error(limit, f"{name} is {value:g}; it must not be below 0")
        found.append(value if value > 0 else None)
    return found[0], found[1]


def _limits(element: Element, kind: str | None, findings: Findings) -> tuple[float, float] | None:
    """Return (lower, upper), or None for a joint without limits or after an error."""
    limit = child(element, "limit")
    if kind not in ("revolute", "prismatic"):
        return None
    if limit is None:
        can = "; or write type 'continuous'" if kind == "revolute" else ""
        findings.error(element, f"<limit> is missing; a {kind} joint needs lower and upper{can}")
        return None
    lower, upper = (number(limit, name, findings, 0.0, np.inf) for name in ("lower", "upper"))
    if lower is None or upper is None or -lower == upper == LARGEST:  # our writer's for no limits
        return None
    wrong = _wrong_limits(lower, upper)
    if wrong is not None:
        findings.error(limit, wrong)
        return None
    if lower == upper or (lower <= -LARGEST and upper >= LARGEST):
        findings.odd(limit, f"lower {lower:g} and upper {upper:g} are read as without limits")
        return None
    for name, value in (("lower", lower), ("upper", upper)):
        if abs(value) > LARGEST:
            findings.odd(limit, f"{name} {value:g} is read as {np.copysign(LARGEST, value):g}")
    return max(lower, -LARGEST), min(upper, LARGEST)


def _wrong_limits(lower: float, upper: float) -> str | None:
    """Return what is wrong with limits; None: nothing."""
    if lower > upper:
        return f"lower {lower:g} is above upper {upper:g}; it must be below"
    if lower == upper != 0:
        return f"lower and upper are both {lower:g}; write type 'fixed', or let it move"
    if lower >= LARGEST or upper <= -LARGEST:
        return f"lower {lower:g} and upper {upper:g}: at most {LARGEST:g} is allowed"
    return None


def _mimic(element: Element, kind: str | None, findings: Findings) -> Mimic | None:
    mimic = child(element, "mimic")
    if mimic is None:
        return None
    if kind == "fixed":
        findings.odd(mimic, "a fixed joint follows nothing; left out")
        return None
    of = needed(mimic, "joint", findings)
    ratio = number(mimic, "multiplier", findings, 1.0)
    offset = number(mimic, "offset", findings, 0.0)
    if kind is not None and not kind_of(KINDS[kind]).single:
        findings.error(mimic, f"a {kind} joint cannot follow another; it has not one coordinate")
        return None
    if of is None or ratio is None or offset is None:
        return None
    return Mimic(safe(of, "joint"), ratio, offset)
