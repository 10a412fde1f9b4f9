"""Endings: conditions of an experiment on which its runs end, beside those that always end one."""

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
    """What an ending sees of B runs at a control instant, after the command, with the run first.

    time     seconds since the start
    scene    the true scene, for its names; where numbers differ from run to run, of any run
    q, qd    coordinates (B, nq), and velocities (B, nv) commanded or prescribed
    error    of the features (B, k)
    pixels   true image (B, N, 2) of all marks
    """

    time: float
    scene: Scene
    q: Array
    qd: Array
    error: Array
    pixels: Array
    runs: NDArray[np.int64]  # (B,) numbers of the runs in their batch, from 0 on

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
    """The interface of an ending: any object with this method.

    Registered with `register("ending", "my_ending")`, it has a place in scenario files. It may also
    have `check(scene)`, which raises an InputError before anything runs.
    """

    def holds(self, now: ControlInstant) -> NDArray[np.bool_]:
        """Return truth values (B,): which runs end now."""


ENDINGS = family("ending")
ENDING = KindOf(ENDINGS, short=False, protocol=Ending)
ENDING_LIST = ListOf(ENDING, most=64, alone=True)


@register("ending", "region")
@dataclass(frozen=True)
class Region(FrameBox):
    """The ending that the origin of a frame is in a box of the world, or with `leaves` out of it.

    >>> Region("arm.tool", low=(-1, -1, 0), high=(1, 1, 2), leaves=True).frame
    'arm.tool'
    """

    leaves: Annotated[bool, Flag(), "Whether the run ends outside the box, not within it."] = False

    def holds(self, now: ControlInstant) -> NDArray[np.bool_]:
        """Return truth values (B,): which runs end now."""
        at = now.position(self.frame)
        within = ((at >= self.low) & (at <= self.high)).all(axis=1)
        return np.asarray(within != self.leaves)


@register("ending", "too_close")
@dataclass(frozen=True)
class TooClose(DeclaredValue):
    """The ending that the origins of two frames are nearer to each other than a distance.

    >>> TooClose("left.tool", "right.tool", 0.1).distance
    0.1
    """

    one: Annotated[str, FrameReference, "Frame whose origin is looked at."]
    other: Annotated[str, FrameReference, "Frame to whose origin the distance is measured."]
    distance: Annotated[float, Length(above=0), "Distance below find_first_ending a run ends."]

    def check(self, scene: Scene) -> None:
        """Raise FrameError unless the scene has both frames."""
        for frame in (self.one, self.other):
            scene.tree.find(frame)

    def holds(self, now: ControlInstant) -> NDArray[np.bool_]:
        """Return truth values (B,): which runs end now."""
        apart = euclidean_length((now.position(self.one) - now.position(self.other)).T)
        return np.asarray(apart < self.distance)


def check_endings(endings: Sequence[Ending], scene: Scene) -> None:
    """Raise InputError unless every ending can be looked at in a scene."""
    for ending in endings:
        check = getattr(ending, "check", None)
        try:
            if check is not None:
                check(scene)
        except FrameError as error:
            raise InputError(f"endings: {type(ending).__name__}: {error}") from None


def find_first_ending(endings: Sequence[Ending], now: ControlInstant) -> NDArray[np.int64]:
    """Return the number (B,) of the first ending that holds, or -1."""
    found = np.full(len(now.q), -1)
    for i, ending in enumerate(endings):
        holds = _evaluate_ending(ending, now)
        found[holds & (found < 0)] = i
    return found


def _evaluate_ending(ending: Ending, now: ControlInstant) -> NDArray[np.bool_]:
    """Return truth values (B,) of an ending, which may be a user's."""
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
