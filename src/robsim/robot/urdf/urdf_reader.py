"""Conversion of a URDF file to a robot: its links, its joints and its tree."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import TypeVar

from robsim.base.errors import FileError, InputError, format_value
from robsim.base.file_content import read_bytes
from robsim.base.xml_elements import LARGEST_FILE, Element, parse_xml
from robsim.robot.joint import Joint, Mimic
from robsim.robot.link import Link
from robsim.robot.tip import Tip, find_tip
from robsim.robot.urdf.attribute_values import LARGEST_NUMBER
from robsim.robot.urdf.diagnostics import Diagnostics
from robsim.robot.urdf.urdf_joint import UrdfJoint, read_joint
from robsim.robot.urdf.urdf_link import (
    TOKEN_INERTIA,
    read_inertia,
    read_material_colors,
    read_shapes,
)
from robsim.robot.urdf.vocabulary import (
    AXIS_SUFFIX,
    TAIL_SUFFIX,
    check_words,
    find_child,
    find_children,
    read_safe_name,
    require_attribute,
    suggest_name,
)

R = TypeVar("R")
BuildRobot = Callable[[str, tuple[Link, ...], str], R]  # function of a name, links and a tip
LinksByName = dict[str, tuple[Element, Link]]  # links by their names in the file
MOST_LINKS = 2048
MOST_MIMICS = 256


def read_urdf(path: str | os.PathLike[str], build: BuildRobot[R]) -> tuple[R, Tip]:
    """Return the result of `build` for a file, and the choice of the tip of the robot.

    Raises
    ------
    FileError
        If the file has errors. The message lists one error on each line.

    Warns
    -----
    FileWarning
        If the file has oddities.
    """
    data = read_bytes(path, "a URDF file", LARGEST_FILE)
    root = parse_xml(data, str(path), "a URDF file, <robot name=...> ... </robot>")
    findings = Diagnostics(str(path))
    if root.tag != "robot":
        raise FileError(f"{path}:{root.line}: <{root.tag:.40}>: expected <robot name=...>")
    check_words(root, findings)
    name, links = _read_link_tree(root, findings)
    tip = _read_tip(root, links, findings)
    try:
        robot = build(name, tuple(links), tip.name)
    except InputError as error:
        raise FileError(f"{path}: {error}") from None
    findings.warn()
    return robot, tip


def _read_tip(root: Element, links: Sequence[Link], findings: Diagnostics) -> Tip:
    """Return the tip that our writer put into the file, or the tip that the links suggest."""
    element = find_child(root, "robsim")
    name = None if element is None else require_attribute(element, "tip", findings)
    names = [link.name for link in links]
    if element is not None and name is not None and name not in names:
        findings.error(element, f"tip: no link {format_value(name)}; {suggest_name(name, names)}")
    findings.stop()
    return find_tip(links) if name is None else Tip(name)


def _read_link_tree(root: Element, findings: Diagnostics) -> tuple[str, list[Link]]:
    """Return the name of the robot, and its links on their joints."""
    tails = _find_tail_joints(root)
    elements = [k for k in find_children(root, "link") if k.attributes.get("name") not in tails]
    tail_joints = set(tails.values())
    joints = [j for j in find_children(root, "joint") if j not in tail_joints]
    if not 0 < len(elements) <= MOST_LINKS:
        findings.error(root, f"{len(elements)} links; from 1 to {MOST_LINKS} are allowed")
    name = read_safe_name(root, findings)
    links = _read_links(elements, read_material_colors(root, findings), findings)
    urdf_joints = [h for each in joints if (h := read_joint(each, tails, findings)) is not None]
    if not links or len(links) + len(urdf_joints) < len(elements) + len(joints):
        findings.stop()  # the tree cannot be checked
    tree = _connect_links(root, links, urdf_joints, findings)
    findings.stop()
    assert name is not None
    return name, tree


def _find_tail_joints(root: Element) -> dict[str, Element]:
    """Return the <joint> "elbow.tail" behind each auxiliary <link> "elbow.axis".

    An auxiliary link must be exactly as our writer makes it: on a joint, without shapes, and with
    "elbow" as its only child.
    """
    above, behind = _index_joints_by_link(root, "child"), _index_joints_by_link(root, "parent")
    tails = {}
    for link in find_children(root, "link"):
        name = link.attributes.get("name", "")
        stem, joints = name.removesuffix(AXIS_SUFFIX), behind.get(name, [])
        if stem == name or name not in above or len(joints) != 1 or not _is_bare_link(link):
            continue
        end = find_child(joints[0], "child")
        is_ours = joints[0].attributes == {"name": stem + TAIL_SUFFIX, "type": "fixed"}
        if is_ours and end is not None and end.attributes.get("link") == stem:
            tails[name] = joints[0]
    return tails


def _is_bare_link(link: Element) -> bool:
    """Return whether a link is empty, apart from the inertia that our writer adds."""
    findings = Diagnostics("")
    inertia = read_inertia(link, findings)
    is_ours = not (findings.errors or findings.oddities) and inertia in (None, TOKEN_INERTIA)
    return is_ours and all(part.tag == "inertial" for part in link.children)


def _index_joints_by_link(root: Element, tag: str) -> dict[str, list[Element]]:
    """Return the joints by the name of their <parent> or <child> link."""
    joints_of: dict[str, list[Element]] = {}
    for joint in find_children(root, "joint"):
        end = find_child(joint, tag)
        if end is not None:
            joints_of.setdefault(end.attributes.get("link", ""), []).append(joint)
    return joints_of


def _read_links(
    elements: Iterable[Element], palette: Mapping[str, str], findings: Diagnostics
) -> LinksByName:
    """Return the links without joints, by their names in the file."""
    links: LinksByName = {}
    for element in elements:
        name = read_safe_name(element, findings)
        inertia, solids = read_inertia(element, findings), read_shapes(element, palette, findings)
        if name is None:
            continue
        original = element.attributes["name"]
        if original in links:
            line = links[original][0].line
            findings.error(element, f"line {line} has a link of the same name; one is allowed")
        links[original] = element, Link(name, shapes=solids, inertia=inertia)
    return links


def _connect_links(
    root: Element, links: LinksByName, urdf_joints: list[UrdfJoint], findings: Diagnostics
) -> list[Link]:
    """Return the links on their joints: the root, then the children in the order of joints."""
    _check_repeated_names(links, urdf_joints, findings)
    _check_mimic_joints(urdf_joints, findings)
    if not _check_joint_ends(links, urdf_joints, findings):
        findings.stop()
    above = {h.child: h for h in urdf_joints}
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        names = ", ".join(repr(name) for name in roots[:9])
        findings.error(root, f"{len(roots)} links have no parent: {names}; one is allowed")
    _check_link_loops(links, above, findings)
    findings.stop()
    base = links[roots[0]][1]
    pairs = zip(urdf_joints, _drop_impossible_limits(urdf_joints, findings), strict=True)
    return [
        base,
        *(_attach_link(joint, links[h.child][1], links[h.parent][1]) for h, joint in pairs),
    ]


def _attach_link(joint: Joint, link: Link, parent: Link) -> Link:
    """Return a link on its joint, without the inertia that our writer gives to moving links."""
    token = joint.moves and link.inertia == TOKEN_INERTIA
    inertia = None if token else link.inertia
    return replace(link, parent=parent.name, joint=joint, inertia=inertia)


def _drop_impossible_limits(
    urdf_joints: Iterable[UrdfJoint], findings: Diagnostics
) -> Iterator[Joint]:
    """Yield the joints, without limits of a mimicking joint that its source can never satisfy.

    Some published files have such limits. Other programs ignore the limits of mimicking joints.
    """
    joints = {h.name: h.joint for h in urdf_joints}
    follows = {name: joint.follows for name, joint in joints.items()}
    room: dict[str, tuple[float, float]] = {}
    for h in urdf_joints:
        joint, tie = h.joint, h.joint.follows
        if joint.limits is None or not isinstance(tie, Mimic):
            yield joint
            continue
        root = tie.root(follows)
        name, (low, high) = root.of, root.source_limits(joint.limits)
        lowest, highest = room.get(name, joints[name].limits or (-inf, inf))
        if max(low, lowest) < min(high, highest):
            room[name] = max(low, lowest), min(high, highest)
            yield joint
        else:
            findings.odd(h.element, f"its limits leave joint '{name}' no room; they are left out")
            yield replace(joint, limits=None)


def _check_repeated_names(
    links: LinksByName, urdf_joints: Iterable[UrdfJoint], findings: Diagnostics
) -> None:
    """Report names of links and of joints that occur twice, also after their conversion."""
    taken: dict[str, Element] = {}
    for element, link in links.values():
        if link.name in taken:
            line = taken[link.name].line
            findings.error(element, f"line {line} has the same converted name '{link.name}'")
        taken[link.name] = element
    joints: dict[str, Element] = {}
    for h in urdf_joints:
        if h.name in joints:
            line = joints[h.name].line
            findings.error(h.element, f"line {line} has a joint of the same name; give another")
        joints[h.name] = h.element


def _check_joint_ends(
    links: LinksByName, urdf_joints: Iterable[UrdfJoint], findings: Diagnostics
) -> bool:
    """Return whether every joint connects two existing links; report other joints."""
    carried: dict[str, UrdfJoint] = {}
    before = len(findings.errors)
    for h in urdf_joints:
        for what, name in (("parent", h.parent), ("child", h.child)):
            if name not in links:
                findings.error(
                    h.element, f"{what}: no link {format_value(name)}; {suggest_name(name, links)}"
                )
        if h.parent == h.child:
            findings.error(
                h.element, f"parent and child are both {format_value(h.child)}; join two links"
            )
        elif h.child in carried:
            other = carried[h.child].element
            text = (
                f"{format_value(h.child)} is also the child of {other.label} in line {other.line}"
            )
            findings.error(h.element, f"{text}; a link has one parent")
        carried[h.child] = h
    return len(findings.errors) == before


def _check_link_loops(
    links: Iterable[str], above: dict[str, UrdfJoint], findings: Diagnostics
) -> None:
    """Report links that are their own ancestors."""
    for name in _find_loops({name: above[name].parent for name in links if name in above}):
        text = f"a loop: {format_value(name)} is its own ancestor"
        findings.error(above[name].element, text)


def _find_loops(above: Mapping[str, str]) -> Iterator[str]:
    """Yield one name of each loop; `above` maps a name to its parent or source."""
    done: set[str] = set()
    for start in above:
        path, name = set[str](), start
        while name in above and name not in done and name not in path:
            path.add(name)
            name = above[name]
        if name in path:
            yield name
        done |= path


def _check_mimic_joints(urdf_joints: Iterable[UrdfJoint], findings: Diagnostics) -> None:
    """Report mimics of joints that are missing, unsuitable, or the mimic itself."""
    joints = {h.name: h for h in urdf_joints}
    sources = {name: h.joint.follows.of for name, h in joints.items() if h.joint.follows}
    if len(sources) > MOST_MIMICS:
        findings.error(next(iter(joints.values())).element, f"more than {MOST_MIMICS} <mimic>")
        return
    for name, of in sources.items():
        _check_mimic_source(joints[name], of, joints, findings)
    for name in _find_loops(sources):
        findings.error(joints[name].element, "mimics itself; follow another joint")
        return
    for h in joints.values():
        _check_mimic_chain(h, joints, findings)


def _check_mimic_chain(
    h: UrdfJoint, joints: Mapping[str, UrdfJoint], findings: Diagnostics
) -> None:
    """Report a mimic with a too large ratio or offset to the last source of its chain."""
    tie = h.joint.follows
    while isinstance(tie, Mimic) and tie.of in joints:
        if max(abs(tie.ratio), abs(tie.offset)) > LARGEST_NUMBER:
            numbers = f"ratio {tie.ratio:g} and offset {tie.offset:g} to '{tie.of}'"
            findings.error(
                h.element, f"mimic: {numbers}, through others; at most {LARGEST_NUMBER:g}"
            )
            return
        above = joints[tie.of].joint.follows
        if not isinstance(above, Mimic):
            return
        tie = tie.through(above)


def _check_mimic_source(
    h: UrdfJoint, of: str, joints: dict[str, UrdfJoint], findings: Diagnostics
) -> None:
    """Report a mimic of a joint that is missing or has no single coordinate."""
    if of not in joints:
        findings.error(h.element, f"mimic: no joint {format_value(of)}; {suggest_name(of, joints)}")
    elif not joints[of].joint.model.single:
        kind = joints[of].joint.kind
        findings.error(h.element, f"mimic: '{of}' is {kind}, and has no single coordinate")
