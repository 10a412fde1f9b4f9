"""The response of joints to commands, and the resolution of their encoders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array, is_any_nonzero
from robsim.base.errors import InputError, prefix_errors
from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.declare import DeclaredValue, Time, Vector, described
from robsim.world.drives.joint_drive import DRIVE, JointDrive, OwnDrive
from robsim.world.imperfections.encoder import Encoder, EncoderSteps
from robsim.world.imperfections.imperfection import ActiveImperfection, list_active_imperfections
from robsim.world.imperfections.joint_effect import (
    FIRST_JOINT_STREAM,
    JointEffect,
    JointEffectList,
    JointEffectStage,
    JointResponse,
    OwnJointEffect,
)
from robsim.world.imperfections.lag import Lag, LagTime
from robsim.world.imperfections.rate_limits import (
    AccelerationBound,
    AccelerationLimit,
    PerJointLimit,
    VelocityBound,
    VelocityLimit,
)
from robsim.world.payload import PAYLOADS, Payload

EARTH_GRAVITY = (0.0, 0.0, -9.81)  # m/s^2


@described
@dataclass(frozen=True)
class Actuation(DeclaredValue):
    """The response of joints to their commands, and the resolution of their encoders.

    The velocity v of a joint follows its command with a first-order lag, v' = (command - v)/lag,
    within limits of |v| and |v'|. Encoders round the measured coordinates to whole steps. Every
    effect is off by default. A limit is one number for all velocities of the scene, or one number
    for each velocity. An encoder step is one number for all coordinates of the scene, or one number
    for each coordinate; coordinates of joints with several coordinates are not rounded.

    With a `drive` the joints move by torques: the inertias of the links, the weight and the
    friction of the joints resist, and a period has sub-steps of the length `step`.

    Lag and limits apply to commanded velocities only, and every joint starts at rest. Floating
    joints, planar joints and unicycles move with their mean velocity over each period; all other
    joints are integrated exactly.

    Examples
    --------
    >>> Actuation(lag=0.1, velocity=[0.5, 1.0]).response(2).velocity
    array([0.5, 1. ])
    """

    without_controls: ClassVar[tuple[str, ...]] = ("step",)  # few lengths divide a period

    lag: LagTime = 0.0
    velocity: VelocityBound = None
    acceleration: AccelerationBound = None
    encoder: EncoderSteps = 0.0
    effects: JointEffectList = ()
    drive: Annotated[
        JointDrive | OwnDrive | None,
        DRIVE,
        "Drive that computes torques; None: the joints follow their commands without dynamics.",
    ] = None
    step: Annotated[
        float | None,
        Time(above=0),
        "Length of a sub-step of the dynamics, which divides the period. None: the longest step of "
        "at most 1 ms.",
    ] = None
    payloads: Annotated[
        tuple[Payload, ...], PAYLOADS, "Loads on frames of the robots, for a drive."
    ] = ()
    gravity: Annotated[
        Sequence[float] | Array,
        Vector("acceleration"),
        "Acceleration of gravity in the axes of the world, in m/s^2, for a drive.",
    ] = EARTH_GRAVITY

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            lag: float = 0.0,
            velocity: PerJointLimit | None = None,
            acceleration: PerJointLimit | None = None,
            encoder: PerJointLimit = 0.0,
            effects: JointEffect | OwnJointEffect | Sequence[JointEffect | OwnJointEffect] = (),
            drive: JointDrive | OwnDrive | None = None,
            step: float | None = None,
            payloads: Payload | Sequence[Payload] = (),
            gravity: Sequence[float] | Array = EARTH_GRAVITY,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        warn_of_milliseconds(self.lag, "Actuation.lag")
        if self.step is not None:
            warn_of_milliseconds(self.step, "Actuation.step")
        self._check_drive()

    def _check_drive(self) -> None:
        """Raise InputError for numbers that a drive replaces."""
        if self.drive is None:
            return
        idle = [each for each in ("velocity", "acceleration") if getattr(self, each) is not None]
        idle += ["lag"] * is_any_nonzero(self.lag)
        if idle:
            raise InputError(
                f"a drive and {' and '.join(idle)}; give a drive alone, whose torques "
                "determine the response of the joints"
            )

    def _check_idle_numbers(self) -> None:
        """Raise InputError for numbers that act with a drive alone."""
        if self.drive is not None:
            return
        idle = ["payloads"] * bool(self.payloads) + ["step"] * (self.step is not None)
        idle += ["gravity"] * (not np.array_equal(self.gravity, EARTH_GRAVITY))
        if idle:
            raise InputError(
                f"{' and '.join(idle)}: given without a drive, so that the joints have no "
                "dynamics; give a drive"
            )

    def after(self, seconds: float) -> Actuation:
        """Return the actuation some seconds later: loads have other times, or are released."""
        if not self.payloads:
            return self
        later = (load.after(seconds) for load in self.payloads)
        return replace(self, payloads=tuple(load for load in later if load is not None))

    def list_active(self) -> list[ActiveImperfection[JointEffect]]:
        """Return the imperfections that are switched on, in the order of the fields."""
        return self._acting

    @cached_property
    def _acting(self) -> list[ActiveImperfection[JointEffect]]:
        return list_active_imperfections(self, ACTUATION_PARTS, JointEffect, FIRST_JOINT_STREAM)

    @property
    def moves(self) -> bool:
        """Whether lag, limits or effects change the commanded velocities."""
        return any(each.effect.place < JointEffectStage.MEASURED for each in self.list_active())

    def response(self, count: int) -> JointResponse:
        """Return the response of the joints to commands, for a scene with `count` velocities."""
        if count in self._responses:
            return self._responses[count]
        each = (each.effect.response(count) for each in self.list_active())
        response = reduce(JointResponse.and_also, each, JointResponse.of(count))
        if self.holds_still:  # a user's effect may change its response
            self._responses[count] = response
        return response

    @cached_property
    def _responses(self) -> dict[int, JointResponse]:
        return {}

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """Raise InputError if an imperfection does not fit the joints, given by their names."""
        with prefix_errors("actuation"):
            for each in self.list_active():
                each.effect.check(velocities, coordinates)
            self._check_idle_numbers()
            self.response(len(velocities))


ACTUATION_PARTS = (Lag, VelocityLimit, AccelerationLimit, Encoder, "effects")
