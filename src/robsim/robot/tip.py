"""Default choice of the tip link of a robot."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from robsim.robot.link import Link

# common names of the tool frame, the nearest to the work first: the tool centre point; tool0 of
# ROS-Industrial; tool, end effector and flange of other manufacturers
TOOL_NAMES = (
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
PALM_NAMES = {"gripper", "hand", "palm"}  # links that carry fingers
MOST_LISTED = 8  # candidates that a warning lists
FILLER_WORDS = {"link", "frame", "left", "right", "l", "r"}  # words without a meaning here


@dataclass(frozen=True)
class Tip:
    """Name of the tip link, and the names of other links that are equally suitable."""

    name: str
    others: tuple[str, ...] = ()

    @property
    def warning(self) -> str:
        """Text of a warning about the equally suitable links."""
        names = ", ".join(f"'{name}'" for name in self.others[:MOST_LISTED])
        more = len(self.others) - MOST_LISTED
        rest = f" and {more} more" if more > 0 else ""
        return (
            f"the tip is taken to be '{self.name}', and could as well be {names}{rest}; "
            f"choose by tip='{self.others[0]}'"
        )


def find_tip(links: Sequence[Link]) -> Tip:
    """Return the link that is most likely the hand or the tool of a robot.

    Candidates are the moving links without children. If some of them have a common name of tools,
    only these are candidates. The tip is the candidate behind the most joints. Among several, for
    example of two arms, it is the first. If these candidates are the fingers of one hand, the tip
    is the hand. If no link moves, the tip is the last link.

    >>> from robsim.robot.joint import Joint
    >>> arm, tool = Link("arm", "base", Joint("revolute")), Link("tool0", "arm")
    >>> find_tip([Link("base"), arm, tool, Link("cover", "base")]).name
    'tool0'
    """
    parents = {link.name: link.parent for link in links}
    moving = {link.name: link.joint.moves for link in links}
    depth = {
        name: sum(moving[each] for each in _iterate_ancestors(name, parents)) for name in parents
    }
    carriers = set(parents.values())
    leaves = [name for name in depth if depth[name] and name not in carriers]
    if not leaves:
        return Tip(links[-1].name)
    candidates = _match_first_word(leaves, TOOL_NAMES) or leaves
    most = max(depth[name] for name in candidates)
    deepest = [name for name in candidates if depth[name] == most]
    if len(deepest) == 1:
        return Tip(deepest[0])
    first, *others = (list(_iterate_ancestors(name, parents)) for name in deepest)
    shared = [name for name in first if all(name in other for other in others)]
    hands = [name for name in shared if depth[name] and _is_hand(name)]
    chosen = (hands or deepest)[0]
    return Tip(chosen, tuple(name for name in deepest if name != chosen))


def _iterate_ancestors(name: str | None, parents: Mapping[str, str | None]) -> Iterator[str]:
    """Yield a link and its ancestors, the nearest first."""
    while name is not None:
        yield name
        name = parents[name]


def _match_first_word(names: Sequence[str], words: Iterable[str]) -> list[str]:
    """Return the names that match the first word with any match."""
    for word in words:
        matches = [name for name in names if _ends_in_word(name, (word,))]
        if matches:
            return matches
    return []


def _is_hand(name: str) -> bool:
    """Return whether the name is the name of a hand or of a tool."""
    return bool(PALM_NAMES & set(_split_link_name(name))) or _ends_in_word(name, TOOL_NAMES)


def _ends_in_word(name: str, words: Iterable[str]) -> bool:
    """Return whether a name ends in one of the words, apart from filling words.

    >>> _ends_in_word("iiwa_link_ee", ("ee",)), _ends_in_word("knee", ("ee",))
    (True, False)
    """
    parts = _split_link_name(name)
    return any(parts[-len(word.split("_")) :] == word.split("_") for word in words)


def _split_link_name(name: str) -> list[str]:
    """Return the words of a name in lower case, without filling words."""
    return [part for part in re.split("[_-]", name.lower()) if part not in FILLER_WORDS]
