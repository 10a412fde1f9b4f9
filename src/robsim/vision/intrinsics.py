"""The text form of a camera's intrinsics: K, or focal, center and skew."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from robsim.base.arrays import frozen
from robsim.base.errors import InputError
from robsim.declare import ListOf, Number
from robsim.declare.fields import same
from robsim.declare.paths import Part, Shapes
from robsim.declare.spec import MISSING, Context, Raw, Spec, Unsayable
from robsim.vision.camera_checks import check_focal

FOCAL_LENGTH = Number(above=0, unit="px")
PAIR = ListOf(Number(unit="px"), 2, 2)


@dataclass(frozen=True)
class Focal(ListOf):
    """The declaration of two focal lengths in pixels, or one number for both."""

    item: Spec = FOCAL_LENGTH
    least: int = 2
    most: int = 2

    def read(self, raw: Raw, c: Context) -> tuple[Any, ...]:
        plain = isinstance(raw, int | float) and not isinstance(raw, bool)
        return super().read([raw, raw] if plain else raw, c)

    def words(self) -> str:
        return "[fx, fy] in pixels, or one number for both"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"anyOf": [{"type": "number"}, super().schema(define)]}


KEYS: dict[str, Spec] = {
    "K": ListOf(ListOf(Number(unit="px"), 3, 3), 3, 3),
    "focal": Focal(),
    "center": PAIR,
    "skew": Number(unit="px"),
}
MEANINGS = {
    "K": "The matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.",
    "focal": "The focal lengths, instead of K.",
    "center": "The principal point; without it the middle of the image.",
    "skew": "The skew of the axes of the image.",
}
PARTS = ("focal", "center", "skew")


@dataclass(frozen=True)
class Intrinsics(Spec):
    """The declaration of the matrix K, with its keys in the table of the camera."""

    def keys(self, name: str) -> tuple[str, ...]:
        return tuple(KEYS)

    def of_key(self, name: str, key: str) -> Spec:
        return KEYS[key]

    def inner(self, name: str, key: str) -> tuple[str, ...]:
        return (key,)

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        if value is None or keys[0] not in KEYS:
            return []
        key = keys.pop(0)
        get, put, shapes = PLACES[key]
        made = Part(KEYS[key], c.at(key), get, put, shapes=shapes, meaning=MEANINGS[key])
        return [replace(made, stack=partial(_stacked, put))]

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        before = c.problems.seen
        values = {key: c.at(key).tried(KEYS[key], table[key]) for key in KEYS if key in table}
        unsized = "size" in table and "size" not in c.facts["own"]  # which is a problem by itself
        if c.problems.seen > before or unsized:
            return MISSING
        try:
            return _matrix(values, c.facts["own"].get("size"))
        except InputError as error:
            c.blame(error)
            return MISSING

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        table |= self._brief(value, c.facts["own"]["size"]) if c.facts.get("brief") else {}
        if "focal" not in table:
            table["K"] = value.tolist()

    def put_change(self, table: dict[str, Raw], name: str, old: Any, new: Any, c: Context) -> None:
        table |= {key: x for key, x in _parts(new).items() if not same(x, _parts(old)[key])}
        if not same(new, _whole(_parts(new))):
            raise Unsayable

    @staticmethod
    def _brief(K: Any, size: Any) -> dict[str, Raw]:
        """Return focal and its companions, as far as they must be said; nothing if K must."""
        parts = _parts(K)
        if not same(K, _whole(parts)):
            return {}
        usual = {"center": [(n - 1) / 2 for n in size or ()], "skew": 0.0}
        made = {key: x for key, x in parts.items() if not same(x, usual.get(key))}
        fx, fy = parts["focal"]
        return {**made, "focal": fx if same(fx, fy) else [fx, fy]}

    def words(self) -> str:
        return "K, or focal and its companions"

    def beside(self, table: dict[str, Raw], name: str, over: Mapping[str, Raw]) -> None:
        """Let one form of the intrinsics replace the other in a table, in place.

        K is split where a part of it changes.
        """
        if "K" in over:
            for key in PARTS:
                table.pop(key, None)
        elif over.keys() & set(PARTS) and "K" in table:
            try:
                (fx, skew, cx), (_, fy, cy), _ = table["K"]
            except (TypeError, ValueError):
                return
            del table["K"]
            table |= {"focal": [fx, fy], "center": [cx, cy], "skew": skew}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        inside = replace(place, path=place.path.rpartition(".")[0])
        (fx, skew, cx), (_, fy, cy), _ = value.tolist()
        return [
            inside.at("focal", MEANINGS["focal"]).several((fx, fy), ("fx", "fy"), "px", False),
            inside.at("center", MEANINGS["center"]).several((cx, cy), ("cx", "cy"), "px", False),
            inside.at("skew", MEANINGS["skew"]).slider(skew, "px", None, None),
        ]

    def properties(self, name: str, define: Any) -> dict[str, Any]:
        return {
            key: {**spec.schema(define), "description": MEANINGS[key]} for key, spec in KEYS.items()
        }

    def rows(self, name: str) -> list[tuple[str, str]]:
        return [(key, f"{spec.words()}: {MEANINGS[key]}") for key, spec in KEYS.items()]


def _parts(K: Any) -> dict[str, Any]:
    (fx, skew, cx), (_, fy, cy), _ = K.tolist()
    return {"focal": [fx, fy], "center": [cx, cy], "skew": skew}


def _whole(parts: dict[str, Any]) -> Any:
    return np.array(_matrix(parts, None))


def _matrix(values: Mapping[str, Any], size: Any) -> list[list[float]]:
    parts = [key for key in PARTS if key in values]
    if "K" in values:
        if parts:
            raise InputError(f"K and {', '.join(parts)}: give K alone, or focal and its companions")
        return [list(row) for row in values["K"]]
    if "focal" not in values:
        raise InputError(
            "focal is missing: give K = [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] "
            "or focal = [fx, fy], in pixels"
        )
    if "center" not in values and size is None:
        raise InputError("center is missing: give it, or size, whose middle it then is")
    check_focal(*values["focal"])
    (fx, fy), (cx, cy) = values["focal"], values.get("center") or [(n - 1) / 2 for n in size or ()]
    return [[fx, values.get("skew", 0.0), cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]


def _focal(K: Any) -> Any:
    return K[0, 0] if K[0, 0] == K[1, 1] else np.array([K[0, 0], K[1, 1]])


def _with(K: Any, *places: tuple[tuple[int, int], Any]) -> Any:
    """Return K (3, 3), or (3, 3, runs), with other numbers at some places."""
    made = np.array(K)
    for place, number in places:
        made[place] = number
    return made


def _with_focal(K: Any, new: Any) -> Any:
    fx, fy = new if np.ndim(new) > np.ndim(K) - 2 else (new, new)
    check_focal(np.min(fx), np.min(fy))
    return _with(K, ((0, 0), fx), ((1, 1), fy))


def _stacked(put: Any, K: Any, values: Any) -> Any:
    """Return K (3, 3, runs) with numbers (runs, ...)."""
    wide = np.repeat(K[..., None], len(values), axis=2) if K.ndim == 2 else K
    return frozen(put(wide, np.ascontiguousarray(np.moveaxis(values, 0, -1))))


Place = tuple[Callable[[Any], Any], Callable[[Any, Any], Any], Shapes]
PLACES: dict[str, Place] = {
    "K": (lambda K: K, lambda K, new: np.array(new), ((3, 3),)),
    "focal": (_focal, _with_focal, ((), (2,))),
    "center": (
        lambda K: K[:2, 2],
        lambda K, new: _with(K, ((0, 2), new[0]), ((1, 2), new[1])),
        ((2,),),
    ),
    "skew": (lambda K: K[0, 1], lambda K, new: _with(K, ((0, 1), new)), ((),)),
}
