"""Sequence of straight motions of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value
from robsim.geometry.pose import Pose
from robsim.trajectory.straight import Straight
from robsim.trajectory.time_law import check_times

LARGEST_GAP = 1e-6  # largest gap between two parts, in metres and in entries of rotation matrices


@name_parameters
@dataclass(frozen=True, eq=False)
class Path(Value):
    """Sequence of straight motions of a frame, with rest between them.

    Each motion starts at the end of the previous motion. Use a `Path` to guide a frame through
    several poses; the task `FollowPath` accepts it like a single `Straight`.

    Parameters
    ----------
    parts : list of Straight
        Single motions (no batches), in their order. The end of each motion and the start of the
        next agree to 1e-6 in metres and in the entries of the rotation matrix.

    Raises
    ------
    InputError
        If a part is not a single `Straight`, or does not start at the end of the previous part.

    Examples
    --------
    >>> from robsim import Pose
    >>> A, B, C = Pose.at(0, 0, 0), Pose.at(1, 0, 0), Pose.at(1, 1, 0)
    >>> path = Path([Straight(A, B, 2.0), Straight(B, C, 1.0)])
    >>> path.duration, path.at(2.5)[:3, 3]
    (3.0, array([1. , 0.5, 0. ]))
    """

    parts: tuple[Straight, ...]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, parts: Sequence[Straight]) -> None: ...

    def __post_init__(self) -> None:
        parts = tuple(self.parts) if isinstance(self.parts, list | tuple) else ()
        if not parts or not all(isinstance(part, Straight) for part in parts):
            raise InputError(f"path: expected a list of Straight, got {format_value(self.parts)}")
        for i, part in enumerate(parts):
            if part.start.matrix.ndim + part.end.matrix.ndim != 4:
                raise InputError(f"path: part {i} is several motions at once; give single poses")
        for i, (one, other) in enumerate(pairwise(parts)):
            apart = np.abs(one.end.matrix - other.start.matrix).max()
            if apart > LARGEST_GAP:
                raise InputError(
                    f"path: part {i + 1} does not start where part {i} ends; they are "
                    f"{apart:.3g} apart"
                )
        object.__setattr__(self, "parts", parts)

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return float(self._starts[-1])

    @property
    def start(self) -> Pose:
        """First pose."""
        return self.parts[0].start

    @property
    def end(self) -> Pose:
        """Last pose."""
        return self.parts[-1].end

    def at(self, t: ArrayLike) -> Array:
        """Return poses (..., 4, 4) in the base frame at times t (...) in seconds."""
        return self._evaluate(t, "at", (4, 4))

    def twist(self, t: ArrayLike) -> Array:
        """Return twists (..., 6) = (v, omega) in m/s and rad/s, in base axes, at times t (...)."""
        return self._evaluate(t, "twist", (6,))

    def _evaluate(self, t: ArrayLike, name: str, tail: tuple[int, ...]) -> Array:
        """Return the values (..., *tail) of the method `name` of the parts at times t (...)."""
        times, starts = check_times(t), self._starts
        index = np.clip(np.searchsorted(starts, times, "right") - 1, 0, len(self.parts) - 1)
        out = np.empty((*times.shape, *tail))
        for i, part in enumerate(self.parts):
            selected = index == i
            out[selected] = getattr(part, name)(times[selected] - starts[i])
        return out

    @property
    def _starts(self) -> Array:
        """Start times of the parts, and the end time, in seconds."""
        return np.concatenate([[0.0], np.cumsum([part.duration for part in self.parts])])
