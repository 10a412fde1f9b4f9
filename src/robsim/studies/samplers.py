"""Samplers: what the values of a varied name are drawn from, or which they are in turn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, register
from robsim.declare import KindOf as ChoiceSpec
from robsim.declare.array_types import Numbers
from robsim.declare.kind_families import family
from robsim.declare.quantities import Amount
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.value_lists import ValuesSpec

SAMPLER = family("sampler")
AMOUNT = Numbers(item=Amount(), shape=None)
POSITIVE = Numbers(item=Amount(above=0), shape=None)


@runtime_checkable
class Sampler(Protocol):
    """What draws numbers: one value (draws, *shape) for each draw.

    `shape` is the shape of the numbers that are given to it, () for one number. Your own class
    joins the others by `robsim.declare.register("sampler", "my_sampler")`.
    """

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value, as far as the sampler says it."""
        ...

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        ...


def is_sobol(sampler: Any) -> bool:
    """Return whether a sampler takes its numbers from Sobol's sequence."""
    return isinstance(sampler, Sobol) or (
        isinstance(sampler, Sum | Product) and is_sobol(sampler.of)
    )


def count_given_values(sampler: Any) -> int | None:
    """Return for how many draws a sampler has numbers; None if for any."""
    sampler = sampler.of if isinstance(sampler, Sum | Product) else sampler
    return len(sampler.values) if isinstance(sampler, TabulatedValues) else None


def _draw_numbers(draw: Any, shape: tuple[int, ...]) -> Array:
    """Return what `draw` gives for so many numbers, in this shape."""
    return np.asarray(draw(math.prod(shape)).reshape(-1, *shape))


def _check_low_high(kind: str, low: Any, high: Any) -> None:
    try:
        wrong = bool((low > high).any())
    except ValueError:
        raise InputError(f"{kind}: low and high have shapes {low.shape} and {high.shape}") from None
    if wrong:
        raise InputError(
            f"{kind}: low {format_value(low.tolist())} is above high {format_value(high.tolist())}"
        )


@dataclass(frozen=True, eq=False)
class RangeSampler(DeclaredValue):
    """Numbers between two others."""

    low: Annotated[Any, AMOUNT, "Lowest value."]
    high: Annotated[Any, AMOUNT, "Highest value."]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_low_high(type(self).__name__, self.low, self.high)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        return np.broadcast_shapes(self.low.shape, self.high.shape)

    def at(self, share: Array) -> Array:
        """Return the values at shares of the way from low to high."""
        return np.asarray(self.low + (self.high - self.low) * share)


@register("sampler", "uniform")
@dataclass(frozen=True, eq=False)
class Uniform(RangeSampler):
    """Numbers that are anywhere between low and high with the same chance.

    >>> Uniform(0.5, 2.0).high
    array(2.)
    """

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        return self.at(_draw_numbers(draws.uniform, shape))


@register("sampler", "sobol")
@dataclass(frozen=True, eq=False)
class Sobol(RangeSampler):
    """Numbers between low and high that fill the space of all that are so marked evenly.

    All numbers of a study with this sampler are the coordinates of one point of Sobol's sequence,
    scrambled by the seed, so that means over the runs converge faster. It needs SciPy, of
    `pip install 'robsim[store]'`.

    >>> Sobol(0.5, 2.0).low
    array(0.5)
    """

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        return self.at(_draw_numbers(draws.even, shape))


@register("sampler", "log_uniform")
@dataclass(frozen=True, eq=False)
class LogUniform(RangeSampler):
    """Positive numbers whose logarithm is uniform: as often from 0.1 to 1 as from 1 to 10.

    >>> LogUniform(0.1, 10.0).high
    array(10.)
    """

    low: Annotated[Any, POSITIVE, "Lowest value."]
    high: Annotated[Any, POSITIVE, "Highest value."]

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        share = _draw_numbers(draws.uniform, shape)
        return np.asarray(self.low * np.exp(np.log(self.high / self.low) * share))


@register("sampler", "normal")
@dataclass(frozen=True, eq=False)
class Normal(DeclaredValue):
    """Numbers of a normal distribution.

    >>> Normal(0.0, 0.01).std
    array(0.01)
    """

    mean: Annotated[Any, AMOUNT, "Mean."]
    std: Annotated[Any, Numbers(item=Amount(least=0), shape=None), "Standard deviation."]

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            np.broadcast_shapes(self.mean.shape, self.std.shape)
        except ValueError:
            raise InputError(
                f"Normal: mean and std have shapes {self.mean.shape} and {self.std.shape}"
            ) from None

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        return np.broadcast_shapes(self.mean.shape, self.std.shape)

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        return np.asarray(self.mean + self.std * _draw_numbers(draws.normal, shape))


@register("sampler", "given")
@dataclass(frozen=True, eq=False)
class TabulatedValues(DeclaredValue):
    """Numbers that were drawn elsewhere: the first draw has the first of them, and so on.

    Several names may have theirs, so that what belongs together is drawn together.

    >>> TabulatedValues([0.1, 0.2, 0.4]).values
    array([0.1, 0.2, 0.4])
    """

    values: Annotated[Any, AMOUNT, "Numbers, a row for each draw."]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.values.ndim:
            raise InputError("Given: expected a row of numbers for each draw, got one number")

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        return tuple(self.values.shape[1:])

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw; beyond the last they begin anew."""
        own = self.values[draws.numbers % len(self.values)]
        return np.array(np.broadcast_to(own, (len(own), *shape)))


@dataclass(frozen=True, eq=False)
class _NominalSampler(DeclaredValue):
    """Numbers of another sampler that change the value which the experiment has."""

    of: Annotated[Any, ChoiceSpec(SAMPLER, short=False, protocol=Sampler), "What is drawn."]

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.of, Sum | Product | Choice):
            raise InputError(
                f"{type(self).__name__}: expected a sampler of numbers, got {format_value(self.of)}"
            )

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        return tuple(self.of.shape)

    def drawn(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return what is drawn (draws, *shape), without the value of the experiment."""
        return np.asarray(self.of.drawn(draws, shape))


@register("sampler", "plus")
@dataclass(frozen=True, eq=False)
class Sum(_NominalSampler):
    """The value that the experiment has, plus what is drawn: an error about the nominal value.

    >>> Sum(Normal(0.0, 0.002)).of.std
    array(0.002)
    """


@register("sampler", "times")
@dataclass(frozen=True, eq=False)
class Product(_NominalSampler):
    """The value that the experiment has, times what is drawn: an error in percent.

    >>> Product(Uniform(0.9, 1.1)).of.low
    array(0.9)
    """


@register("sampler", "choice")
@dataclass(frozen=True, eq=False)
class Choice(DeclaredValue):
    """One of some values, drawn by chance: numbers, texts as in a file, or objects.

    To run every draw with each of them give the list alone, without `Choice`.

    >>> Choice([0.2, 0.5, 1.0]).values
    (0.2, 0.5, 1.0)
    """

    values: Annotated[Any, ValuesSpec(), "Values, of which one is drawn."]

    def picked(self, draws: RandomNumbers) -> NDArray[np.int64]:
        """Return the number of a value (draws,) for each draw."""
        share = draws.uniform(1)[:, 0]
        return np.minimum((share * len(self.values)).astype(np.int64), len(self.values) - 1)
