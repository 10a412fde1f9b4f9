"""The values that an experiment has now, by their dotted names."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said
from robsim.declare.amounts import parsed
from robsim.declare.lookup import NAMED
from robsim.declare.spec import Raw
from robsim.files.toml import parse
from robsim.geometry.pose import Pose
from robsim.geometry.rotation import rpy_of
from robsim.run.text import common_belief
from robsim.run.varied import LENS, POSE
from robsim.run.written import Written
from robsim.vision.camera import Camera


def raw_at(tables: Any, name: str) -> Raw:
    """Return what tables hold at a dotted name; KeyError if they say nothing there."""
    keys = name.split(".")
    while keys:
        key = keys.pop(0)
        if isinstance(tables, list) and key.isdecimal() and int(key) < len(tables):
            tables = tables[int(key)]
        elif isinstance(tables, dict) and key in tables:
            tables = tables[key]
            if key in NAMED and keys and isinstance(tables, list):
                own, wanted = NAMED[key], keys.pop(0)
                found = [t for t in tables if t.get(own, t.get("model")) == wanted]
                if not found:
                    raise KeyError(name)
                tables = found[0]
        else:
            raise KeyError(name)
    return tables


def number_at(experiment: Written, name: str) -> Array:
    """Return the numbers in SI that an experiment has at a dotted name.

    InputError: they are not known, or no numbers.
    """
    value = _of_scene(experiment, name.split("."))
    if value is None:
        controls = {each.path: each.value for each in experiment.controls()}
        value = controls.get(name)
    if value is None:
        value = _said(experiment, name)
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.array(np.nan)
    if not np.isfinite(found).all():
        raise InputError(f"{name}: the experiment has no number there, but {said(value)}")
    return found


def _of_scene(experiment: Written, path: list[str]) -> Any:
    """Return the intrinsics of a camera, or part of a pose; None of anything else."""
    scene = experiment.scene
    if path[0] == "belief":
        belief = common_belief(experiment.task)
        scene, path = belief or scene, path[1:]
    match path:
        case ["cameras", who, key]:
            eye = scene.camera(who)
            return _of_lens(eye.camera, key) if key in LENS else _of_pose(eye.pose, key)
        case ["objects", who, key]:
            thing = scene.object(who)
            return thing.marks if key == "marks" else _of_pose(thing.pose, key)
        case ["robots", who, key]:
            return _of_pose(scene.robot(who).base, key)
        case ["robots", who, "links", link, "place" | "tail" as part, key]:
            links = {each.name: each for each in scene.robot(who).links}
            return _of_pose(getattr(links[link].joint, part), key) if link in links else None
    return None


def _of_lens(lens: Camera, key: str) -> Any:
    K = lens.K
    focal = K[0, 0] if K[0, 0] == K[1, 1] else np.array([K[0, 0], K[1, 1]])
    found = {"K": K, "focal": focal, "center": K[:2, 2], "skew": K[0, 1]}
    return found.get(key, np.array(lens.distortion))


def _of_pose(pose: Pose, key: str) -> Any:
    if key == "rpy":
        return rpy_of(pose.rotation)
    return getattr(pose, key) if key in POSE else None


def _said(experiment: Written, name: str) -> Any:
    """Return what the exact text says at a name, in SI; None if it says nothing."""
    try:
        raw = raw_at(parse(experiment.to_toml(complete=True), "text"), name)
        return parsed(raw) if isinstance(raw, str) else raw
    except (KeyError, InputError):
        return None
