"""Conversion of a URDF file to a robot: its links, its joints and its tree."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import TypeVar

from robsim.base.elements import LARGEST_FILE, Element, parsed
from robsim.base.errors import FileError, InputError, said
from robsim.base.input import read_bytes
from robsim.robot.joint import Joint, Mimic
from robsim.robot.link import Link
from robsim.robot.tip import Tip, find_tip
from robsim.robot.urdf.findings import Findings
from robsim.robot.urdf.joints import Hinge, hinge
from robsim.robot.urdf.parts import TOKEN, colors, inertia, shapes
from robsim.robot.urdf.values import LARGEST
from robsim.robot.urdf.words import AXIS, TAIL, check_words, child, children, hint, named, needed

R = TypeVar("R")
Build = Callable[[str, tuple[Link, ...], str], R]  # of a name, the links and the tip
Links = dict[str, tuple[Element, Link]]  # by the name in the file
MOST_LINKS = 2048
MOST_MIMICS = 256


def read(path: str | os.PathLike[str], build: Build[R]) -> tuple[R, Tip]:
    """Return what `build` makes of a file, and the choice of the robot's tip.

    FileError lists all errors, one on each line; a FileWarning lists the oddities.
    """
    data = read_bytes(path, "a URDF file", LARGEST_FILE)
    root = parsed(data, str(path), "a URDF file, <robot name=...> ... </robot>")
    findings = Findings(str(path))
    if root.tag != "robot":
        raise FileError(f"{path}:{root.line}: <{root.tag:.40}>: expected <robot name=...>")
    check_words(root, findings)
    name, links = _parts(root, findings)
    tip = _tip(root, links, findings)
    try:
        robot = build(name, tuple(links), tip.name)
    except InputError as error:
        raise FileError(f"{path}: {error}") from None
    findings.warn()
    return robot, tip


def _tip(root: Element, links: Sequence[Link], findings: Findings) -> Tip:
    """Return the tip that our writer put into the file, or the one that the links suggest."""
    element = child(root, "robsim")
    name = None if element is None else needed(element, "tip", findings)
    names = [link.name for link in links]
    if element is not None and name is not None and name not in names:
        findings.error(element, f"tip: no link {said(name)}; {hint(name, names)}")
    findings.stop()
    return find_tip(links) if name is None else Tip(name)


def _parts(root: Element, findings: Findings) -> tuple[str, list[Link]]:
    """Return the name of the robot, and its links on their joints."""
    tails = _tails(root)
    drawn = [k for k in children(root, "link") if k.attributes.get("name") not in tails]
    behind = set(tails.values())
    joints = [j for j in children(root, "joint") if j not in behind]
    if not 0 < len(drawn) <= MOST_LINKS:
        findings.error(root, f"{len(drawn)} links; from 1 to {MOST_LINKS} are allowed")
    name = named(root, findings)
    links = _links(drawn, colors(root, findings), findings)
    hinges = [h for each in joints if (h := hinge(each, tails, findings)) is not None]
    if not links or len(links) + len(hinges) < len(drawn) + len(joints):
        findings.stop()  # their tree cannot be checked
    order = _hung(root, links, hinges, findings)
    findings.stop()
    assert name is not None
    return name, order


def _tails(root: Element) -> dict[str, Element]:
    """Return the <joint> "elbow.tail" behind each added <link> "elbow.axis".

    Only what is as our writer makes it: a link on a joint that shows nothing, and carries but
    "elbow".
    """
    above, behind = _by_link(root, "child"), _by_link(root, "parent")
    found = {}
    for link in children(root, "link"):
        name = link.attributes.get("name", "")
        stem, hung = name.removesuffix(AXIS), behind.get(name, [])
        if stem == name or name not in above or len(hung) != 1 or not _is_bare(link):
            continue
        end = child(hung[0], "child")
        written = hung[0].attributes == {"name": stem + TAIL, "type": "fixed"}
        if written and end is not None and end.attributes.get("link") == stem:
            found[name] = hung[0]
    return found


def _is_bare(link: Element) -> bool:
    """Return whether a link has nothing but the inertia that our writer gives what moves."""
    findings = Findings("")
    weight = inertia(link, findings)
    plain = not (findings.errors or findings.oddities) and weight in (None, TOKEN)
    return plain and all(part.tag == "inertial" for part in link.children)


def _by_link(root: Element, tag: str) -> dict[str, list[Element]]:
    """Return the joints that have a link as their <parent> or <child>, by its name."""
    found: dict[str, list[Element]] = {}
    for joint in children(root, "joint"):
        end = child(joint, tag)
        if end is not None:
            found.setdefault(end.attributes.get("link", ""), []).append(joint)
    return found


def _links(drawn: Iterable[Element], palette: Mapping[str, str], findings: Findings) -> Links:
    found: Links = {}
    for element in drawn:
        name = named(element, findings)
        weight, solids = inertia(element, findings), shapes(element, palette, findings)
        if name is None:
            continue
        given = element.attributes["name"]
        if given in found:
            line = found[given][0].line
            findings.error(element, f"there is a link of that name in line {line}; one is allowed")
        found[given] = element, Link(name, shapes=solids, inertia=weight)
    return found


def _hung(root: Element, links: Links, hinges: list[Hinge], findings: Findings) -> list[Link]:
    """Return the links on their joints: the root, then the children in the order of joints."""
    _check_names(links, hinges, findings)
    _check_mimics(hinges, findings)
    if not _check_ends(links, hinges, findings):
        findings.stop()
    above = {h.child: h for h in hinges}
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        listed = ", ".join(repr(name) for name in roots[:9])
        findings.error(root, f"{len(roots)} links hang from nothing: {listed}; one is allowed")
    _check_loops(links, above, findings)
    findings.stop()
    base = links[roots[0]][1]
    both = zip(hinges, _with_room(hinges, findings), strict=True)
    return [base, *(_on(joint, links[h.child][1], links[h.parent][1]) for h, joint in both)]


def _on(joint: Joint, link: Link, parent: Link) -> Link:
    """Return a link on its joint, without the inertia that our writer gives what moves."""
    token = joint.moves and link.inertia == TOKEN
    weight = None if token else link.inertia
    return replace(link, parent=parent.name, joint=joint, inertia=weight)


def _with_room(hinges: Iterable[Hinge], findings: Findings) -> Iterator[Joint]:
    """Yield the joints, without the limits of a mimic that leave its source no range.

    There are such files, and other programs do not look at the limits of what mimics.
    """
    joints = {h.name: h.joint for h in hinges}
    follows = {name: joint.follows for name, joint in joints.items()}
    room: dict[str, tuple[float, float]] = {}
    for h in hinges:
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


def _check_names(links: Links, hinges: Iterable[Hinge], findings: Findings) -> None:
    """Report names of links and of joints that occur twice, also after they are made safe."""
    taken: dict[str, Element] = {}
    for element, link in links.values():
        if link.name in taken:
            line = taken[link.name].line
            findings.error(element, f"'{link.name}', as it is read, is taken by line {line}")
        taken[link.name] = element
    joints: dict[str, Element] = {}
    for h in hinges:
        if h.name in joints:
            line = joints[h.name].line
            findings.error(h.element, f"there is a joint of that name in line {line}; give another")
        joints[h.name] = h.element


def _check_ends(links: Links, hinges: Iterable[Hinge], findings: Findings) -> bool:
    """Return whether every joint connects two existing links; report those that do not."""
    carried: dict[str, Hinge] = {}
    before = len(findings.errors)
    for h in hinges:
        for what, name in (("parent", h.parent), ("child", h.child)):
            if name not in links:
                findings.error(h.element, f"{what}: no link {said(name)}; {hint(name, links)}")
        if h.parent == h.child:
            findings.error(h.element, f"parent and child are both {said(h.child)}; join two links")
        elif h.child in carried:
            other = carried[h.child].element
            text = f"{said(h.child)} is also the child of {other.label} in line {other.line}"
            findings.error(h.element, f"{text}; a link has one parent")
        carried[h.child] = h
    return len(findings.errors) == before


def _check_loops(links: Iterable[str], above: dict[str, Hinge], findings: Findings) -> None:
    """Report links that are their own ancestors."""
    for name in _loops({name: above[name].parent for name in links if name in above}):
        text = f"a loop: {said(name)} hangs from itself in the end"
        findings.error(above[name].element, text)


def _loops(above: Mapping[str, str]) -> Iterator[str]:
    """Yield a name of each loop, from what each name hangs from or follows."""
    done: set[str] = set()
    for start in above:
        path, name = set[str](), start
        while name in above and name not in done and name not in path:
            path.add(name)
            name = above[name]
        if name in path:
            yield name
        done |= path


def _check_mimics(hinges: Iterable[Hinge], findings: Findings) -> None:
    """Report mimics of joints that are missing, unsuitable, or the mimic itself."""
    joints = {h.name: h for h in hinges}
    sources = {name: h.joint.follows.of for name, h in joints.items() if h.joint.follows}
    if len(sources) > MOST_MIMICS:
        findings.error(next(iter(joints.values())).element, f"more than {MOST_MIMICS} <mimic>")
        return
    for name, of in sources.items():
        _check_source(joints[name], of, joints, findings)
    for name in _loops(sources):
        findings.error(joints[name].element, "mimics itself in the end; follow another joint")
        return
    for h in joints.values():
        _check_chain(h, joints, findings)


def _check_chain(h: Hinge, joints: Mapping[str, Hinge], findings: Findings) -> None:
    """Report a mimic whose ratio or offset to what it follows in the end is too large."""
    tie = h.joint.follows
    while isinstance(tie, Mimic) and tie.of in joints:
        if max(abs(tie.ratio), abs(tie.offset)) > LARGEST:
            numbers = f"ratio {tie.ratio:g} and offset {tie.offset:g} to '{tie.of}'"
            findings.error(h.element, f"mimic: {numbers}, through others; at most {LARGEST:g}")
            return
        above = joints[tie.of].joint.follows
        if not isinstance(above, Mimic):
            return
        tie = tie.through(above)


def _check_source(h: Hinge, of: str, joints: dict[str, Hinge], findings: Findings) -> None:
    if of not in joints:
        findings.error(h.element, f"mimic: no joint {said(of)}; {hint(of, joints)}")
    elif not joints[of].joint.model.single:
        kind = joints[of].joint.kind
        findings.error(h.element, f"mimic: '{of}' is {kind}, and has not one coordinate to follow")
