"""Vocabulary of URDF files: the permitted attributes and elements, and names.

It follows the specification at https://wiki.ros.org/urdf/XML. Misspelt words are errors, and other
unknown words are left out with a warning. Known extensions without effect on the kinematics, and
words with a prefix as in "drake:", are left out without a warning.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from hashlib import blake2s
from itertools import islice
from typing import NamedTuple

from robsim.base.errors import format_value
from robsim.base.name_check import LONGEST_NAME
from robsim.base.xml_elements import Element
from robsim.robot.urdf.diagnostics import Diagnostics


class ElementWords(NamedTuple):
    """Permitted words of an element; `silent` lists extensions, `spare` redundant attributes."""

    attributes: tuple[str, ...] = ()
    children: tuple[str, ...] = ()
    silent: tuple[str, ...] = ()
    spare: tuple[str, ...] = ()


_SHAPE = ElementWords(
    ("name",), ("origin", "geometry", "material"), ("verbose", "contact_coefficients")
)
VOCABULARY = {
    "robot": ElementWords(
        ("name", "version"),
        ("link", "joint", "material", "robsim"),
        ("gazebo", "transmission", "sensor", "ros2_control", "mujoco"),
    ),
    "robsim": ElementWords(("tip",)),  # element of RobSim, which other programs ignore
    "link": ElementWords(
        ("name", "type"),
        ("inertial", "visual", "collision"),
        ("gazebo", "contact", "self_collision_checking", "verbose"),
    ),
    "joint": ElementWords(
        ("name", "type"),
        ("parent", "child", "origin", "axis", "limit", "dynamics", "mimic"),
        ("gazebo", "calibration", "safety_controller"),
    ),
    "inertial": ElementWords((), ("origin", "mass", "inertia")),
    "mass": ElementWords(("value",)),
    "inertia": ElementWords(
        ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), spare=("iyx", "izx", "izy")
    ),
    "visual": _SHAPE,
    "collision": _SHAPE,
    "geometry": ElementWords(("name",), ("box", "cylinder", "sphere", "mesh")),
    "box": ElementWords(("size",)),
    "cylinder": ElementWords(("radius", "length")),
    "sphere": ElementWords(("radius",)),
    "mesh": ElementWords(("filename", "scale")),
    "material": ElementWords(("name",), ("color",), ("texture",)),
    "color": ElementWords(("rgba",)),
    "origin": ElementWords(("xyz", "rpy")),
    "axis": ElementWords(("xyz",)),
    "limit": ElementWords(("lower", "upper", "effort", "velocity")),
    "dynamics": ElementWords(("damping", "friction")),
    "mimic": ElementWords(("joint", "multiplier", "offset")),
    "parent": ElementWords(("link",)),
    "child": ElementWords(("link",)),
}
MISLEADING_WORDS = {"quat_xyzw": "rpy"}  # unknown words that matter, and their known replacements
REPEATED_TAGS = ("link", "joint", "visual", "collision", "material")
XACRO_HINT = 'an expression of xacro; expand the file first: "xacro in.xacro > out.urdf"'
# suffixes of auxiliary links and joints, for links with an origin beside the axis of their joint
AXIS_SUFFIX, TAIL_SUFFIX = ".axis", ".tail"
_UNSAFE = re.compile(r"[^A-Za-z0-9_-]")


def check_words(element: Element, findings: Diagnostics) -> None:
    """Report unknown attributes and children of an element, and of its known children."""
    word = VOCABULARY[element.tag]
    if element.text:
        findings.odd(
            element, f"text {format_value(element.text)} stands between the elements, left out"
        )
    for name in element.attributes:
        if name in word.spare:
            findings.odd(element, f"attribute '{name}' repeats an entry of the tensor; left out")
        elif name not in word.attributes and not _has_prefix(name):
            _report_unknown_word(
                element, f"attribute '{name:.60}'", name, word.attributes, findings
            )
    tags: set[str] = set()
    for child in element.children:
        tag = child.tag
        if tag in word.children:
            if tag in tags and (tag not in REPEATED_TAGS or element.tag in ("visual", "collision")):
                findings.error(child, "there is one already; only one is allowed")
            tags.add(tag)
            check_words(child, findings)
        elif tag.startswith("xacro:"):
            findings.error(child, 'xacro is not read; expand it: "xacro in.xacro > out.urdf"')
        elif tag not in word.silent and not _has_prefix(tag):
            _report_unknown_word(child, "element", tag, (*word.children, *word.silent), findings)


def find_child(element: Element, tag: str) -> Element | None:
    """Return the first child with a tag, or None."""
    return next((each for each in element.children if each.tag == tag), None)


def find_children(element: Element, tag: str) -> list[Element]:
    """Return all children with a tag."""
    return [each for each in element.children if each.tag == tag]


def require_attribute(element: Element, name: str, findings: Diagnostics) -> str | None:
    """Return a required attribute; report an error if it is missing, empty or not expanded."""
    value = element.attributes.get(name)
    if value is None or not value.strip():
        findings.error(element, f"{name} is missing; it must be given")
        return None
    if is_xacro_expression(value):
        findings.error(element, f"{name} = {format_value(value)}: {XACRO_HINT}")
        return None
    return value


def is_xacro_expression(text: str) -> bool:
    """Return whether the text is an expression that xacro should have replaced."""
    return "${" in text or "$(" in text


def read_safe_name(element: Element, findings: Diagnostics) -> str | None:
    """Return the name of an element as a safe name for paths; report a change."""
    original = require_attribute(element, "name", findings)
    if original is None:
        return None
    name = make_safe_name(original, element.tag)
    if name != original:
        reason = "short enough" if len(original) > LONGEST_NAME else "safe"
        findings.odd(
            element, f"its name is read as '{name}', which is {reason} in paths and figures"
        )
    return name


def make_safe_name(name: str, kind: str) -> str:
    """Return a name of at most 64 letters, digits, _ and -, with a letter in front.

    Other characters become _. A longer name is cut, and eight digits of a hash of the whole name
    are appended.

    >>> make_safe_name("tool0/cam", "link"), make_safe_name("2r", "robot")
    ('tool0_cam', 'robot_2r')
    >>> make_safe_name("world", "link")
    'world_link'
    >>> make_safe_name("left_" * 14, "link")
    'left_left_left_left_left_left_left_left_left_left_left__40b9b432'
    """
    if kind == "link" and name == "world":  # the frame that robots stand on
        return "world_link"
    mapped = _UNSAFE.sub("_", name)
    whole = mapped if re.match("[A-Za-z]", mapped) else f"{kind}_{mapped}"
    if len(whole) <= LONGEST_NAME:
        return whole
    digits = blake2s(name.encode("utf-8", "surrogatepass"), digest_size=4).hexdigest()
    return f"{whole[: LONGEST_NAME - 1 - len(digits)]}_{digits}"


def find_nearest_word(name: str, names: Iterable[str]) -> str | None:
    """Return the name that this name probably misspells, or None.

    >>> find_nearest_word("xzy", ["xyz", "rpy"])
    'xyz'
    >>> find_nearest_word("current", ["effort", "velocity"]) is None
    True
    """
    allowed = 1 if len(name) <= 4 else 2
    near = [n for n in names if abs(len(n) - len(name)) <= allowed and min(len(n), len(name)) > 1]
    ranked = sorted((_count_edits(name.lower(), n.lower(), allowed), n) for n in near)
    return ranked[0][1] if ranked and ranked[0][0] <= allowed else None


def suggest_name(name: str, names: Iterable[str]) -> str:
    """Return the end of a message about a name that does not exist."""
    near = find_nearest_word(name, islice(names, 256))
    return f"did you mean '{near}'?" if near else "no similar name exists"


def _has_prefix(name: str) -> bool:
    """Return whether a word has a prefix of a namespace."""
    return ":" in name or name == "xmlns"


def _report_unknown_word(
    element: Element, what: str, name: str, known: tuple[str, ...], findings: Diagnostics
) -> None:
    """Report an unknown word: as an error if it is near a known word, else as an oddity."""
    near = MISLEADING_WORDS.get(name) or find_nearest_word(name, known)
    if near is None:
        findings.odd(element, f"unknown {what}, left out")
    else:
        findings.error(element, f"unknown {what}; did you mean '{near}'? {', '.join(known)}")


def _count_edits(a: str, b: str, most: int) -> int:
    """Return the edit distance with swaps (Damerau) of two words, if it is at most `most`."""
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, x in enumerate(a):
        two_before, before = before, row
        row = [i + 1]
        for j, y in enumerate(b):
            cost = min(before[j + 1] + 1, row[j] + 1, before[j] + (x != y))
            if i and j and x == b[j - 1] and a[i - 1] == y:
                cost = min(cost, two_before[j - 1] + 1)
            row.append(cost)
        if min(row) > most:
            return most + 1
    return row[-1]
