"""Features and parts as tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robsim.describe.values import NoDescription, Table, builtin, length, ours
from robsim.features import FEATURES, DecoupledMoments, Sphere, Translation
from robsim.servo import FeatureBlock


def features(value: Any) -> Any:
    """One feature alone, or a list of parts."""
    if isinstance(value, tuple):
        return [_short(part(each)) for each in value]
    return _short(feature(value))


def part(value: FeatureBlock) -> Table:
    """A feature, and what is not as it would be anyway."""
    table = feature(ours(value, FeatureBlock).feature)
    if value.camera is not None:
        table["camera"] = camera(value.camera)
    if value.target is not None:
        table["target"] = value.target
    for key in ("marks", "components"):
        if getattr(value, key) is not None:
            table[key] = list(getattr(value, key))
    return table if value.weight == 1.0 else {**table, "weight": value.weight}


def feature(value: Any) -> Table:
    """A feature with its parameters; NoDescription if it is somebody's, or bound to a goal."""
    kind = builtin(FEATURES, value)
    table: Table = {"kind": kind}
    if isinstance(value, Sphere):
        table["radius"] = length(value.radius)
    if isinstance(value, DecoupledMoments):
        table["of"] = value.kind
    if isinstance(value, Translation):
        table["form"] = value.form
    if value.tolerance != type(value)().tolerance:
        table["tolerance"] = _tolerance(value.tolerance)
    _check_plain(value)
    return table


def _tolerance(value: float) -> float:
    if not 0.0 <= value < np.inf:
        raise NoDescription(f"the tolerance {value!r:.40} is not a number from 0 on")
    return float(value)


def camera(value: str | Sequence[str]) -> str | list[str]:
    """One name, or two."""
    return value if isinstance(value, str) else list(value)


def _check_plain(value: Any) -> None:
    """A feature is what it was before a goal was shown to it, as those of a file are."""
    said = ("radius", "kind", "form", "tolerance")
    plain = type(value)(**{key: getattr(value, key) for key in said if hasattr(value, key)})
    if plain != value:
        raise NoDescription(f"{type(value).__name__} has a goal or unit of its own")


def _short(table: Table) -> str | Table:
    """The name alone, where that says it all."""
    return str(table["kind"]) if table.keys() == {"kind"} else table
