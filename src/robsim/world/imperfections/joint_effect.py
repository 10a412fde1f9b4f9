"""Kinds of imperfections of the joints, and what each of them declares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np

from robsim.base.arrays import Array, is_any
from robsim.base.errors import InputError
from robsim.declare import Choice, family
from robsim.world.imperfections.drive import Drive
from robsim.world.imperfections.image_effect import FIRST_STREAM
from robsim.world.imperfections.imperfection import Imperfection, RunFacts, Statement
from robsim.world.imperfections.joint_rows import JointRows
from robsim.world.scene import Scene

JOINT_EFFECTS = family("joint effect")
AFTER_IMAGES = FIRST_STREAM + 1024  # streams of random numbers; those below are of images


class JointPlace(IntEnum):
    """The place of an effect between a command and what is measured of the motion."""

    COMMANDED = 0  # the velocities that joints are to follow
    FOLLOWED = 1  # how they follow: a `response`, but no stages
    MEASURED = 2  # the coordinates that the controller gets


class Response(NamedTuple):
    """How joints follow a command: v' = (command - v) / lag, with |v| and |v'| limited.

    `velocity` and `acceleration` are the limits, of all velocities of a scene or of each.
    """

    lag: Any = 0.0
    velocity: Any = np.inf
    acceleration: Any = np.inf

    def and_also(self, other: Response) -> Response:
        """Return the response under two effects: the lower limits, and one lag at most."""
        if is_any(self.lag) and is_any(other.lag):
            raise InputError("two lags of the joints; give one")
        limits = (np.minimum(a, b) for a, b in zip(self[1:], other[1:], strict=True))
        return Response(self.lag if is_any(self.lag) else other.lag, *limits)


class JointEffect(Imperfection):
    """A kind of imperfection of the joints, with all that is known of it.

    A kind is a frozen dataclass of declared fields, registered as a "joint effect". It adds
    compiled stages (`add_stages`), or it is called in Python in every period (`driven`), or it is
    part of how joints follow (`response`).

    place  where it acts between a command and what is measured
    """

    place: ClassVar[JointPlace] = JointPlace.COMMANDED
    title: ClassVar[str] = "effects on the joints"

    def driven(self, wanted: Array, drive: Drive) -> Array:
        """Return velocities (B, n) for the period that begins, from those that are wanted."""
        raise NotImplementedError(f"{self.label} needs `driven` or `add_stages`")

    def add_stages(self, joints: JointRows) -> None:
        """Add the stages of the effect to a program; by default `driven` is called."""
        joints.call(self.driven, self.label)

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        """Raise InputError if the effect does not fit the joints of a scene, by their names."""

    def response(self, count: int) -> Response:
        """Return its part in how the joints of a scene follow, of so many velocities."""
        return Response()

    def deviation(self, scene: Scene) -> Array:
        """Return the standard deviation of each measured coordinate (nq,)."""
        return np.zeros(scene.nq)

    def stated(self, facts: RunFacts) -> Statement:
        return facts.lasting(f"What is commanded is changed by {self.label}")


@runtime_checkable
class OwnJointEffect(Protocol):
    """What anything must have to be an effect on joints: a user's class needs no base class.

    Registered with `register("joint effect", "my_effect")`, it has a place in scenario files.
    """

    def driven(self, wanted: Array, drive: Drive) -> Array:
        """Return velocities (B, n) for the period that begins, from those that are wanted."""


EFFECT = Choice(JOINT_EFFECTS, protocol=OwnJointEffect)


@dataclass(frozen=True, eq=False)
class CalledJointEffect(JointEffect):
    """A joint effect that is a user's own object without our base class."""

    own: Any

    @property
    def label(self) -> str:
        return type(self.own).__name__

    def driven(self, wanted: Array, drive: Drive) -> Array:
        found: Array = self.own.driven(wanted, drive)
        return found


def joint_effect(given: Any) -> JointEffect:
    """Return an effect with our base class, also where it is a user's own object."""
    return given if isinstance(given, JointEffect) else CalledJointEffect(given)
