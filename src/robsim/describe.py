"""Values as the tables of a scenario file, exactly: what `robsim.scenario` reads back.

Lengths are written in metres and angles in radians, with all digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from robsim.camera import Camera
from robsim.features import FEATURES
from robsim.pose import Pose
from robsim.primitives import Block, CameraBody, Primitive, Wheel
from robsim.robot import Link, Robot
from robsim.scene import Mounted, Object, Scene
from robsim.servo import IBVS, Computed, Damped, Shown, Truncated
from robsim.servo.law import LAWS
from robsim.tree import COORDINATE_UNITS

Table = dict[str, Any]
SHAPES: dict[str, type[Primitive]] = {"block": Block, "wheel": Wheel, "camera": CameraBody}


class NoDescription(Exception):
    """This task is made of somebody's Python code, which a file cannot hold."""


def length(*metres: float) -> str:
    """'0.1, 0.2 m'."""
    return ", ".join(repr(float(x)) for x in metres) + " m"


def pose(value: Pose) -> Table:
    """position and rotation; nothing for what is the identity."""
    table: Table = {}
    if not _same(value.position, np.zeros(3)):
        table["position"] = length(*value.position)
    if not _same(value.rotation, np.eye(3)):
        table["rotation"] = value.rotation.tolist()
    return table


def _same(a: Any, b: Any) -> bool:
    """Bit for bit: -0.0 is not 0.0."""
    return bool(np.asarray(a).tobytes() == np.asarray(b).tobytes())


def shape(value: Primitive) -> Table:
    """One primitive; NoDescription if it is somebody's own kind."""
    kind = _builtin(SHAPES, value)
    if not isinstance(value.color, str):
        raise NoDescription(f"the color {value.color!r:.40} is not a text")
    sizes = {k: length(v) for k, v in vars(value).items() if isinstance(v, float)}
    extra = {"n": int(value.n)} if isinstance(value, Wheel) else {}
    return {"kind": kind, **sizes, **extra, "color": value.color, **pose(value.pose)}


def link(value: Link) -> Table:
    """One link on its joint."""
    joint = value.joint
    table: Table = {"name": value.name, "parent": value.parent, "joint": joint.kind}
    table |= {"place": pose(joint.place), "tail": pose(joint.tail)}
    if joint.limits:
        table["limits"] = coordinates(joint.limits, 2 * COORDINATE_UNITS[joint.kind])
    table["shapes"] = [shape(s) for s in value.shapes]
    return {k: v for k, v in table.items() if v not in (None, {}, [])}


def coordinates(q: Any, units: Iterable[str]) -> list[str]:
    """A configuration, each number with its unit."""
    return [
        f"{float(x)!r} {u}" if u != "1" else repr(float(x)) for x, u in zip(q, units, strict=True)
    ]


def robot(value: Robot) -> Table:
    """A robot link by link."""
    return {
        "name": value.name,
        "on": value.on,
        **pose(value.base),
        "home": coordinates(value.home, value.coordinate_units),
        "links": [link(k) for k in value.links],
    }


def thing(value: Object) -> Table:
    """An object; marks always in full."""
    return {
        "name": value.name,
        "on": value.on,
        **pose(value.pose),
        "shapes": [shape(s) for s in value.shapes],
        "marks": [length(*mark) for mark in value.marks],
    }


def camera(value: Mounted) -> Table:
    """A camera and where it is mounted."""
    lens: Camera = value.camera
    table: Table = {"name": value.name, "on": value.on, **pose(value.pose), "K": lens.K.tolist()}
    if lens.size:
        table["size"] = list(lens.size)
    if lens.distortion:
        table["distortion"] = list(lens.distortion)
    if lens.body:
        table["body"] = {k: v for k, v in shape(lens.body).items() if k != "kind"}
    return table


def scene(value: Scene) -> Table:
    """robots, objects, cameras, display."""
    table: Table = {
        "robots": [robot(r) for r in value.robots],
        "objects": [thing(o) for o in value.objects],
        "cameras": [camera(c) for c in value.cameras],
        "display": pose(value.display),
    }
    return {k: v for k, v in table.items() if v}


def task(value: IBVS, truth: Scene) -> Table:
    """A task of built-in parts; NoDescription if one of them is somebody's code."""
    table: Table = {
        "kind": "ibvs",
        "camera": truth.camera(value.camera).name,
        "target": truth.object(value.target).name,
        "features": _builtin(FEATURES, value.features),
        "interaction": value.interaction,
        "depth": value.depth if isinstance(value.depth, str) else length(value.depth),
        "depth_scale": value.depth_scale,
        "gain": value.gain,
        "tolerance": value.tolerance or value.features.tolerance,
        **_law(value.law),
        **_inverse(value.inverse),
        "goal": _goal(value.goal, truth),
    }
    return table


def run(value: Mapping[str, Any]) -> Table:
    """dt, duration, seed, noise, record."""
    record = value["record"]
    return {
        "dt": f"{float(value['dt'])!r} s",
        "duration": f"{float(value['duration'])!r} s",
        "seed": int(value["seed"]),
        "noise": float(value["noise"]),
        "record": record if isinstance(record, str) else int(record),
    }


def scenario(
    truth: Scene, what: IBVS, settings: Mapping[str, Any], q0: Any, title: str | None = None
) -> str:
    """The whole scenario as TOML; `q0` is one start, or None where the starts are elsewhere."""
    import tomli_w

    units = truth.coordinate_units
    table: Table = {"schema": 1, **({} if title is None else {"title": title})}
    table |= {**scene(truth), "task": task(what, truth)}
    if what.belief is not None:
        table["belief"] = {"complete": True, **scene(what.belief)}
    if q0 is not None:
        table["start"] = {"q": coordinates(q0, units)}
    return tomli_w.dumps({**table, "run": run(settings)})


def _builtin(known: Mapping[str, type[Any]], value: Any) -> str:
    for name, kind in known.items():
        if type(value) is kind:
            return name
    raise NoDescription(f"{type(value).__name__} is Python code")


def _law(value: Any) -> Table:
    name = _builtin(LAWS, value)
    return {"law": name, **({"length": length(value.length)} if name == "camera" else {})}


def _inverse(value: Truncated | Damped) -> Table:
    if isinstance(value, Damped):
        return {"inverse": value.name, "damping": float(value.damping)}
    return {"inverse": value.name, "rcond": float(value.rcond)}


def _goal(value: Shown | Computed, truth: Scene) -> Table:
    if isinstance(value, Computed):
        return {"computed": {"position": length(*value.T_c_o.position), **pose(value.T_c_o)}}
    q = truth.coordinates(truth.home if value.q is None else value.q)
    return {"q": coordinates(q, truth.coordinate_units)}
