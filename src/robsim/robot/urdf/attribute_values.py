"""Numbers, vectors and poses of a URDF file."""

from __future__ import annotations

import math
import re

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import format_value
from robsim.base.xml_elements import XML_BLANKS, Element
from robsim.geometry.pose import IDENTITY, Pose
from robsim.robot.urdf.diagnostics import Diagnostics
from robsim.robot.urdf.vocabulary import XACRO_HINT, find_child, require_attribute

LARGEST_NUMBER = 1e9  # largest number, so that no product of poses overflows
LONGEST_NUMBER = 64  # largest number of characters in a number
_BLANKS = re.compile(f"[{XML_BLANKS}]+")
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)


def read_attribute_number(
    element: Element,
    name: str,
    findings: Diagnostics,
    default: float | None = None,
    most: float = LARGEST_NUMBER,
) -> float | None:
    """Return one finite number, the default if it is missing, or None after an error."""
    if default is not None and name not in element.attributes:
        return default
    text = require_attribute(element, name, findings)
    values = (
        None if text is None else _parse_attribute_numbers(element, name, text, 1, findings, most)
    )
    return None if values is None else values[0]


def read_positive_number(element: Element, name: str, findings: Diagnostics) -> float | None:
    """Return a number above 0, or None; 0 is reported as an oddity, less as an error."""
    value = read_attribute_number(element, name, findings)
    if value is None or value > 0:
        return value
    if value < 0:
        findings.error(element, f"{name} is {value:g}; it must be above 0")
    else:
        findings.odd(element, f"{name} is 0, so nothing is visible; left out")
    return None


def read_attribute_vector(
    element: Element, name: str, findings: Diagnostics, default: str | None = None, count: int = 3
) -> Array | None:
    """Return an array of `count` numbers that are separated by spaces, or None after an error."""
    text = element.attributes.get(name, default)
    text = require_attribute(element, name, findings) if text is None else text
    values = (
        None if text is None else _parse_attribute_numbers(element, name, text, count, findings)
    )
    return None if values is None else np.array(values)


def read_origin_pose(element: Element, findings: Diagnostics) -> Pose:
    """Return the pose of an <origin>, by default the identity."""
    tag = find_child(element, "origin")
    if tag is None:
        return IDENTITY
    xyz = read_attribute_vector(tag, "xyz", findings, "0 0 0")
    rpy = read_attribute_vector(tag, "rpy", findings, "0 0 0")
    if xyz is None or rpy is None:
        return IDENTITY
    return Pose.at(*xyz, rpy=rpy)


def find_axis_rotation(axis: ArrayLike) -> Array:
    """Return a rotation R (3, 3) with R z = axis, a unit vector; the exact identity for z.

    >>> find_axis_rotation([0, 1, 0]) @ [0, 0, 1]
    array([0., 1., 0.])
    """
    z = np.asarray(axis, dtype=float)
    if (z == (0, 0, 1)).all():
        return np.eye(3)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    columns: Array = np.stack([x, np.cross(z, x), z], axis=1) + 0.0
    return columns


def _parse_attribute_numbers(
    element: Element,
    name: str,
    text: str,
    count: int,
    findings: Diagnostics,
    most: float = LARGEST_NUMBER,
) -> list[float] | None:
    """Return the numbers of a text, or None after an error."""
    words = split_words(text, count)
    message = _describe_wrong_words(words, count, most)
    if message is not None:
        findings.error(element, f"{name} = {format_value(text)}: {message}")
        return None
    return [float(word) for word in words]


def _describe_wrong_words(words: list[str], count: int, most: float) -> str | None:
    """Return an error message for words that are not `count` valid numbers, or None."""
    for word in words[:count]:
        if len(word) > LONGEST_NUMBER or not _NUMBER.fullmatch(word):
            return _describe_wrong_number(word)
    if len(words) != count:
        expected = "one number" if count == 1 else f"{count} numbers"
        return f"expected {expected}, got {len(words) if len(words) <= count else 'more'}"
    values = [float(word) for word in words]
    if not all(map(math.isfinite, values)):
        return "every number must be finite"
    return f"at most {most:g} is allowed" if any(abs(x) > most for x in values) else None


def split_words(text: str, count: int) -> list[str]:
    """Return the first `count` words of a text, and the rest as one word, separated at XML blanks.

    >>> split_words("0 1\\t2 3 4", 3)
    ['0', '1', '2', '3 4']
    """
    return [word for word in _BLANKS.split(text.strip(XML_BLANKS), count) if word]


def _describe_wrong_number(word: str) -> str:
    """Return the error message for a word that is not a number."""
    if word.lower().lstrip("+-") in ("nan", "inf", "infinity"):
        return "every number must be finite"
    if "," in word:
        allowed = "a decimal point is allowed, and spaces between numbers"
        return f"{format_value(word)} is no number; {allowed}"
    if "$" in word:
        return XACRO_HINT
    return f"{format_value(word)} is no number"
