"""How the image that a controller gets differs from the one that there is."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from robsim.base.arrays import not_negative, numbers
from robsim.base.errors import InputError

AT_ONCE = 1e-9  # seconds: the time of an image, step * dt - latency, is rounded by less
MOST = 1e15  # control periods: an image that is never followed by another


@dataclass(frozen=True)
class Occlusion:
    """Some marks are hidden from `start` until `end`, in seconds: of one target or camera, or all.

    A feature that has numbers for each mark is servoed on those that are left; a feature that is
    made of all marks at once, such as a moment or a pose, keeps the last place of the hidden ones,
    and so does any feature of which nothing is left.

    >>> Occlusion([0], start=1.0).end
    inf
    """

    marks: tuple[int, ...]
    start: float
    end: float = math.inf
    target: str | None = None
    camera: str | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "marks", _marks(self.marks))
        put(self, "start", not_negative(self.start, "start of an occlusion (seconds)"))
        if self.start == 0.0:
            raise InputError("an occlusion cannot start at 0 s: the marks must be seen once before")
        if self.end != math.inf:
            put(self, "end", not_negative(self.end, "end of an occlusion (seconds)"))
        if not self.end > self.start:
            raise InputError(f"an occlusion from {self.start:g} s must end later, not {self.end:g}")
        for name in ("target", "camera"):
            if not isinstance(getattr(self, name), str | None):
                given = getattr(self, name)
                raise InputError(f"{name} of an occlusion: expected a name, got {given!r:.80}")

    def hides(self, seconds: float, camera: str, target: str) -> bool:
        """Whether it does so at a time."""
        mine = self.camera in (None, camera) and self.target in (None, target)
        return mine and self.start <= seconds + AT_ONCE < self.end


@dataclass(frozen=True)
class Sensing:
    """What is wrong with the images of a run; each is off by default, and they combine.

    noise         px, standard deviation of Gaussian noise on each coordinate of each mark
    quantisation  px, to whole multiples of which coordinates are rounded
    outliers      share of the marks that are taken for something else, image by image
    outlier_size  px, standard deviation of where an outlier is seen instead
    occlusions    marks that are hidden for a while
    dropped       share of the images that are lost: the last one is used again
    latency       seconds: how old an image is when it comes; until the first one comes, the
                  image of the start is used
    period        seconds from one image to the next, a multiple of the control period; None for
                  one in every control period

    Coordinates of joints are never late. Random numbers are keyed by (seed, run) and step.

    >>> Sensing(noise=0.5, latency=0.04).noise
    0.5
    """

    noise: float = 0.0
    quantisation: float = 0.0
    outliers: float = 0.0
    outlier_size: float = 50.0
    occlusions: tuple[Occlusion, ...] = ()
    dropped: float = 0.0
    latency: float = 0.0
    period: float | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name, unit in (
            ("noise", "pixels"),
            ("quantisation", "pixels"),
            ("outlier_size", "pixels"),
            ("latency", "seconds"),
        ):
            put(self, name, not_negative(getattr(self, name), f"{name} ({unit})"))
        for name in ("outliers", "dropped"):
            share = not_negative(getattr(self, name), name)
            if share >= 1:
                raise InputError(f"{name} must be a share from 0 to below 1, got {share:g}")
            put(self, name, share)
        if self.period is not None:
            put(self, "period", not_negative(self.period, "period of the camera (seconds)"))
        given = (self.occlusions,) if isinstance(self.occlusions, Occlusion) else self.occlusions
        listed = tuple(given) if isinstance(given, Iterable) else (given,)
        if isinstance(given, str | Mapping) or not all(isinstance(o, Occlusion) for o in listed):
            raise InputError(f"occlusions must be a list of Occlusion, got {given!r:.80}")
        put(self, "occlusions", listed)

    @property
    def only_noise(self) -> bool:
        """Whether nothing but Gaussian noise is wrong."""
        odd = self.quantisation or self.outliers or self.occlusions or self.dropped or self.latency
        return not odd and self.period is None

    def periods(self, dt: float) -> int:
        """Control periods from one image to the next; InputError if these are no whole ones."""
        if self.period is None:
            return 1
        ratio = min(self.period / dt, MOST)
        if not round(ratio) >= 1 or abs(ratio - round(ratio)) > 1e-6:
            raise InputError(
                f"the period of the camera, {self.period:g} s, must be a multiple of the control "
                f"period, {dt:g} s"
            )
        return round(ratio)


def _marks(given: Any) -> tuple[int, ...]:
    wanted = numbers(given, "marks of an occlusion", ())
    flat = wanted.reshape(-1)
    if wanted.ndim > 1 or not flat.size or (flat != flat.round()).any() or (flat < 0).any():
        raise InputError(f"marks of an occlusion: expected numbers from 0 on, got {given!r:.80}")
    return tuple(int(n) for n in flat)
