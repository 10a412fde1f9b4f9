"""The errors of the images that a controller gets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from robsim.base.arrays import numbers
from robsim.base.errors import InputError, said
from robsim.base.units import Dimension
from robsim.declare import (
    Declared,
    ListOf,
    Number,
    Quantity,
    Stacked,
    Table,
    Time,
    Whole,
    described,
)
from robsim.declare.spec import Context, Raw, Spec
from robsim.declare.words import Reference
from robsim.world.effects import EFFECT, ImageEffect

MOST = 1e15  # control periods: so long that no other image follows
MARK = Whole(0, 10_000)
PIXELS = Number(least=0, unit="px")
SHARE = Number(least=0, below=1)


@dataclass(frozen=True)
class Forever(Quantity):
    """The declaration of a time that may be infinite, which a text leaves out."""

    dimension: Dimension = "time"

    def check(self, value: Any, what: str) -> float:
        forever = isinstance(value, float) and value == math.inf
        return math.inf if forever else super().check(value, what)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if value != math.inf:
            super().put(table, name, value, c)


@dataclass(frozen=True)
class Marks(ListOf):
    """The declaration of the numbers of marks; in Python also a single number."""

    item: Spec = MARK
    least: int = 1

    def check(self, value: Any, what: str) -> tuple[int, ...]:
        flat = numbers(value, what, ())
        if flat.ndim > 1 or not flat.size or (flat != flat.round()).any() or (flat < 0).any():
            raise InputError(f"{what}: expected numbers from 0 on, got {said(value)}")
        return tuple(int(n) for n in flat.reshape(-1))


MARKS = Marks()


@described
@dataclass(frozen=True)
class Occlusion(Declared):
    """Marks that are hidden from `start` until `end`, in seconds.

    `target` and `camera` restrict it to one object and to one camera; None stands for all. A
    feature that has numbers for each mark is servoed on those that are left; a feature that is
    made of all marks at once, such as a moment or a pose, keeps the last place of the hidden ones,
    and so does any feature of which nothing is left. With a weighting of the task a pose is
    estimated from those that are left, and where these are too few the run ends.

    >>> Occlusion([0], start=1.0).end
    inf
    """

    marks: Annotated[tuple[int, ...], MARKS, "Numbers of the hidden marks."]
    start: Annotated[
        float, Time(above=0), "Time from which the marks are hidden; they must be seen once before."
    ]
    end: Annotated[float, Forever(above=0), "Time until which the marks are hidden."] = math.inf
    target: Annotated[
        str | None, Reference, "Object whose marks are hidden; None: all objects."
    ] = None
    camera: Annotated[
        str | None, Reference, "Camera for which the marks are hidden; None: all cameras."
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.end > self.start:
            raise InputError(f"an occlusion from {self.start:g} s must end later, not {self.end:g}")

    def concerns(self, camera: str, target: str) -> bool:
        """Return whether it hides marks of a target from a camera."""
        return self.camera in (None, camera) and self.target in (None, target)


@described
@dataclass(frozen=True)
class Sensing(Declared):
    """The errors of the images of a run; each is off by default, and they combine.

    Until the first late image comes, the image of the start is used. Coordinates of joints
    are never late. Random numbers are keyed by (seed, run) and step.

    >>> Sensing(noise=0.5, latency=0.04).noise
    0.5
    """

    noise: Annotated[
        float, PIXELS, Stacked(()), "Standard deviation of Gaussian noise on each pixel coordinate."
    ] = 0.0
    quantisation: Annotated[
        float, PIXELS, Stacked(()), "Step to whose multiples pixel coordinates are rounded."
    ] = 0.0
    outliers: Annotated[
        float, SHARE, Stacked(()), "Share of the marks that are mismatched in each image."
    ] = 0.0
    outlier_size: Annotated[
        float, PIXELS, Stacked(()), "Standard deviation of the displacement of an outlier."
    ] = 50.0
    occlusions: Annotated[
        tuple[Occlusion, ...],
        ListOf(Table(Occlusion), alone=True),
        "Times in which marks are hidden.",
    ] = ()
    dropped: Annotated[
        float,
        SHARE,
        Stacked(()),
        "Share of the images that are lost; the one before is used again.",
    ] = 0.0
    latency: Annotated[
        float, Time(least=0), Stacked(()), "Age of an image when it reaches the controller."
    ] = 0.0
    period: Annotated[
        float | None,
        Time(above=0),
        "Time from one image to the next, a multiple of the control period; None: one period.",
    ] = None
    effects: Annotated[
        tuple[ImageEffect, ...],
        ListOf(EFFECT, most=64, alone=True),
        "Effects of a kind of your own, one after the other.",
    ] = ()

    def periods(self, dt: float) -> int:
        """Return the control periods between images; raise InputError unless they are whole."""
        if self.period is None:
            return 1
        ratio = min(self.period / dt, MOST)
        if not round(ratio) >= 1 or abs(ratio - round(ratio)) > 1e-6:
            raise InputError(
                f"the period of the camera, {self.period:g} s, must be a multiple of the control "
                f"period, {dt:g} s"
            )
        return round(ratio)
