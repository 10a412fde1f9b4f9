"""Conditions for a switch between two schemes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, view_for_user
from robsim.declare import DeclaredValue, KindOf, Number, Word, family, register
from robsim.kernels.control import task_switch as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages
from robsim.vision.image_size import SIZE


@runtime_checkable
class Condition(Protocol):
    """Protocol of a condition: any object with this method, called at every step.

    Examples
    --------
    >>> class Slow:  # no velocity of the first scheme exceeds 0.01
    ...     def holds(self, first, second):
    ...         return abs(first.qd).max(axis=1) < 0.01
    >>> qd = np.array([[0.2, 0.001]])  # one velocity in two runs
    >>> state = SchemeState(qd, qd, qd, np.empty((0, 2, 2)))
    >>> Slow().holds(state, state)
    array([False,  True])
    """

    def holds(self, first: SchemeState, second: SchemeState) -> NDArray[np.bool_]:
        """Return whether the condition holds in each run.

        Parameters
        ----------
        first, second : SchemeState
            States of the two schemes in B runs.

        Returns
        -------
        ndarray of bool of shape (B,)
            True if the condition holds in the run.
        """


@dataclass(frozen=True, eq=False)
class SchemeState:
    """State of one of two schemes, for a condition: features, error, command and image.

    Attributes
    ----------
    s_last : ndarray of shape (k, B)
        Features.
    error_last : ndarray of shape (k, B)
        Error s - s_goal.
    qd_last : ndarray of shape (n, B)
        Commanded velocities.
    pixels_last : ndarray of shape (N, 2, B)
        Measured pixels of all marks of the scheme.
    """

    s_last: Array
    error_last: Array
    qd_last: Array
    pixels_last: Array

    @property
    def s(self) -> Array:
        """Features s (B, k)."""
        return view_for_user(self.s_last)

    @property
    def error(self) -> Array:
        """Error s - s_goal (B, k)."""
        return view_for_user(self.error_last)

    @property
    def qd(self) -> Array:
        """Commanded velocities qd (B, n)."""
        return view_for_user(self.qd_last)

    @property
    def pixels(self) -> Array:
        """Measured pixels (B, N, 2) of all marks of the scheme."""
        return view_for_user(self.pixels_last)


class SchemeRows(NamedTuple):
    """Rows of one of two schemes that a condition reads."""

    error: BlockRows  # (k,)
    images: Sequence[BlockRows]  # pixels (N, 2)


class CompiledCondition(ABC):
    """Base of conditions that compiled stages compute, and that Python can evaluate as well."""

    @abstractmethod
    def stages(self, program: Program, first: SchemeRows, second: SchemeRows) -> BlockRows:
        """Add the stage of the condition; return a row that is 1 if it holds, else 0."""

    def holds(self, first: SchemeState, second: SchemeState) -> NDArray[np.bool_]:
        """Return whether the condition holds in each run.

        Parameters
        ----------
        first, second : SchemeState
            States of the two schemes in B runs.

        Returns
        -------
        ndarray of bool of shape (B,)
            True if the condition holds in the run.
        """

        def add(
            program: Program, e: BlockRows, x: BlockRows, e2: BlockRows, x2: BlockRows
        ) -> list[BlockRows]:
            return [self.stages(program, SchemeRows(e, [x]), SchemeRows(e2, [x2]))]

        arrays = [x for one in (first, second) for x in (one.error_last, one.pixels_last)]
        (truth,) = evaluate_stages(add, arrays)
        return np.asarray(truth > 0.0)


def as_compiled_condition(condition: Any) -> CompiledCondition | None:
    """Return a condition that consists of stages, or None if Python evaluates it."""
    ours = isinstance(condition, CompiledCondition)
    return condition if ours and type(condition).holds is CompiledCondition.holds else None


CONDITIONS = family("condition")
CONDITION = KindOf(CONDITIONS, short=False, protocol=Condition)


@register("condition", "error_below")
@dataclass(frozen=True)
class ErrorBelow(CompiledCondition, DeclaredValue):
    """Condition: the largest |e| of the first (or second) scheme is below a value.

    Use it in a `Switch` to hand over to a second scheme near the goal. The value has the unit of
    the features of the scheme, such as pixels or metres and radians.

    Examples
    --------
    >>> from robsim.servo.tasks.conditions import SchemeState
    >>> near, none = np.array([[0.01, 0.2], [-0.02, 0.0]]), np.empty((0, 2))
    >>> state = SchemeState(near, near, near, np.empty((0, 2, 2)))
    >>> ErrorBelow(0.05).holds(state, state)  # two runs
    array([ True, False])
    """

    value: Annotated[
        float, Number(above=0), "Bound of the largest |e|, in the unit of the features."
    ]
    of: Annotated[str, Word(("first", "second"), "scheme"), "Scheme with the compared error."] = (
        "first"
    )

    def stages(self, program: Program, first: SchemeRows, second: SchemeRows) -> BlockRows:
        """Add the stage of the condition; return its row."""
        error, bound = (first if self.of == "first" else second).error, program.constant(self.value)
        return program.result(kernels.compare_error_bound, "out", error=error, bound=bound)


@register("condition", "near_border")
@dataclass(frozen=True)
class NearBorder(CompiledCondition, DeclaredValue):
    """Condition: a mark is within `margin` pixels of the border of the image.

    Use it in a `Switch` to hand over to `IBVS` before a scheme loses its target. It reads the
    marks of the first scheme.

    Examples
    --------
    >>> from robsim.servo.tasks.conditions import SchemeState
    >>> pixels = np.array([[[320.0, 630.0], [240.0, 240.0]]])  # one mark (column, row) in two runs
    >>> state = SchemeState(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)), pixels)
    >>> NearBorder(20, (640, 480)).holds(state, state)
    array([False,  True])
    """

    margin: Annotated[
        float,
        Number(above=0, unit="px"),
        "Distance of a mark from the border of the image, below which the condition holds.",
    ]
    size: Annotated[tuple[int, int], SIZE, "Width and height of the image in pixels."]

    def stages(self, program: Program, first: SchemeRows, second: SchemeRows) -> BlockRows:
        """Add the stage of the condition; return its row."""
        numbers = program.constant([self.margin, *np.subtract(self.size, 1)])
        images = [(pixels,) for pixels in first.images]
        return program.result(kernels.detect_near_border, "out", numbers=numbers, images=images)
