"""Denavit-Hartenberg rows as links on joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import as_floats
from robsim.base.errors import InputError, format_value, is_known_name
from robsim.base.unit_warnings import warn_of_degrees
from robsim.geometry.primitives import Primitive
from robsim.robot.dh_row import DH_CONVENTIONS, DHRow
from robsim.robot.joint import Joint
from robsim.robot.link import Link


def build_dh_links(
    rows: ArrayLike,
    convention: str,
    joints: str | None,
    limits: ArrayLike | None,
    links: Sequence[str] | None,
    shapes: Sequence[Sequence[Primitive]] | None,
) -> tuple[Link, ...]:
    """Return a base and one link for each row; see `Robot.from_dh`."""
    table = as_floats(rows, "DH rows (theta, d, a, alpha)", ("n", 4))
    n = len(table)
    if table.ndim != 2 or n == 0:
        raise InputError(f"DH rows: expected shape (n, 4), got {table.shape}")
    warn_of_degrees(table[:, [0, 3]], "DH rows (theta, d, a, alpha)")
    if not is_known_name(convention, DH_CONVENTIONS):
        raise InputError(
            f"DH convention must be 'standard' or 'modified', got {format_value(convention)}"
        )
    kinds = _read_joint_letters("R" * n if joints is None else joints, n)
    ranges = [None] * n if limits is None else _read_dh_limits(limits, n)
    if links is not None and (isinstance(links, str) or not isinstance(links, Sequence)):
        raise InputError(f"links: expected a list of {n} names, got {format_value(links)}")
    names = ["base", *(links or [f"link{i + 1}" for i in range(n)])]
    solids = _check_shape_lists([()] * (n + 1) if shapes is None else shapes)
    if len(names) != n + 1 or len(solids) != n + 1:
        raise InputError(f"{n} DH rows need {n} link names and {n + 1} lists of shapes")
    parts = [Link("base", shapes=solids[0])]
    for i in range(n):
        theta, d, a, alpha = table[i].tolist()
        row = DHRow(theta, d, a, alpha, convention)
        joint = Joint(kinds[i], limits=ranges[i], dh=row)
        parts.append(Link(names[i + 1], names[i], joint, solids[i + 1]))
    return tuple(parts)


def _check_shape_lists(lists: Any) -> list[tuple[Primitive, ...]]:
    """Return the shapes of each link, from a list of lists."""
    rows = lists if isinstance(lists, list | tuple) else [lists]
    for row in rows:
        if not isinstance(row, list | tuple):
            raise InputError(
                f"shapes: expected a list of shapes for each link, got {format_value(row)}"
            )
    return [tuple(row) for row in rows]


def _read_dh_limits(limits: ArrayLike, n: int) -> list[Any]:
    """Return the limits of each joint, or None for a joint without limits, (-inf, inf)."""
    try:
        pairs = np.asarray(limits, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"limits: expected shape ({n}, 2), got {format_value(limits)}") from None
    is_free: Any = pairs == np.array([-np.inf, np.inf]) if pairs.shape == (n, 2) else np.False_
    ranges = as_floats(np.where(is_free, 0.0, pairs), "limits", (n, 2))
    each = zip(is_free, np.where(is_free, pairs, ranges).tolist(), strict=True)
    return [None if np.all(ends) else tuple(span) for ends, span in each]


def _read_joint_letters(joints: object, n: int) -> list[Literal["revolute", "prismatic"]]:
    """Return the kind of each joint from its letter."""
    if not isinstance(joints, str) or len(joints) != n or set(joints) - set("RP"):
        raise InputError(f"joints: expected {n} letters R or P, as in {'R' * n!r}, got {joints!r}")
    return ["revolute" if letter == "R" else "prismatic" for letter in joints]
