"""Feed-forward of the target motion in the image, known or estimated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.declare import DeclaredValue, KindOf, PerRun, Time, family, register

FEED_FORWARDS = family("feed-forward")


@register("feed-forward", "known")
@dataclass(frozen=True)
class KnownMotion:
    """Feed-forward of the known motion of the target, de/dt = L J_p qdot_p.

    J_p and qdot_p belong to the prescribed joints of the believed scene, which the task does not
    command. The law then acts on e + (de/dt)/gain and cancels the motion of the target, so a
    moving target is tracked without a lag. A wrong belief leaves an error proportional to the
    unmodelled motion, divided by the gain.

    Examples
    --------
    A pan-tilt head follows a moving target:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("pan_tilt_tracking"))
    >>> for feed_forward in None, "known":
    ...     task = replace(scenario.task, feed_forward=feed_forward)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=3, hold=True)
    ...     print(f"{float(run.error_norm[-1]):.3f}")
    0.392
    0.000
    """


@register("feed-forward", "estimated")
@dataclass(frozen=True)
class EstimatedMotion(DeclaredValue):
    """Feed-forward of the estimated motion of the target in the image.

    The motion of the target is the change of e that the command does not explain,

        (e_k - e_(k-1))/dt - L J qdot_(k-1).

    A first-order low-pass filter with time constant `lag` smooths it to the estimate de/dt. The
    law acts on e + (de/dt)/gain, as with `KnownMotion` (Chaumette and Hutchinson 2007,
    section on target tracking; Corke and Good 1996). The estimate needs no model of the target, and
    removes the lag behind a target of constant velocity. A larger `lag` rejects more noise and
    reacts later; a small `lag` with delayed images may destabilise the loop.

    Raises
    ------
    InputError
        If the task has `Broyden`, a weighting or the transpose.

    Examples
    --------
    A pan-tilt head follows a moving target:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("pan_tilt_tracking"))
    >>> for feed_forward in None, EstimatedMotion(lag=0.1):
    ...     task = replace(scenario.task, feed_forward=feed_forward)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=3, hold=True)
    ...     print(f"{float(run.error_norm[-1]):.3f}")
    0.392
    0.000
    """

    lag: Annotated[
        float,
        Time(above=0),
        PerRun(()),
        "Time constant of the low-pass filter of the estimate, in seconds.",
    ] = 0.2


FeedForward = KnownMotion | EstimatedMotion | str  # a feed-forward, or its name
FEED_FORWARD = KindOf(FEED_FORWARDS, none="none", beside_of={"lag": ("estimated", "lag")})
