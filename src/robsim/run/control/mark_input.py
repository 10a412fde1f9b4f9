"""Marks as they were seen in one image, and the forms in which they may be given."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, as_float, as_floats
from robsim.base.errors import InputError, format_value
from robsim.servo.camera_target import CameraTarget

DEEPEST = 4  # cameras, targets, and times around each of them


@dataclass(frozen=True, eq=False)
class Marks:
    """Marks in an image that was taken at a time, for `Controller.step`.

    pixels    (N, 2), or by camera and target, as `step` takes them
    t         seconds on the clock of `step`
    doubtful  names of targets that may be something else, which are not used, beside those that
              `Detections` call doubtful

    >>> Marks({"plate": np.zeros((4, 2))}, t=0.033).doubtful
    ()
    """

    pixels: Any
    t: float
    doubtful: Collection[str] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", as_float(self.t, "t (seconds)"))
        object.__setattr__(self, "doubtful", _check_doubtful_names(self.doubtful))


@dataclass(frozen=True, eq=False)
class MarkObservation:
    """The marks (N, 2) of a sight in an image, NaN for those that are not seen, and its time."""

    sight: CameraTarget
    pixels: Array
    t: float


class _InputScope(NamedTuple):
    """What was said around some marks: when, which targets are doubtful, and how deep they are."""

    t: float
    doubtful: tuple[str, ...] = ()
    depth: int = 0

    def within(self, doubtful: Any) -> _InputScope:
        """Return the same for what is inside; InputError: that is too deep."""
        if self.depth >= DEEPEST:
            raise InputError("pixels: at most marks in targets in cameras, not deeper")
        return _InputScope(
            self.t, (*self.doubtful, *_check_doubtful_names(doubtful)), self.depth + 1
        )


class MarkReader:
    """The marks of some sights, from whatever form they are given in.

    `unused` names what was given beside them.
    """

    def __init__(self, sights: Sequence[CameraTarget]) -> None:
        self.sights = tuple(sights)
        self.cameras = tuple(dict.fromkeys(sight.eye.name for sight in self.sights))
        self.targets = tuple(dict.fromkeys(sight.target.name for sight in self.sights))
        self.unused: list[str] = []

    def read(self, given: Any, t: float) -> Iterator[MarkObservation]:
        """Yield the marks of each sight of which there is an image.

        InputError: another shape, or none of what is looked for.
        """
        self.unused = []
        yield from self._read(given, _InputScope(t), self.sights)
        self.unused = list(dict.fromkeys(self.unused))

    def _read(
        self, given: Any, around: _InputScope, sights: Sequence[CameraTarget]
    ) -> Iterator[MarkObservation]:
        """Yield the marks of some sights, within what was said around them."""
        t, doubtful = around.t, around.doubtful
        if given is None or not sights:
            return
        if isinstance(given, Marks):
            self.unused += [f"doubtful {n}" for n in given.doubtful if n not in self.targets]
            within = around.within(given.doubtful)._replace(t=given.t)
            yield from self._read(given.pixels, within, sights)
        elif isinstance(given, Mapping) and not _is_numbered(given):
            within = around.within(getattr(given, "doubtful", ()))
            yield from self._of_names(given, within, sights)
        elif len(sights) > 1:
            raise InputError(f"pixels: give them for each camera: {', '.join(self.cameras)}")
        elif sights[0].target.name in doubtful:
            self.unused.append(f"doubtful {sights[0].target.name}")
            yield _make_unseen_observation(sights[0], t)
        else:
            yield MarkObservation(sights[0], _read_pixels(given, sights[0]), t)

    def _of_names(
        self, given: Mapping[Any, Any], around: _InputScope, sights: Sequence[CameraTarget]
    ) -> Iterator[MarkObservation]:
        """Yield the marks of each sight that is given by the names of camera or target.

        Of one camera, what a detector did not find is not there.
        """
        known = self._known(sights)
        used = [key for key in given if key in known]
        self.unused += [str(key) for key in given if key not in known]
        if given and not used and not hasattr(given, "doubtful"):
            raise InputError(
                f"pixels: none of {_format_sights(sights)}; given: {_format_given_names(given)}"
            )
        left = list(sights)
        for key in used:
            own = [sight for sight in known[key] if sight in left]
            left = [sight for sight in left if sight not in own]
            yield from self._read(given[key], around, own)
        if len({sight.eye.name for sight in sights}) == 1:
            yield from (_make_unseen_observation(sight, around.t) for sight in left)

    def _known(self, sights: Sequence[CameraTarget]) -> dict[Any, list[CameraTarget]]:
        """Return the sights that each key stands for."""
        known: dict[Any, list[CameraTarget]] = {sight.key: [sight] for sight in sights}
        for sight in sights:
            known.setdefault(sight.eye.name, []).append(sight)
        for name in self.targets:
            own = [sight for sight in sights if sight.target.name == name]
            if len(own) == 1:
                known[name] = own
        return known


def _check_doubtful_names(doubtful: Any) -> tuple[str, ...]:
    """Return the names of doubtful targets."""
    listed = isinstance(doubtful, Collection) and not isinstance(doubtful, str)
    if not listed or not all(isinstance(name, str) for name in doubtful):
        raise InputError(f"doubtful: expected names of targets, got {format_value(doubtful)}")
    return tuple(doubtful)


def _make_unseen_observation(sight: CameraTarget, t: float) -> MarkObservation:
    """Return the image of a sight in which nothing is seen."""
    return MarkObservation(sight, np.full((len(sight.target.marks), 2), np.nan), t)


def _is_numbered(given: Mapping[Any, Any]) -> bool:
    """Return whether a mapping is {number of the mark: (column, row)}."""
    return bool(given) and all(isinstance(key, int | np.integer) for key in given)


def _read_pixels(given: Any, sight: CameraTarget) -> Array:
    """Return pixels (N, 2) of a target; NaN where a mark is not seen, or is not a number."""
    what, N = f"pixels of '{sight.target.name}'", len(sight.target.marks)
    if isinstance(given, Mapping):
        return _read_numbered_pixels(given, what, N)
    if type(given) is np.ndarray and given.dtype == np.float64 and given.shape == (N, 2):
        found = given.copy()
        found[~np.isfinite(found)] = np.nan
        return found
    found = as_floats(given, what, (N, 2), gaps=True)
    if found.shape != (N, 2):
        raise InputError(f"{what}: expected shape ({N}, 2), got {found.shape}")
    return found


def _read_numbered_pixels(given: Mapping[Any, Any], what: str, N: int) -> Array:
    """Return pixels (N, 2) of {number of the mark: (column, row)}."""
    found = np.full((N, 2), np.nan)
    for i, place in given.items():
        if not 0 <= i < N:
            raise InputError(f"{what}: no mark {i}; they are numbered from 0 to {N - 1}")
        found[i] = as_floats(place, f"{what}, mark {i}", (2,), gaps=True)
    return found


def _format_sights(sights: Sequence[CameraTarget]) -> str:
    """Return what is looked for, in words: "camera 'left' on 'plate'"."""
    return " or ".join(f"camera '{s.eye.name}' on '{s.target.name}'" for s in sights)


def _format_given_names(given: Mapping[Any, Any]) -> str:
    return ", ".join(map(str, given)) or "none"
