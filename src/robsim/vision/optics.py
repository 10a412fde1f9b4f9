"""The errors of the pictures of a camera."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from robsim.base.unit_warnings import warn_of_milliseconds
from robsim.base.value import replace_unchecked
from robsim.declare import DeclaredValue, Integer, Number, PerRun, Role, Time, described

MOST_SAMPLES = 8
LONGEST_EXPOSURE = 0.999  # bound of plausible exposures in seconds


@described
@dataclass(frozen=True, eq=False)
class Optics(DeclaredValue):
    """The optics and the sensor of a camera: blur, noise, exposure and rolling shutter.

    Every error is off by default, and errors combine. The light L of a pixel is the grey value of
    an ideal camera, averaged over the exposure and blurred by the lens. Its grey value is

        x = gain cos(theta)^vignetting L,
        y = min(255, max(0, x + sqrt(gain 255 / full_well x + (gain read_noise)^2) n)),
        grey = 255 (y / 255)^(1 / gamma), rounded to one of 2^bits levels,

    with the angle theta between the ray and the optical axis, and normal numbers n. The variance is
    the linear model of a sensor in EMVA Standard 1288 (release 4.0 Linear): shot noise of the
    electrons, and noise of the electronics. Normal numbers are keyed by seed, run, step and pixel.
    The blur of the lens has Gaussian weights up to 4 standard deviations, and a vignetting of 4 is
    the law of a lens without obstruction (Gardner 1947, J. Res. NBS 39, 213).

    Motion during `exposure` blurs the image. With `readout` each row is seen earlier than the row
    below it: the exposure of row y of h rows ends readout (h - 1 - y) / h before the time of the
    image, at which the exposure of the last row ends. Only a simulation has motion.

    `samples` is the accuracy of the light: a pixel is the mean of samples^2 values, of which each
    has exact edges. Pictures in a run are drawn with these samples.

    Optics describe the true camera. A controller does not use them.

    Examples
    --------
    >>> Optics(full_well=10_000, read_noise=1.5, exposure=0.005, readout=0.02).duration
    0.025
    >>> Optics(bits=9)
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: Optics.bits must be a whole number from 1 to 8, got 9
    """

    full_well: Annotated[
        float | None,
        Number(above=0, unit="electrons"),
        PerRun(()),
        Role.FIGURE,
        "Electrons of a pixel at the grey value 255, at a gain of 1. None: no shot noise.",
    ] = None
    read_noise: Annotated[
        float,
        Number(least=0, most=255, unit="grey values"),
        PerRun(()),
        Role.FIGURE,
        "Standard deviation of the noise in the dark, at a gain of 1.",
    ] = 0.0
    defocus: Annotated[
        float,
        Number(least=0, most=100, unit="px"),
        PerRun(()),
        Role.FIGURE,
        "Standard deviation of the blur of the lens.",
    ] = 0.0
    vignetting: Annotated[
        float,
        Number(least=0, most=100),
        PerRun(()),
        Role.FIGURE,
        "Exponent of the cosine of the angle to the optical axis. 4 for a plain lens.",
    ] = 0.0
    exposure: Annotated[
        float, Time(least=0), PerRun(()), Role.FIGURE, "Time during which a pixel gathers light."
    ] = 0.0
    readout: Annotated[
        float,
        Time(least=0),
        PerRun(()),
        Role.FIGURE,
        "Time from the first row to the end of the last row of a rolling shutter. 0: all rows at "
        "the same time.",
    ] = 0.0
    gain: Annotated[
        float,
        Number(above=0, most=1000),
        PerRun(()),
        Role.FIGURE,
        "Factor of the light and of its noise. Values above 255 are saturated.",
    ] = 1.0
    gamma: Annotated[
        float,
        Number(least=0.2, most=5),
        PerRun(()),
        Role.FIGURE,
        "Gamma of the grey values; above 1 dark values are brighter. 2.2 is near to sRGB.",
    ] = 1.0
    bits: Annotated[
        int, Integer(1, 8), Role.FIGURE, "Bits of a grey value; white is 255 with any number."
    ] = 8
    samples: Annotated[
        int,
        Integer(1, MOST_SAMPLES),
        Role.FIGURE,
        "Divisions along each side of a pixel. 2 has a quarter of the error, in four times the "
        "time.",
    ] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("exposure", "readout"):
            warn_of_milliseconds(getattr(self, name), f"Optics.{name}", LONGEST_EXPOSURE)

    @property
    def duration(self) -> float:
        """Time in seconds from the first light of an image to its last."""
        return self.exposure + self.readout

    def of_run(self, run: int) -> Optics:
        """Return the optics of one run of a batch, in which numbers differ from run to run.

        >>> Optics(gain=2.0).of_run(3).gain
        2.0
        """
        numbers = {each.name: getattr(self, each.name) for each in fields(self)}
        stacks = {name: x[run].item() for name, x in numbers.items() if isinstance(x, np.ndarray)}
        return replace_unchecked(self, **stacks)
