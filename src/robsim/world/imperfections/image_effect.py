"""Kinds of imperfections of the images, and what each of them declares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Choice, family
from robsim.world.imperfections.exposure import Exposure
from robsim.world.imperfections.image_rows import ImageRows, MarkGroup
from robsim.world.imperfections.imperfection import Imperfection, RunFacts, Statement

IMAGE_EFFECTS = family("image effect")
FIRST_STREAM = 16  # of random numbers of effects; those below are of the short form


class Place(IntEnum):
    """The place of an effect on the way of an image from the camera to the controller."""

    TAKEN = 0  # when images are taken and used: a `timing`, but no stages
    MEASURED = 1  # where marks are seen
    ROUNDED = 2  # to the resolution of the image
    RECEIVED = 3  # which images and marks arrive


class ImageTiming(NamedTuple):
    """When images are taken and used.

    every    control periods from one image to the next
    latency  seconds from when an image is taken until it is used
    lost     share of the images that never arrive
    """

    every: int = 1
    latency: float = 0.0
    lost: float = 0.0

    def and_also(self, other: ImageTiming) -> ImageTiming:
        """Return the times under two effects: latencies add up, the rarer images count."""
        lost = self.lost + other.lost - self.lost * other.lost
        return ImageTiming(max(self.every, other.every), self.latency + other.latency, lost)


class ImageEffect(Imperfection):
    """A kind of imperfection of the images, with all that is known of it.

    A kind is a frozen dataclass of declared fields, registered as an "image effect". It adds
    compiled stages (`add_stages`), or it is called in Python at every image (`seen`). The other
    methods are for those who explain runs and give advice.

    place  where it acts between the camera and the controller
    """

    place: ClassVar[Place] = Place.MEASURED
    title: ClassVar[str] = "effects on the images"

    def seen(self, pixels: Array, exposure: Exposure) -> Array:
        """Return where the marks are seen (B, N, 2), from where they would be, in pixels."""
        raise NotImplementedError(f"{self.label} needs `seen` or `add_stages`")

    def add_stages(self, image: ImageRows) -> None:
        """Add the stages of the effect to a program; by default `seen` is called."""
        image.call(self.seen, self.label)

    def check(self, groups: Sequence[MarkGroup]) -> None:
        """Raise InputError if the effect does not fit the cameras and marks of a task."""

    def timing(self, dt: float) -> ImageTiming:
        """Return its part in when images are taken and used, at a control period."""
        return ImageTiming()

    def deviation(self, robust: bool) -> float:
        """Return the standard deviation of a pixel coordinate, maybe under robust weights."""
        return 0.0

    def stated(self, facts: RunFacts) -> Statement:
        return facts.lasting(f"The images are changed by {self.label}")

    def in_views(self, pixels: Array, normal: Callable[[], Array]) -> Array:
        """Return the pixels (V, N, 2) of views by a robot that stands still.

        `normal()` are standard normal numbers of the same shape.
        """
        raise InputError("views have noise and quantisation only; leave it out")


@runtime_checkable
class OwnImageEffect(Protocol):
    """What anything must have to be an effect on images: a user's class needs no base class.

    Registered with `register("image effect", "my_effect")`, it has a place in scenario files.
    """

    def seen(self, pixels: Array, exposure: Exposure) -> Array:
        """Return where the marks are seen (B, N, 2), from where they would be, in pixels."""


EFFECT = Choice(IMAGE_EFFECTS, protocol=OwnImageEffect)


@dataclass(frozen=True, eq=False)
class CalledImageEffect(ImageEffect):
    """An image effect that is a user's own object without our base class."""

    own: Any

    @property
    def label(self) -> str:
        return type(self.own).__name__

    def seen(self, pixels: Array, exposure: Exposure) -> Array:
        found: Array = self.own.seen(pixels, exposure)
        return found


def image_effect(given: Any) -> ImageEffect:
    """Return an effect with our base class, also where it is a user's own object."""
    return given if isinstance(given, ImageEffect) else CalledImageEffect(given)
