"""A part of what a task regulates: a feature, who sees it of what, and which of its numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import positive
from robsim.base.errors import InputError, suggest
from robsim.features import FEATURES, Feature


@dataclass(frozen=True)
class FeatureBlock:
    """One of several features that a task stacks: `IBVS(features=[FeatureBlock(...), ...])`.

    feature       a name such as "points", or an object with unit, tolerance and measure
    camera        its name, or two names for a feature of a stereo pair; None: that of the task
    target        name of the object with the marks; None: that of the task
    marks         which marks, by number; None: all
    components    which numbers of s; None: all
    weight        on its rows in the law's least squares

    >>> FeatureBlock("log_depth", marks=[0]).marks
    (0,)
    """

    feature: Any
    camera: str | tuple[str, str] | None = None
    target: str | None = None
    marks: tuple[int, ...] | None = None
    components: tuple[int, ...] | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "feature", as_feature(self.feature))
        put(self, "camera", as_cameras(self.camera))
        put(self, "marks", _indices(self.marks, "marks"))
        put(self, "components", _indices(self.components, "components"))
        put(self, "weight", positive(self.weight, "weight"))


def as_parts(given: Any) -> tuple[FeatureBlock, ...]:
    """Parts from one feature or a list of features and parts."""
    several = given if isinstance(given, list | tuple) else [given]
    if not several:
        raise InputError("features: an empty list; give at least one feature")
    return tuple(part if isinstance(part, FeatureBlock) else FeatureBlock(part) for part in several)


def as_feature(given: Any) -> Feature:
    """A feature from its name or itself."""
    if isinstance(given, str):
        if given not in FEATURES:
            raise InputError(f"no features {given!r}; {suggest(given, FEATURES, 'features')}")
        made: Feature = FEATURES[given]()
        return made
    if isinstance(given, type) or not isinstance(given, Feature):
        raise InputError(
            f"features: expected a name ({', '.join(FEATURES)}), or an object with unit, tolerance "
            f"and measure, such as Points(), got {given!r:.80}"
        )
    return given


def as_cameras(given: Any) -> str | tuple[str, str] | None:
    """The name of a camera, two names for a stereo pair, or None."""
    if given is None or isinstance(given, str):
        return given
    names = tuple(given) if isinstance(given, list | tuple) else ()
    if len(names) != 2 or not all(isinstance(name, str) for name in names) or len(set(names)) < 2:
        raise InputError(f"camera: expected a name, or two different ones, got {given!r:.80}")
    return names


def _indices(given: Any, what: str) -> tuple[int, ...] | None:
    if given is None:
        return None
    numbers = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else ()
    whole = all(isinstance(n, int | np.integer) and n is not True and n >= 0 for n in numbers)
    if not numbers or not whole or len(set(numbers)) < len(numbers):
        raise InputError(f"{what}: expected different whole numbers from 0 on, got {given!r:.80}")
    return tuple(int(n) for n in numbers)
