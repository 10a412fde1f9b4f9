"""Samplers: random distributions of a varied name."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, register
from robsim.declare import KindOf as ChoiceSpec
from robsim.declare.array_types import Numbers
from robsim.declare.kind_families import family
from robsim.declare.quantities import Amount
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.value_lists import Values, ValuesSpec

SAMPLER = family("sampler")
AMOUNT = Numbers(item=Amount(), shape=None)
POSITIVE = Numbers(item=Amount(above=0), shape=None)


@runtime_checkable
class Sampler(Protocol):
    """Protocol of samplers, which return one value for each draw: an array (draws, *shape).

    `shape` is the shape of the parameters of the distribution, () for one number. A user-defined
    class joins the samplers by `robsim.declare.register("sampler", "my_sampler")`.

    Examples
    --------
    >>> from robsim.samplers import Uniform
    >>> isinstance(Uniform(0.0, 1.0), Sampler)
    True
    """

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value, as far as the parameters determine it."""
        ...

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw.

        Parameters
        ----------
        draws : RandomNumbers
            Source of the random numbers. `draws.uniform(n)` and `draws.normal(n)` return arrays
            (draws, n), and `draws.numbers` are the numbers of the draws.
        shape : tuple of int
            Shape of the varied number.

        Returns
        -------
        ndarray of shape (draws, *shape)
            The values. The value of a draw must depend on the random numbers of this draw alone.
        """
        ...


def is_sobol(sampler: Any) -> bool:
    """Return whether a sampler takes its numbers from a Sobol sequence."""
    return isinstance(sampler, Sobol) or (
        isinstance(sampler, Sum | Product) and is_sobol(sampler.of)
    )


def count_given_values(sampler: Any) -> int | None:
    """Return the number of draws that a sampler has values for; None if unlimited."""
    sampler = sampler.of if isinstance(sampler, Sum | Product) else sampler
    return len(sampler._rows) if isinstance(sampler, TabulatedValues) else None


def _sample_numbers(sample: Callable[[int], Array], shape: tuple[int, ...]) -> Array:
    """Return random numbers (draws, *shape) from a function of their count."""
    return np.asarray(sample(math.prod(shape)).reshape(-1, *shape))


def _check_low_high(kind: str, low: Array, high: Array) -> None:
    """Raise InputError if low is above high, or their shapes differ."""
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
    """Numbers between two bounds."""

    low: Annotated[ArrayLike, AMOUNT, "Lowest value."]
    high: Annotated[ArrayLike, AMOUNT, "Highest value."]

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_low_high(type(self).__name__, *self._bounds)

    @property
    def _bounds(self) -> tuple[Array, Array]:
        """The bounds as arrays, as they are stored."""
        return cast(Array, self.low), cast(Array, self.high)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        low, high = self._bounds
        return np.broadcast_shapes(low.shape, high.shape)

    def at(self, share: Array) -> Array:
        """Return the values at shares of the interval from low to high."""
        low, high = self._bounds
        return np.asarray(low + (high - low) * share)


@register("sampler", "uniform")
@dataclass(frozen=True, eq=False)
class Uniform(RangeSampler):
    """Uniform distribution between low and high.

    Raises
    ------
    InputError
        If `low` is above `high`, or their shapes do not fit.

    Examples
    --------
    >>> from robsim.statistics.random_numbers import RandomNumbers
    >>> numbers = RandomNumbers(0, "task.gain", np.arange(3))  # of three draws
    >>> Uniform(0.5, 2.0).sample_values(numbers, ()).round(2)
    array([1.46, 0.85, 1.28])
    """

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        return self.at(_sample_numbers(draws.uniform, shape))


@register("sampler", "sobol")
@dataclass(frozen=True, eq=False)
class Sobol(RangeSampler):
    """Evenly distributed numbers between low and high, from a scrambled Sobol sequence.

    All numbers of a study with this sampler are coordinates of one point of the Sobol sequence,
    scrambled by the seed. The names take the dimensions of the sequence in their order: a name
    keeps its values if names are added after it. Means over the runs converge faster than with
    `Uniform`. The sampler needs SciPy, which `pip install 'robsim[store]'` installs.

    References
    ----------
    Sobol 1967, "On the distribution of points in a cube and the approximate evaluation of
    integrals", USSR Computational Mathematics and Mathematical Physics 7(4).

    Examples
    --------
    >>> Sobol(0.5, 2.0).low
    array(0.5)
    """

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        return self.at(_sample_numbers(draws.sample_sobol_points, shape))


@register("sampler", "log_uniform")
@dataclass(frozen=True, eq=False)
class LogUniform(RangeSampler):
    """Positive numbers with a uniform logarithm: 0.1 to 1 is as probable as 1 to 10.

    A value is low (high / low)^u, with u uniform between 0 and 1.

    Raises
    ------
    InputError
        If `low` is above `high`, or their shapes do not fit.

    Examples
    --------
    >>> from robsim.statistics.random_numbers import RandomNumbers
    >>> numbers = RandomNumbers(0, "task.gain", np.arange(3))  # of three draws
    >>> LogUniform(0.1, 10.0).sample_values(numbers, ()).round(2)
    array([1.9 , 0.29, 1.1 ])
    """

    low: Annotated[ArrayLike, POSITIVE, "Lowest value."]
    high: Annotated[ArrayLike, POSITIVE, "Highest value."]

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        share, (low, high) = _sample_numbers(draws.uniform, shape), self._bounds
        return np.asarray(low * np.exp(np.log(high / low) * share))


@register("sampler", "normal")
@dataclass(frozen=True, eq=False)
class Normal(DeclaredValue):
    """Normal distribution, with independent numbers if `mean` or `std` is an array.

    Raises
    ------
    InputError
        If the shapes of `mean` and `std` do not fit.

    Examples
    --------
    >>> from robsim.statistics.random_numbers import RandomNumbers
    >>> numbers = RandomNumbers(0, "task.gain", np.arange(3))  # of three draws
    >>> Normal(0.0, 0.01).sample_values(numbers, ()).round(4)
    array([ 0.0066, -0.0151, -0.0113])
    """

    mean: Annotated[ArrayLike, AMOUNT, "Mean."]
    std: Annotated[ArrayLike, Numbers(item=Amount(least=0), shape=None), "Standard deviation."]

    def __post_init__(self) -> None:
        super().__post_init__()
        mean, std = self._parameters
        try:
            np.broadcast_shapes(mean.shape, std.shape)
        except ValueError:
            raise InputError(
                f"Normal: mean and std have shapes {mean.shape} and {std.shape}"
            ) from None

    @property
    def _parameters(self) -> tuple[Array, Array]:
        """Mean and standard deviation as arrays, as they are stored."""
        return cast(Array, self.mean), cast(Array, self.std)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        mean, std = self._parameters
        return np.broadcast_shapes(mean.shape, std.shape)

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return a value (draws, *shape) for each draw."""
        mean, std = self._parameters
        return np.asarray(mean + std * _sample_numbers(draws.normal, shape))


