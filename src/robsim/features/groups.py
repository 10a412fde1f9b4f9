"""Marks in groups of two or of four."""

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.features.feature import Observation


def points_in_groups(seen: Observation, size: int, who: str) -> Array:
    """Return image points (N, 2, B), or raise InputError if `size` does not divide N."""
    points = seen.points_last
    if not len(points) or len(points) % size:
        raise InputError(
            f"{who}: takes marks {size} by {size}, so their number must be a multiple of {size}; "
            f"the target has {len(points)}"
        )
    return points
