"""The default choice of a robot's tip link."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from robsim.robot.link import Link

# what robot makers call the frame of the tool, the nearest to the work first: the tool centre
# point; tool0 of ROS-Industrial; tool, end effector and flange of the others
TOOLS = (
    "tcp",
    "tool_center_point",
    "tool0",
    "tool",
    "eef",
    "ee",
    "end_effector",
    "endeffector",
    "endpoint",
    "grasp",
    "grasping",
    "grasp_center",
    "flange",
)
PALMS = {"gripper", "hand", "palm"}  # links that carry fingers
MOST_LISTED = 8  # candidates that a warning lists
FILLING = {"link", "frame", "left", "right", "l", "r"}  # words without a meaning here


@dataclass(frozen=True)
class Tip:
    """The name of the chosen link, and those of others that would do as well."""

    name: str
    others: tuple[str, ...] = ()

    @property
    def warning(self) -> str:
        """The text of a warning about the choice."""
        listed = ", ".join(f"'{name}'" for name in self.others[:MOST_LISTED])
        more = len(self.others) - MOST_LISTED
        rest = f" and {more} more" if more > 0 else ""
        return (
            f"the tip is taken to be '{self.name}', and could as well be {listed}{rest}; "
            f"choose by tip='{self.others[0]}'"
        )


def find_tip(links: Sequence[Link]) -> Tip:
    """Return the link that is most likely the hand or the tool of a robot.

    Among the links that joints move and nothing hangs from: those called as in TOOLS, else all;
    of these the one behind the most joints. Where there are several, as with two arms, the first;
    where these are the fingers of one hand, that hand. The last link where nothing moves.

    >>> from robsim.robot.joint import Joint
    >>> arm, tool = Link("arm", "base", Joint("revolute")), Link("tool0", "arm")
    >>> find_tip([Link("base"), arm, tool, Link("cover", "base")]).name
    'tool0'
    """
    depth, parents = _depths(links), {link.parent for link in links}
    leaves = [name for name in depth if depth[name] and name not in parents]
    if not leaves:
        return Tip(links[-1].name)
    found = _named(leaves, TOOLS) or leaves
    most = max(depth[name] for name in found)
    deepest = [name for name in found if depth[name] == most]
    if len(deepest) == 1:
        return Tip(deepest[0])
    shared = _shared(links, deepest)
    hands = [name for name in shared if depth[name] and _carries_fingers(name)]
    first = (hands or deepest)[0]
    return Tip(first, tuple(name for name in deepest if name != first))


def _depths(links: Iterable[Link]) -> dict[str, int]:
    """Return the number of moving joints between the base and each link."""
    by_name = {link.name: link for link in links}
    depth: dict[str, int] = {}
    for name in by_name:
        chain = []
        above: str | None = name
        while above is not None and above not in depth:
            chain.append(by_name[above])
            above = by_name[above].parent
        count = 0 if above is None else depth[above]
        for link in reversed(chain):
            count += link.joint.moves
            depth[link.name] = count
    return {name: depth[name] for name in by_name}


def _shared(links: Iterable[Link], names: Iterable[str]) -> list[str]:
    """Return the links that are ancestors of all of these, the nearest first."""
    parents = {link.name: link.parent for link in links}
    chains = [list(_above(name, parents)) for name in names]
    return [name for name in chains[0] if all(name in chain for chain in chains)]


def _above(name: str, parents: Mapping[str, str | None]) -> Iterator[str]:
    """Yield the ancestors of a link, the nearest first."""
    above = parents[name]
    while above is not None:
        yield above
        above = parents[above]


def _named(names: Sequence[str], words: Iterable[str]) -> list[str]:
    """Return the names that match the first word that any name matches."""
    for word in words:
        found = [name for name in names if _is_called(name, (word,))]
        if found:
            return found
    return []


def _carries_fingers(name: str) -> bool:
    """Return whether the name is that of a hand, or of a tool."""
    return bool(PALMS & set(_words(name))) or _is_called(name, TOOLS)


def _is_called(name: str, words: Iterable[str]) -> bool:
    """Return whether a name ends in one of the words, apart from filling words.

    >>> _is_called("iiwa_link_ee", ("ee",)), _is_called("knee", ("ee",))
    (True, False)
    """
    parts = _words(name)
    return any(parts[-len(word.split("_")) :] == word.split("_") for word in words)


def _words(name: str) -> list[str]:
    """Return the words of a name in lower case, without filling words."""
    return [part for part in re.split("[_-]", name.lower()) if part not in FILLING]
