"""Limits of coordinates, from the limits of their joints and of mimicking joints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.robot.joint import LIMIT_SLACK, Mimic
from robsim.robot.link import Link, list_coordinate_names


def combine_limits(links: Sequence[Link]) -> Array:
    """Return the limits (nq, 2) of the coordinates, narrowed by the limits of mimicking joints.

    The array is read-only. Raise InputError if a joint with limits mimics a coordinate that follows
    by a coupling other than `Mimic`.
    """
    names = list_coordinate_names(links)
    own = (link.joint for link in links if link.joint.parts.coordinates)
    each = (joint.model.ranges(joint.limits, joint.required_part) for joint in own)
    rows = np.concatenate([np.empty((0, 2)), *each])
    number = {name: i for i, name in enumerate(names)}
    follows = {link.label: link.joint.follows for link in links}
    for link in links:
        tie = link.joint.follows
        if isinstance(tie, Mimic) and link.joint.limits is not None:
            root = tie.root(follows)
            if root.of not in number:
                above = follows[root.of]
                assert above is not None  # `root.of` is no independent coordinate
                raise InputError(
                    f"limits of '{link.name}' are not checked, because '{root.of}' follows by "
                    f"{type(above).__name__}: limit '{above.of}'"
                )
            source, (low, high) = number[root.of], root.source_limits(link.joint.limits)
            rows[source] = max(rows[source, 0], low), min(rows[source, 1], high)
    return make_read_only(rows)


def check_common_limits(rows: Array, names: Iterable[str], robot: str) -> None:
    """Raise InputError if a coordinate and its mimicking joints have no common limits."""
    for name, (low, high) in zip(names, rows, strict=True):
        if not (low <= high and low < np.inf and high > -np.inf):
            raise InputError(
                f"joint '{name}' of '{robot}' and the joints that mimic it are never within their "
                "limits at once"
            )


def check_within_limits(
    q: Array, rows: Array, names: Sequence[str], units: Sequence[str], what: str, robot: str
) -> None:
    """Raise InputError for the first coordinate of q (..., nq) that is outside its limits."""
    low, high = rows[:, 0] - LIMIT_SLACK, rows[:, 1] + LIMIT_SLACK
    outside = (q < low) | (q > high)
    if outside.any():
        where = tuple(int(i) for i in np.argwhere(outside)[0])
        name, (lo, hi), unit = names[where[-1]], rows[where[-1]], units[where[-1]]
        row = f" of row {where[:-1]}" if q.ndim > 1 else ""
        raise InputError(
            f"{what}{row}: joint '{name}' of '{robot}' is {q[where]:.6g} {unit}, "
            f"outside its limits [{lo:.6g}, {hi:.6g}] {unit}"
        )
