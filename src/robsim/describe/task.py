"""Tasks as tables."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from robsim.base.errors import InputError
from robsim.describe import follow, option
from robsim.describe.feature import camera, features
from robsim.describe.option import Units
from robsim.describe.scene import scene
from robsim.describe.values import NoDescription, Table, builtin, length, quantity
from robsim.servo import (
    FOLLOWERS,
    IBVS,
    PBVS,
    SCHEMES,
    SEVERAL,
    Docking,
    ErrorBelow,
    FollowJoints,
    FollowPath,
    Hybrid,
    NearBorder,
    Parallel,
    Partitioned,
    Placing,
    Priorities,
    ServoTask,
    Switch,
    Task,
)
from robsim.world.scene import Scene

TASKS: dict[str, type[Any]] = {
    **SCHEMES,
    Placing.kind: Placing,
    Docking.kind: Docking,
    **FOLLOWERS,
    **SEVERAL,
}
CONDITIONS: dict[str, type[Any]] = {"error_below": ErrorBelow, "near_border": NearBorder}


def task(value: Task, truth: Scene) -> Table:
    """A task of built-in parts; NoDescription if one of them is somebody's code."""
    return _task(value, truth, belief_of(value) is None)


def belief_of(value: Any) -> Scene | None:
    """What all servo tasks within a task believe; None if nothing, or not the same."""
    beliefs = _beliefs(value)
    agreed = all(_same(each, beliefs[0]) for each in beliefs)
    return beliefs[0] if beliefs and agreed else None


def _same(a: Scene | None, b: Scene | None) -> bool:
    """To the last bit: -0.0 is not 0.0."""
    if a is None or b is None or a is b:
        return a is b
    return a == b and repr(scene(a)) == repr(scene(b))


def _beliefs(value: Any) -> list[Scene | None]:
    """Those of the servo tasks within a task."""
    if isinstance(value, Switch):
        return [*_beliefs(value.first), *_beliefs(value.second)]
    if isinstance(value, Priorities | Parallel):
        return [belief for each in value.tasks for belief in _beliefs(each)]
    return [value.belief] if isinstance(value, ServoTask) else []


def _task(value: Any, truth: Scene, apart: bool) -> Table:
    """With its own belief if `apart`."""
    table: Table = {"kind": builtin(TASKS, value)}
    if isinstance(value, Parallel):
        return {**table, "tasks": [_task(each, truth, apart) for each in value.tasks]}
    if isinstance(value, FollowJoints):
        return {**table, **follow.joints(value, truth)}
    if isinstance(value, Switch):
        first, second = (_task(v, truth, apart) for v in (value.first, value.second))
        when = _condition(value.when)
        return {**table, "first": first, "second": second, "when": when, "latch": value.latch}
    units: Units = partial(_units, value, truth)
    if isinstance(value, FollowPath):
        return {**table, **follow.path(value, units)}
    if isinstance(value, Priorities):
        tasks = [_task(each, truth, apart) for each in value.tasks]
        shaping = option.shaping(value, units)
        return {**table, "rcond": float(value.rcond), **shaping, "tasks": tasks}
    return {**table, **_own(value), **_servo(value, truth, units, apart)}


def _units(value: Task, truth: Scene) -> list[str]:
    """Of what a task commands."""
    try:
        return [truth.velocity_units[i] for i in value.columns(truth)]
    except InputError as error:
        raise NoDescription(str(error)) from None


def _servo(value: ServoTask, truth: Scene, units: Units, apart: bool) -> Table:
    """The keys that all servo tasks have."""
    table: Table = {}
    if value.camera is not None:
        table["camera"] = camera(value.camera)
    if value.target is not None:
        table["target"] = value.target
    table |= option.interaction(value.interaction)
    scale = value.depth_scale
    table |= {"depth": option.depth(value.depth)}
    table["depth_scale"] = list(scale) if isinstance(scale, tuple) else scale
    table |= option.inverse(value.inverse)
    if value.tolerance is not None:
        table["tolerance"] = value.tolerance
    table |= option.feed_forward(value.feed_forward) | option.shaping(value, units)
    table["goal"] = option.goal(value.goal, truth)
    if apart and value.belief is not None:
        table["belief"] = {"complete": True, **scene(value.belief)}
    return table


def _own(value: Any) -> Table:
    """The keys of one kind of servo task."""
    return _OWN[type(value)](value)


def _ibvs(value: IBVS) -> Table:
    return {"features": features(value.features), **_chosen(value)}


def _pbvs(value: PBVS) -> Table:
    return {"form": value.form, **_chosen(value)}


def _hybrid(value: Hybrid) -> Table:
    return {"mark": int(value.mark), **_chosen(value)}


def _chosen(value: ServoTask) -> Table:
    return {**option.law(value.law), "gain": option.gain(value.gain)}


def _partitioned(value: Partitioned) -> Table:
    return {
        "gain": option.gain(value.gain),
        "segment": list(value.segment),
        "roll": value.roll,
        "advance": quantity(value.advance, "m/s"),
        "length": length(value.length),
    }


def _placing(value: Placing) -> Table:
    return {
        "variant": value.variant,
        "marks": list(value.marks),
        "rotation": value.rotation,
        "translation": value.translation,
        "length": length(value.length),
    }


def _docking(value: Docking) -> Table:
    return {"gain": option.gain(value.gain), "turn": value.turn, "h": value.h}


_OWN: dict[type[Any], Callable[[Any], Table]] = {
    IBVS: _ibvs,
    PBVS: _pbvs,
    Hybrid: _hybrid,
    Partitioned: _partitioned,
    Placing: _placing,
    Docking: _docking,
}


def _condition(value: Any) -> Table:
    kind = builtin(CONDITIONS, value)
    if isinstance(value, NearBorder):
        return {"kind": kind, "margin": value.margin, "size": list(value.size)}
    return {"kind": kind, "value": value.value, "of": value.of}
