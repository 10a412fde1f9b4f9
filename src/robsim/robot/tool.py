"""Tools: links of one robot, attached to a link of another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.robot.joint import Joint
from robsim.robot.link import Link


def mount_tool(
    arm: Sequence[Link], tool: Sequence[Link], name: str, on: str, pose: Pose, bare: bool
) -> tuple[Link, ...]:
    """Return the links of an arm and of a tool with its base at `pose` on the link `on`.

    With `bare`, the link `on` loses its shapes. Raise InputError for names that clash, even with
    the name of the tool in front.
    """
    taken = {link.name for link in arm}
    links = {link.name: _prefix_if_taken(link.name, taken, name) for link in tool}
    taken_too = {link.label for link in _list_moving_links(arm)}
    labels = {
        link.label: _prefix_if_taken(link.joint.name or links[link.name], taken_too, name)
        for link in _list_moving_links(tool)
    }
    _check_distinct_names(taken, links.values(), name)
    _check_distinct_names(taken_too, labels.values(), name)
    base = tool[0]
    place = Joint(place=pose @ base.joint.place @ base.joint.tail)
    tool_links = [Link(links[base.name], on, place, base.shapes, base.inertia)]
    for link in tool[1:]:
        joint, parent = _rename_joint(link, links[link.name], labels), links[str(link.parent)]
        tool_links.append(replace(link, name=links[link.name], parent=parent, joint=joint))
    arm_links = [replace(link, shapes=()) if bare and link.name == on else link for link in arm]
    return (*arm_links, *tool_links)


def _list_moving_links(links: Iterable[Link]) -> list[Link]:
    """Return the links with a joint that moves."""
    return [link for link in links if link.joint.moves]


def _prefix_if_taken(name: str, taken: set[str], prefix: str) -> str:
    """Return the name, with a prefix if it is taken."""
    return f"{prefix}_{name}" if name in taken else name


def _check_distinct_names(taken: set[str], names: Iterable[str], tool: str) -> None:
    """Raise InputError if two links or coordinates have the same name."""
    every = [*taken, *names]
    twice = sorted({name for name in every if every.count(name) > 1})
    if twice:
        raise InputError(
            f"two links or coordinates would be called '{twice[0]}'; give the tool a name of its "
            f"own: tool.named('{tool}_2')"
        )


def _rename_joint(link: Link, name: str, labels: Mapping[str, str]) -> Joint:
    """Return the joint of a renamed link, with the new names of coordinates."""
    joint = link.joint
    if not joint.moves:
        return joint
    label = labels[link.label]
    joint = replace(joint, name=None if label == name else label)
    if joint.follows is None or not joint.is_coupled:
        return joint
    source, dot, part = joint.follows.of.partition(".")
    return joint.following(f"{labels[source]}{dot}{part}")
