"""The text form of poses: a position and at most one of three rotations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from robsim.base.errors import InputError, said, suggest
from robsim.declare import ListOf, Number, Vector
from robsim.declare.fields import same
from robsim.declare.paths import Part
from robsim.declare.problems import Broken, under
from robsim.declare.quantities import Exact
from robsim.declare.spec import MISSING, Context, NoText, Raw, Spec, expected
from robsim.geometry.angles import angles_of
from robsim.geometry.pose import IDENTITY, Pose, one_pose
from robsim.geometry.rotation import rpy_of

ROTATION = ListOf(ListOf(Number(), 3, 3), 3, 3)
KEYS: dict[str, Spec] = {
    "position": Vector("length"),
    "rpy": Vector("angle"),
    "rotvec": Vector("angle"),
    "rotation": ROTATION,
}
MEANINGS = {
    "position": "Where the origin is.",
    "rpy": "Roll, pitch and yaw: R = Rz(yaw) Ry(pitch) Rx(roll).",
    "rotvec": "The axis of the rotation times its angle.",
    "rotation": "The rotation matrix, row by row.",
}


@dataclass(frozen=True)
class PoseTable(Spec):
    """The text form of a pose: a table, or, if `flat`, keys in the table that surrounds it."""

    flat: bool = False
    form: ClassVar[str] = "table"

    def check(self, value: Any, what: str) -> Pose:
        return one_pose(value, what)

    def read(self, raw: Raw, c: Context) -> Pose:
        if not isinstance(raw, Mapping):
            raise expected("a table", raw)
        before = c.problems.seen
        for key in raw.keys() - KEYS.keys():
            c.at(key).report(f"unknown key {said(key)}; {suggest(key[:64], KEYS, 'keys')}")
        values = {key: c.at(key).tried(KEYS[key], raw[key]) for key in KEYS if key in raw}
        if c.problems.seen > before:
            raise Broken
        return pose_from(values)

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        table: dict[str, Raw] = {}
        if value.matrix.ndim > 2:
            raise NoText(f"a text holds one pose, not a batch of shape {value.matrix.shape[:-2]}")
        if value.position.tobytes() != np.zeros(3).tobytes():  # bit for bit: -0.0 is not 0.0
            table["position"] = KEYS["position"].write(value.position, c)
        if value.rotation.tobytes() != np.eye(3).tobytes():
            brief = _brief_rotation(value) if c.facts.get("brief") else None
            table |= brief or {"rotation": value.rotation.tolist()}
        return table

    def put_change(self, table: dict[str, Raw], name: str, old: Any, new: Any, c: Context) -> None:
        raw: dict[str, Raw] = {}
        old = IDENTITY if old is None else old
        if not same(old.position, new.position):
            raw["position"] = KEYS["position"].write(new.position, c)
        if not same(old.rotation, new.rotation):
            raw |= _brief_rotation(new) or {"rotation": new.rotation.tolist()}
        if self.flat:
            table |= raw
        else:
            table[name] = raw

    def words(self) -> str:
        return "a pose: position, and one of rpy, rotvec and rotation"

    def accepts(self) -> str:
        return "a Pose"

    def schema(self, define: Any) -> dict[str, Any]:
        properties = {key: spec.schema(define) for key, spec in KEYS.items()}
        return {"type": "object", "properties": properties, "additionalProperties": False}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        if value is None:
            return ()
        inside = replace(place, path=place.path.rpartition(".")[0]) if self.flat else place
        return [
            each
            for key in ("position", "rotvec")
            for each in KEYS[key].controls(getattr(value, key), inside.at(key, MEANINGS[key]))
        ]

    def keys(self, name: str) -> tuple[str, ...]:
        return tuple(KEYS) if self.flat else (name,)

    def of_key(self, name: str, key: str) -> Spec:
        return KEYS[key] if self.flat else self

    def inner(self, name: str, key: str) -> tuple[str, ...]:
        return (key,) if self.flat else ()

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        if keys[0] not in KEYS or value is None:
            return []
        return [pose_part(keys[0], c.at(keys.pop(0)))]

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        if not self.flat:
            return super().pick(table, name, c)
        values = {key: table[key] for key in KEYS if key in table}
        return c.tried(self, values) if values else MISSING

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if value is None:
            return
        raw = self.saved(value, c)
        if self.flat and isinstance(raw, dict):
            table |= raw
        elif raw or not self.flat:
            table[name] = raw

    def merge(self, old: Raw, new: Raw, loose: bool) -> Raw:
        if not isinstance(old, Mapping) or not isinstance(new, Mapping):
            return new
        merged = dict(old)
        self._without_rivals(merged, new)
        return {**merged, **new}

    def beside(self, table: dict[str, Raw], name: str, over: Mapping[str, Raw]) -> None:
        if self.flat:
            self._without_rivals(table, over)

    def properties(self, name: str, define: Any) -> dict[str, Any]:
        if not self.flat:
            return super().properties(name, define)
        return {
            key: {**spec.schema(define), "description": MEANINGS[key]} for key, spec in KEYS.items()
        }

    def rows(self, name: str) -> list[tuple[str, str]]:
        if not self.flat:
            return super().rows(name)
        return [(key, f"{spec.words()}: {MEANINGS[key]}") for key, spec in KEYS.items()]

    @staticmethod
    def _without_rivals(table: dict[str, Raw], over: Mapping[str, Raw]) -> None:
        """Remove the rotation of a table in place if `over` gives another one."""
        if over.keys() & {"rpy", "rotvec", "rotation"}:
            for key in ("rpy", "rotvec", "rotation"):
                table.pop(key, None)


def _brief_rotation(pose: Pose) -> dict[str, Raw] | None:
    """Return the angles of a pose as a text says them; None if no angles give its rotation."""
    found = angles_of(pose)
    return {found[0]: Exact(found[1], "rad")} if found else None


def pose_from(values: Mapping[str, Any]) -> Pose:
    """Return the pose with these keys; raise InputError if there are two rotations."""
    given = [key for key in ("rpy", "rotvec", "rotation") if key in values]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)}: give one rotation only")
    if not values:
        return IDENTITY
    T = np.eye(4)
    if "rotation" in values:
        T[:3, :3] = values["rotation"]
    elif given:
        T = np.array(Pose.at(**{given[0]: values[given[0]]}))
    if "position" in values:
        T[:3, 3] = values["position"]
    with under("rotation"):
        return Pose(T)


SHAPES = {"position": ((3,),), "rpy": ((3,),), "rotvec": ((3,),), "rotation": ((3, 3),)}


def pose_part(key: str, c: Context) -> Part:
    """Return the part of a pose under one of its keys."""
    return Part(
        KEYS[key],
        c,
        _position if key == "position" else partial(_turn, key),
        partial(_placed, key),
        stack=partial(_placed, key),
        shapes=SHAPES[key],
        meaning=MEANINGS[key],
    )


def _position(pose: Pose) -> Any:
    return pose.position


def _turn(key: str, pose: Pose) -> Any:
    if key == "rpy":
        return np.array(rpy_of(pose.rotation))
    return pose.rotation if key == "rotation" else pose.rotvec


def _placed(key: str, pose: Pose, new: Any) -> Pose:
    """Return a pose with another position or rotation; poses (runs,) of numbers (runs, ...)."""
    values = np.asarray(new, dtype=float)
    lead = values.shape[: values.ndim - len(SHAPES[key][0])]
    T = np.array(np.broadcast_to(pose.matrix, (*lead, 4, 4) if lead else pose.matrix.shape))
    if key == "position":
        T[..., :3, 3] = values
    else:
        T[..., :3, :3] = values if key == "rotation" else _turned(key, values)
    return Pose(T)


def _turned(key: str, values: Any) -> Any:
    return (Pose.at(rpy=values) if key == "rpy" else Pose.at(rotvec=values)).rotation
