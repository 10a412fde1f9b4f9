"""The motion of the target in the image that the robot does not cause, known or estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.declare import DeclaredValue, KindOf, PerRun, Time, family, register

FEED_FORWARDS = family("feed-forward")


@register("feed-forward", "known")
@dataclass(frozen=True)
class KnownMotion:
    """Feed-forward of de/dt = L J_p qdot_p, from the motions of the believed scene.

    J_p and qdot_p are of the prescribed joints, which the task does not command.

    >>> KnownMotion()
    KnownMotion()
    """


@register("feed-forward", "estimated")
@dataclass(frozen=True)
class EstimatedMotion(DeclaredValue):
    """Feed-forward of the part of de/dt that the command does not explain, smoothed over `lag`.

    The estimate is a first-order filter of (e_k - e_(k-1))/dt - L J qdot_(k-1) (Chaumette and
    Hutchinson 2007, section on target tracking; Corke and Good 1996).

    >>> EstimatedMotion(lag=0.1).lag
    0.1
    """

    lag: Annotated[
        float, Time(above=0), PerRun(()), "Time constant of the low-pass filter of the estimate."
    ] = 0.2


FeedForward = KnownMotion | EstimatedMotion | None


FEED_FORWARD = KindOf(FEED_FORWARDS, none="none", beside_of={"lag": ("estimated", "lag")})
