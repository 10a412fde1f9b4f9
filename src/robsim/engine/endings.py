"""Endings: further conditions that end the runs of an experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, euclidean_length, view_for_user
from robsim.base.errors import FrameError, InputError, format_value
from robsim.declare import DeclaredValue, Flag, KindOf, Length, ListOf, family, register
from robsim.declare.texts import FrameReference
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.formulas.body_arrays import Bodies
from robsim.world.frame_box import FrameBox
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class ControlInstant:
    """State of B runs at a control instant after the command, for an `Ending`.

    The run is the first axis of all arrays.

    Attributes
    ----------
    time : float
        Seconds since the start.
    scene : Scene
        True scene, for its names. Numbers that differ from run to run belong to an arbitrary run.
    q : ndarray of shape (B, nq)
        Coordinates.
    qd : ndarray of shape (B, nv)
        Commanded or prescribed velocities.
    error : ndarray of shape (B, k)
        Error of the features.
    pixels : ndarray of shape (B, N, 2)
        True image coordinates of all marks.
    runs : ndarray of shape (B,)
        Numbers of the runs in their batch, from 0.

    Examples
    --------
    An ending of your own, for a high tool:

    >>> class TooHigh:
    ...     def holds(self, now):
    ...         return now.position("arm.tool")[:, 2] > 1.0
    >>> isinstance(TooHigh(), Ending)
    True
    """

    time: float
    scene: Scene
    q: Array
    qd: Array
    error: Array
    pixels: Array
    runs: NDArray[np.int64]

    def pose(self, frame: str) -> Array:
        """Return the pose (B, 4, 4) of a frame in the world."""
        return homogeneous_matrix(self.scene.tree.frame(self._bodies, frame, self.runs))

    def position(self, frame: str) -> Array:
        """Return the position (B, 3) of the origin of a frame in the world."""
        return view_for_user(self.scene.tree.frame(self._bodies, frame, self.runs)[:, 3])

    @cached_property
    def _bodies(self) -> Bodies:
        return self.scene.tree.bodies(np.ascontiguousarray(self.q.T), self.runs)


@runtime_checkable
class Ending(Protocol):
    """Interface of an ending: a condition that ends runs.

    Any object with the method `holds` is an ending. A class registered with `register("ending",
    "my_ending")` can be used in scenario files. An optional method `check(scene)` raises an
    InputError before the simulation if the ending does not fit the scene.

    See Also
    --------
    Region, TooClose : Endings of RobSim.

    Examples
    --------
    >>> isinstance(TooClose("left.tool", "right.tool", 0.1), Ending)
    True
    """

    def holds(self, now: ControlInstant) -> NDArray[np.bool_]:
        """Return a mask (B,) of the runs that end now."""


ENDINGS = family("ending")
ENDING = KindOf(ENDINGS, short=False, protocol=Ending)
ENDING_LIST = ListOf(ENDING, most=64, alone=True)


@register("ending", "region")
@dataclass(frozen=True)
class Region(FrameBox):
    """End runs by the position of a frame, inside or outside a box of the world.

    A run ends when the origin of the frame is inside the box; with `leaves`, when it is outside.

    >>> Region("arm.tool", low=(-1, -1, 0), high=(1, 1, 2), leaves=True).frame
    'arm.tool'
    """

    leaves: Annotated[bool, Flag(), "Whether a run ends outside the box, not inside."] = False

    def check(self, scene: Scene) -> None:
        """Raise FrameError unless the scene has the frame."""
        scene.tree.find(self.frame)

    def holds(self, now: ControlInstant) -> NDArray[np.bool_]:
        """Return a mask (B,) of the runs that end now."""
        at = now.position(self.frame)
        within = ((at >= self.low) & (at <= self.high)).all(axis=1)
        return np.asarray(within != self.leaves)


@register("ending", "too_close")
@dataclass(frozen=True)
class TooClose(DeclaredValue):
    """End runs by the distance between the origins of two frames.

    A run ends when the distance is below a bound.

    >>> TooClose("left.tool", "right.tool", 0.1).distance
    0.1
    """

    one: Annotated[str, FrameReference, "First frame."]
    other: Annotated[str, FrameReference, "Second frame."]
    distance: Annotated[float, Length(above=0), "Least allowed distance of the origins."]

    def check(self, scene: Scene) -> None:
        """Raise FrameError unless the scene has both frames."""
        for frame in (self.one, self.other):
            scene.tree.find(frame)

    def holds(self, now: ControlInstant) -> NDArray[np.bool_]:
        """Return a mask (B,) of the runs that end now."""
        apart = euclidean_length((now.position(self.one) - now.position(self.other)).T)
        return np.asarray(apart < self.distance)


def check_endings(endings: Sequence[Ending], scene: Scene) -> None:
    """Raise InputError unless every ending fits the scene."""
    for ending in endings:
        check = getattr(ending, "check", None)
        try:
            if check is not None:
                check(scene)
        except FrameError as error:
            raise InputError(f"endings: {type(ending).__name__}: {error}") from None


def find_first_ending(endings: Sequence[Ending], now: ControlInstant) -> NDArray[np.int64]:
    """Return the index (B,) of the first ending that holds, or -1."""
    first = np.full(len(now.q), -1)
    for i, ending in enumerate(endings):
        holds = _evaluate_ending(ending, now)
        first[holds & (first < 0)] = i
    return first


def _evaluate_ending(ending: Ending, now: ControlInstant) -> NDArray[np.bool_]:
    """Return the mask (B,) of an ending, which may be a user's object."""
    value = ending.holds(now)
    try:
        holds: NDArray[Any] = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        holds = np.empty(())
    if holds.shape != (len(now.q),) or holds.dtype != np.bool_:
        raise InputError(
            f"{type(ending).__name__}.holds: expected truth values of shape ({len(now.q)},), "
            f"got {format_value(value)}"
        )
    return holds
