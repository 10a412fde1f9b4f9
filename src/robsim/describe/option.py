"""What servo tasks are told, as the keys of their tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robsim.describe.values import (
    NoDescription,
    Table,
    builtin,
    coordinates,
    length,
    ours,
    pose,
    quantity,
)
from robsim.servo import (
    AdaptiveGain,
    AvoidLimits,
    Broyden,
    DampedInverse,
    DepthFilter,
    EstimatedMotion,
    GoalFeatures,
    GoalPose,
    LargeProjection,
    Posture,
    PseudoInverse,
    SpeedLimit,
    TaughtGoal,
)
from robsim.servo.laws.feed_forward import KnownMotion
from robsim.servo.laws.inverse import INVERSES
from robsim.servo.laws.law import LAWS
from robsim.servo.shaping.shaped import Shaped
from robsim.world.scene import Scene

Units = Callable[[], list[str]]  # of what is commanded; asked only if something depends on it
SECONDARY: dict[str, type[Any]] = {"avoid_limits": AvoidLimits, "posture": Posture}


def law(value: Any) -> Table:
    """law, length."""
    name = builtin(LAWS, value)
    return {"law": name, **({"length": length(value.length)} if name == "camera" else {})}


def inverse(value: Any) -> Table:
    """inverse, rcond, damping."""
    table: Table = {"inverse": builtin(INVERSES, value)}
    if isinstance(value, PseudoInverse):
        table["rcond"] = float(value.rcond)
    if isinstance(value, DampedInverse):
        table["damping"] = float(value.damping)
    return table


def interaction(value: Any) -> Table:
    """interaction, broyden_start."""
    if not isinstance(ours(value, Broyden, np.ndarray), Broyden):
        return {"interaction": value if isinstance(value, str) else value.tolist()}
    start = {} if value.start is None else {"broyden_start": value.start.tolist()}
    return {"interaction": "broyden", **start}


def depth(value: Any) -> str | Table:
    """A choice, a length, or a filter."""
    if isinstance(ours(value, DepthFilter, float), DepthFilter):
        numbers = {"start_sigma": value.start_sigma, "noise": value.noise}
        return {"start": length(value.start), **numbers}
    return value if isinstance(value, str) else length(value)


def gain(value: float | AdaptiveGain) -> float | Table:
    """A number, or how it depends on the error."""
    ours(value, AdaptiveGain, float)
    if isinstance(value, AdaptiveGain):
        return {key: getattr(value, key) for key in ("at_zero", "at_infinity", "slope")}
    return value


def feed_forward(value: Any) -> Table:
    """feed_forward, lag."""
    if isinstance(ours(value, EstimatedMotion, KnownMotion, type(None)), EstimatedMotion):
        return {"feed_forward": "estimated", "lag": quantity(value.lag, "s")}
    return {"feed_forward": "known"} if isinstance(value, KnownMotion) else {}


def goal(value: Any, truth: Scene) -> Table:
    """Where it is shown, in full; nothing for home."""
    if isinstance(ours(value, GoalPose, GoalFeatures, TaughtGoal), GoalPose):
        return {"computed": {"position": length(*value.T_c_o.position), **pose(value.T_c_o)}}
    if isinstance(value, GoalFeatures):
        return {"s": value.s.tolist()}
    if value.q is None:
        return {}
    return {"q": coordinates(truth.coordinates(value.q), truth.coordinate_units)}


def shaping(value: Shaped, units: Units) -> Table:
    """joints, secondary, projection, smooth_start, limit, for velocities of these units."""
    table: Table = {}
    if value.joints is not None:
        table["joints"] = list(value.joints)
    if value.secondary is not None:
        table["secondary"] = _secondary(value.secondary, units)
    table["projection"] = _projection(value.projection)
    if value.smooth_start is not None:
        table["smooth_start"] = value.smooth_start
    if value.limit is not None:
        table["limit"] = _limit(value.limit, units)
    return table


def _secondary(value: Any, units: Units) -> Table:
    kind = builtin(SECONDARY, value)
    if isinstance(value, AvoidLimits):
        return {"kind": kind, "gain": value.gain, "margin": value.margin}
    q = _each(value.q, [unit.removesuffix("/s") for unit in units()])
    return {"kind": kind, "q": q, "gain": value.gain}


def _limit(value: SpeedLimit, units: Units) -> Table:
    table: Table = {}
    if isinstance(ours(value, SpeedLimit).joint, tuple):
        table["joint"] = _each(value.joint, units())
    elif value.joint is not None:
        one: Any = value.joint
        table["joint"] = quantity(one, "rad/s")  # or m/s: it is for all
    if value.linear is not None:
        table["linear"] = quantity(value.linear, "m/s")
    if value.angular is not None:
        table["angular"] = quantity(value.angular, "rad/s")
    return table


def _each(numbers: Any, units: list[str]) -> list[str]:
    if len(numbers) != len(units):
        raise NoDescription(f"{len(numbers)} numbers for {len(units)} commanded velocities")
    return coordinates(numbers, units)


def _projection(value: str | LargeProjection) -> str | Table:
    if isinstance(value, str):
        return value
    return {"low": float(ours(value, LargeProjection).low), "high": float(value.high)}