@register("sampler", "given")
@dataclass(frozen=True, eq=False)
class TabulatedValues(DeclaredValue):
    """Tabulated numbers: draw i has row i.

    Use it for samples of another program. Several names with this sampler have values of the same
    row in each draw, which preserves their correlation.

    Raises
    ------
    InputError
        If `values` is a single number.

    Examples
    --------
    >>> TabulatedValues([0.1, 0.2, 0.4]).values
    array([0.1, 0.2, 0.4])
    """

    values: Annotated[ArrayLike, AMOUNT, "Values, one row for each draw."]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self._rows.ndim:
            raise InputError(
                "TabulatedValues: expected one row of numbers for each draw, got one number"
            )

    @property
    def _rows(self) -> Array:
        """The values as an array, as they are stored."""
        return cast(Array, self.values)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one value."""
        return tuple(self._rows.shape[1:])

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return the row of each draw, (draws, *shape); the rows repeat cyclically."""
        own = self._rows[draws.numbers % len(self._rows)]
        return np.array(np.broadcast_to(own, (len(own), *shape)))


@dataclass(frozen=True, eq=False)
class _NominalSampler(DeclaredValue):
    """Samples that change the nominal value of the experiment."""

    of: Annotated[
        Sampler, ChoiceSpec(SAMPLER, short=False, protocol=Sampler), "Sampler of the change."
    ]

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

    def sample_values(self, draws: RandomNumbers, shape: tuple[int, ...]) -> Array:
        """Return the samples (draws, *shape), without the nominal value."""
        return np.asarray(self.of.sample_values(draws, shape))


@register("sampler", "plus")
@dataclass(frozen=True, eq=False)
class Sum(_NominalSampler):
    """The nominal value of the experiment plus a sample: an additive error.

    Examples
    --------
    >>> Sum(Normal(0.0, 0.002)).of.std
    array(0.002)
    """


@register("sampler", "times")
@dataclass(frozen=True, eq=False)
class Product(_NominalSampler):
    """The nominal value of the experiment times a sample: a relative error.

    Examples
    --------
    >>> Product(Uniform(0.9, 1.1)).of.low
    array(0.9)
    """


@register("sampler", "choice")
@dataclass(frozen=True, eq=False)
class Choice(DeclaredValue):
    """Random choice of one of several values: numbers, texts as in a file, or objects.

    Each draw has one value. Give a list without `Choice` to simulate every draw with each value.

    Examples
    --------
    >>> Choice([0.2, 0.5, 1.0]).values
    (0.2, 0.5, 1.0)
    """

    values: Annotated[Values, ValuesSpec(), "Values; each draw has one of them."]

    def sample_indices(self, draws: RandomNumbers) -> NDArray[np.int64]:
        """Return the index of a value (draws,) for each draw.

        Parameters
        ----------
        draws : RandomNumbers
            Source of the random numbers.

        Returns
        -------
        ndarray of int of shape (draws,)
            Indices in `values`, uniformly distributed.
        """
        share = draws.uniform(1)[:, 0]
        return np.minimum((share * len(self.values)).astype(np.int64), len(self.values) - 1)
