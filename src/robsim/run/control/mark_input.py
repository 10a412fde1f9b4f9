"""Observed marks of an image, and their forms as arguments of `Controller.step`."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_float, as_floats
from robsim.base.errors import InputError, format_value
from robsim.base.parameter_names import name_parameters
from robsim.servo.camera_target import CameraTarget

DEEPEST = 4  # nested levels: cameras, targets, and times around each of them


# pixels (N, 2), {number: (column, row)}, or these by names of cameras and targets
Pixels = ArrayLike | Mapping[Any, object]  # Any: keys are numbers, names or pairs of names


@name_parameters
@dataclass(frozen=True, eq=False)
class Marks:
    """Marks in an image with a capture time, for `Controller.step`.

    Parameters
    ----------
    pixels : array_like of shape (N, 2), or dict
        Pixels, or pixels by camera and target, as in `Controller.step`.
    t : float
        Capture time in seconds, on the clock of `Controller.step`.
    doubtful : collection of str, optional
        Names of targets that may be misidentified. They are not used, nor are the doubtful targets
        of `Detections`.

    Examples
    --------
    >>> Marks({"plate": np.zeros((4, 2))}, t=0.033).doubtful
    ()
    """

    pixels: Pixels
    t: float
    doubtful: Collection[str] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", as_float(self.t, "t (seconds)"))
        object.__setattr__(self, "doubtful", _check_doubtful_names(self.doubtful))


@dataclass(frozen=True, eq=False)
class MarkObservation:
    """The pixels (N, 2) of a camera-target pair, and their time; NaN for marks out of view."""

    sight: CameraTarget
    pixels: Array
    t: float


class _InputScope(NamedTuple):
    """Data of the outer levels of an input: time, doubtful targets and depth of nesting."""

    t: float
    doubtful: tuple[str, ...] = ()
    depth: int = 0

    def within(self, doubtful: Any) -> _InputScope:
        """Return the data for the next level; InputError if the nesting is too deep."""
        if self.depth >= DEEPEST:
            raise InputError(
                "pixels: nested too deeply; expected at most {camera: {target: pixels}}"
            )
        return _InputScope(
            self.t, (*self.doubtful, *_check_doubtful_names(doubtful)), self.depth + 1
        )


class MarkReader:
    """Reader of the marks of camera-target pairs in any of the accepted forms.

    `unused` lists the names of data that belong to no pair.
    """

    def __init__(self, sights: Sequence[CameraTarget]) -> None:
        self.sights = tuple(sights)
        self.cameras = tuple(dict.fromkeys(sight.eye.name for sight in self.sights))
        self.targets = tuple(dict.fromkeys(sight.target.name for sight in self.sights))
        self._pairs = {sight.key: sight for sight in self.sights}
        self.unused: list[str] = []

    def read(self, data: Any, t: float) -> Iterator[MarkObservation]:
        """Yield the observation of each camera-target pair with a new image.

        Raise InputError if the data have another shape, or belong to none of the pairs.
        """
        self.unused = []
        if type(data) is Marks and not data.doubtful and self._is_complete(data.pixels):
            complete: Any = data.pixels
            for key, pixels in complete.items():  # as a camera driver passes them; faster
                sight = self._pairs[key]
                yield MarkObservation(sight, _read_pixels(pixels, sight), data.t)
            return
        yield from self._read(data, _InputScope(t), self.sights)
        self.unused = list(dict.fromkeys(self.unused))

    def _is_complete(self, pixels: Any) -> bool:
        """Return whether pixels are a dict with the key of every camera-target pair."""
        return type(pixels) is dict and pixels.keys() == self._pairs.keys()

    def _read(
        self, data: Any, around: _InputScope, sights: Sequence[CameraTarget]
    ) -> Iterator[MarkObservation]:
        """Yield the observations of some camera-target pairs, with the data of the outer levels."""
        t, doubtful = around.t, around.doubtful
        if data is None or not sights:
            return
        if isinstance(data, Marks):
            self.unused += [f"doubtful {n}" for n in data.doubtful if n not in self.targets]
            within = around.within(data.doubtful)._replace(t=data.t)
            yield from self._read(data.pixels, within, sights)
        elif isinstance(data, Mapping) and not _is_numbered(data):
            within = around.within(getattr(data, "doubtful", ()))
            yield from self._read_by_names(data, within, sights)
        elif len(sights) > 1:
            raise InputError(
                f"pixels: expected a dict with the pixels of each camera: {', '.join(self.cameras)}"
            )
        elif sights[0].target.name in doubtful:
            self.unused.append(f"doubtful {sights[0].target.name}")
            yield _make_unseen_observation(sights[0], t)
        else:
            yield MarkObservation(sights[0], _read_pixels(data, sights[0]), t)

    def _read_by_names(
        self, data: Mapping[Any, Any], around: _InputScope, sights: Sequence[CameraTarget]
    ) -> Iterator[MarkObservation]:
        """Yield the observations of camera-target pairs from a dict by camera or target.

        If the dict belongs to one camera, its missing targets are not seen.
        """
        known = self._list_sights_by_key(sights)
        used = [key for key in data if key in known]
        self.unused += [str(key) for key in data if key not in known]
        if data and not used and not hasattr(data, "doubtful"):
            raise InputError(
                f"pixels: none of {_format_sights(sights)}; given: {_format_given_names(data)}"
            )
        left = list(sights)
        for key in used:
            own = [sight for sight in known[key] if sight in left]
            left = [sight for sight in left if sight not in own]
            yield from self._read(data[key], around, own)
        if len({sight.eye.name for sight in sights}) == 1:
            yield from (_make_unseen_observation(sight, around.t) for sight in left)

    def _list_sights_by_key(self, sights: Sequence[CameraTarget]) -> dict[Any, list[CameraTarget]]:
        """Return the camera-target pairs of each accepted key."""
        known: dict[Any, list[CameraTarget]] = {sight.key: [sight] for sight in sights}
        for sight in sights:
            known.setdefault(sight.eye.name, []).append(sight)
        for name in self.targets:
            own = [sight for sight in sights if sight.target.name == name]
            if len(own) == 1:
                known[name] = own
        return known


def _check_doubtful_names(doubtful: Any) -> tuple[str, ...]:
    """Return the names of doubtful targets as a tuple."""
    listed = isinstance(doubtful, Collection) and not isinstance(doubtful, str)
    if not listed or not all(isinstance(name, str) for name in doubtful):
        raise InputError(f"doubtful: expected names of targets, got {format_value(doubtful)}")
    return tuple(doubtful)


def _make_unseen_observation(sight: CameraTarget, t: float) -> MarkObservation:
    """Return the observation of a camera-target pair without visible marks."""
    return MarkObservation(sight, np.full((len(sight.target.marks), 2), np.nan), t)


def _is_numbered(mapping: Mapping[Any, Any]) -> bool:
    """Return whether a mapping is {number of the mark: (column, row)}."""
    return bool(mapping) and all(isinstance(key, int | np.integer) for key in mapping)


def _read_pixels(data: Any, sight: CameraTarget) -> Array:
    """Return pixels (N, 2) of a target; NaN for a mark that is not seen or not finite."""
    what, N = f"pixels of '{sight.target.name}'", len(sight.target.marks)
    if isinstance(data, Mapping):
        return _read_numbered_pixels(data, what, N)
    if type(data) is np.ndarray and data.dtype == np.float64 and data.shape == (N, 2):
        pixels = data.copy()
        pixels[~np.isfinite(pixels)] = np.nan
        return pixels
    pixels = as_floats(data, what, (N, 2), gaps=True)
    if pixels.shape != (N, 2):
        raise InputError(f"{what}: expected shape ({N}, 2), got {pixels.shape}")
    return pixels


def _read_numbered_pixels(mapping: Mapping[Any, Any], what: str, N: int) -> Array:
    """Return pixels (N, 2) from {number of the mark: (column, row)}."""
    pixels = np.full((N, 2), np.nan)
    for i, place in mapping.items():
        if not 0 <= i < N:
            raise InputError(f"{what}: no mark {i}; they are numbered from 0 to {N - 1}")
        pixels[i] = as_floats(place, f"{what}, mark {i}", (2,), gaps=True)
    return pixels


def _format_sights(sights: Sequence[CameraTarget]) -> str:
    """Return the names of camera-target pairs, such as "camera 'left' on 'plate'"."""
    return " or ".join(f"camera '{s.eye.name}' on '{s.target.name}'" for s in sights)


def _format_given_names(mapping: Mapping[Any, Any]) -> str:
    return ", ".join(map(str, mapping)) or "none"
