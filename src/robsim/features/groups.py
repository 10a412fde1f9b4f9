"""Marks that are taken two by two, or four by four."""

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.features.feature import Observation


def points_in_groups(seen: Observation, size: int, who: str) -> Array:
    """Image points (N, 2, B), if N is a multiple of `size`; else InputError that names `who`."""
    points = seen.points_last
    if not len(points) or len(points) % size:
        raise InputError(
            f"{who}: takes marks {size} by {size}, so their number must be a multiple of {size}; "
            f"the target has {len(points)}"
        )
    return points
