"""Limits that every command of an experiment is kept within, whatever its task wishes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FrameError, InputError, prefix_errors
from robsim.declare import DeclaredValue, Flag, Role, Table, Time, Word, described
from robsim.declare.joint_numbers import (
    OneOrEach,
    broadcast_limits,
    check_joint_count,
    get_coordinate_axes,
    get_velocity_axes,
)
from robsim.declare.scalars import NOT_NEGATIVE
from robsim.world.frame_box import FrameBox
from robsim.world.scene import Scene

LimitValue = float | Sequence[float]  # one number for all, or one for each


@described
@dataclass(frozen=True)
class Fence(FrameBox):
    """A box of the world that the origin of a frame does not leave.

    It is watched half way and at the end of the way on which the joints would brake. From outside,
    motions that lead farther out are not commanded. Joints of a kind of your own are taken to stand
    still.

    >>> Fence("arm.tool", low=(-1, -1, 0), high=(1, 1, 2)).frame
    'arm.tool'
    """


@described
@dataclass(frozen=True)
class Watchdog(DeclaredValue):
    """What is done while no image has come for a time.

    >>> Watchdog(after=0.2).then
    'hold'
    """

    after: Annotated[float, Time(above=0), "Age of the last image beyond which the robot brakes."]
    then: Annotated[
        str,
        Word(("hold", "stop")),
        "Whether the robot goes on when an image comes, or stays until a reset.",
    ] = "hold"


@described
@dataclass(frozen=True)
class Safety(DeclaredValue):
    """Limits of all that is commanded, in the simulation and by `Controller` alike.

    They act in this order. A robot that is held or stopped brakes as fast as `acceleration` lets
    it; `ramp` makes the command grow from nothing at the start and whenever it may go on. `speed`
    slows the whole command and keeps its direction; `acceleration` cuts off the change of each
    velocity. A joint then goes no faster than it can still brake before its limit, less `margin`,
    and the whole motion no faster than the frame of `fence` can before it leaves its box. What was
    safe stays so: the braking that this needs is within `acceleration`. With none a velocity can
    change at once.

    Limits are one number for all velocities or coordinates of the scene, or one for each, of which
    those of other joints are not counted. Joints that lag behind their commands need some margin.

    >>> Safety(speed=0.5, acceleration=[1.0, 2.0]).limits("acceleration", 2)
    array([1., 2.])
    """

    speed: Annotated[
        LimitValue | None,
        OneOrEach(get_velocity_axes, "/s"),
        "Limit of |qdot|, by which the whole command is slowed down; None: none.",
    ] = None
    acceleration: Annotated[
        LimitValue | None,
        OneOrEach(get_velocity_axes, "/s^2"),
        "Limit of the change of each velocity in a second, also when braking; None: none.",
    ] = None
    margin: Annotated[
        LimitValue | None,
        OneOrEach(get_coordinate_axes, item=NOT_NEGATIVE),
        "Distance that joints keep from their limits; None: limits are not watched.",
    ] = None
    fence: Annotated[Fence | None, Table(Fence), "Box that a frame does not leave."] = None
    watchdog: Annotated[
        Watchdog | None, Table(Watchdog), "What is done while no image comes; None: nothing."
    ] = None
    ramp: Annotated[
        float | None, Time(above=0), "Time in which a command grows from nothing to its full size."
    ] = None
    hold_to_run: Annotated[
        bool,
        Flag(),
        Role.ROBOT,
        "Whether `Controller.step` moves the robot only while it is told `run=True`.",
    ] = False

    def check(self, scene: Scene) -> None:
        """Raise InputError unless numbers and frame are those of a scene."""
        for name, owners in (
            ("speed", scene.velocity_names),
            ("acceleration", scene.velocity_names),
            ("margin", scene.coordinate_names),
        ):
            check_joint_count(getattr(self, name), name, owners)
        self.check_margin(scene)
        if self.fence is not None:
            self._check_fence(self.fence, scene)

    def check_margin(self, scene: Scene) -> None:
        """Raise InputError unless margins leave joints some room between their limits."""
        if self.margin is None:
            return
        margins, room = self.limits("margin", scene.nq), np.diff(scene.limits, axis=1)[:, 0]
        tight = np.flatnonzero(2.0 * margins >= room)
        if tight.size:
            i = int(tight[0])
            raise InputError(
                f"margin: {margins[i]:g} leaves no room to {scene.coordinate_names[i]}, whose "
                f"limits are {room[i]:g} ({scene.coordinate_units[i]}) apart"
            )

    def _check_fence(self, fence: Fence, scene: Scene) -> None:
        """Raise InputError unless a frame is there, and moves."""
        with prefix_errors("fence"):
            try:
                moves = scene.tree.carried(fence.frame).any()
                fence.check(scene)
            except FrameError as error:
                raise InputError(str(error)) from None
            if not moves:
                raise InputError(f"no joint moves frame '{fence.frame}'")

    def limits(self, which: str, count: int) -> Array:
        """Return the limits (count,) of speed, acceleration or margin, or infinity."""
        return broadcast_limits(getattr(self, which), count)


SAFETY_TABLE = Table(Safety)
