"""Conditions on which a task switches from one scheme to another."""

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
from robsim.kernels.machine.program import Program, evaluated
from robsim.vision.image_size import SIZE


@runtime_checkable
class Condition(Protocol):
    """The interface of a condition: any object with this method."""

    def holds(self, first: SchemeState, second: SchemeState) -> NDArray[np.bool_]:
        """Return truth values (B,): in which runs the condition holds."""


@dataclass(frozen=True, eq=False)
class SchemeState:
    """What a condition sees of one of two schemes: its features, error and command, run first."""

    s_last: Array
    error_last: Array
    qd_last: Array
    pixels_last: Array  # (N, 2, B) of all its marks, as measured

    @property
    def s(self) -> Array:
        """The features s (B, k)."""
        return view_for_user(self.s_last)

    @property
    def error(self) -> Array:
        """The error s - s_goal (B, k)."""
        return view_for_user(self.error_last)

    @property
    def qd(self) -> Array:
        """The commanded velocities qd (B, n)."""
        return view_for_user(self.qd_last)

    @property
    def pixels(self) -> Array:
        """The measured pixels (B, N, 2) of all its marks."""
        return view_for_user(self.pixels_last)


class SchemeRows(NamedTuple):
    """The rows of what a condition sees of one of two schemes."""

    error: BlockRows  # (k,)
    images: Sequence[BlockRows]  # pixels (N, 2)


class CompiledCondition(ABC):
    """The base of conditions that are stages of a program, and can be asked in Python as well."""

    @abstractmethod
    def stages(self, program: Program, first: SchemeRows, second: SchemeRows) -> BlockRows:
        """Add the stage of the condition, and return the row in which it is 1 where it holds."""

    def holds(self, first: SchemeState, second: SchemeState) -> NDArray[np.bool_]:
        """Return truth values (B,): in which runs the condition holds."""

        def add(
            program: Program, e: BlockRows, x: BlockRows, e2: BlockRows, x2: BlockRows
        ) -> list[BlockRows]:
            return [self.stages(program, SchemeRows(e, [x]), SchemeRows(e2, [x2]))]

        given = [x for one in (first, second) for x in (one.error_last, one.pixels_last)]
        (found,) = evaluated(add, given)
        return np.asarray(found > 0.0)


def as_compiled_condition(condition: Any) -> CompiledCondition | None:
    """Return a condition that is made of stages; None if a user's class is asked in Python."""
    ours = isinstance(condition, CompiledCondition)
    return condition if ours and type(condition).holds is CompiledCondition.holds else None


CONDITIONS = family("condition")
CONDITION = KindOf(CONDITIONS, short=False, protocol=Condition)


@register("condition", "error_below")
@dataclass(frozen=True)
class ErrorBelow(CompiledCondition, DeclaredValue):
    """The condition that the largest |e| of the first scheme (or the second) is below a value.

    >>> ErrorBelow(0.05).of
    'first'
    """

    value: Annotated[
        float, Number(above=0), "Bound of the largest |e|, in the unit of the features."
    ]
    of: Annotated[str, Word(("first", "second"), "scheme"), "Scheme whose error is compared."] = (
        "first"
    )

    def stages(self, program: Program, first: SchemeRows, second: SchemeRows) -> BlockRows:
        """Add the stage of the condition, and return its row."""
        error, bound = (first if self.of == "first" else second).error, program.constant(self.value)
        return program.result(kernels.compare_error_bound, "out", error=error, bound=bound)


@register("condition", "near_border")
@dataclass(frozen=True)
class NearBorder(CompiledCondition, DeclaredValue):
    """The condition that a mark is within `margin` pixels of the border of the image.

    >>> NearBorder(20, (640, 480)).margin
    20.0
    """

    margin: Annotated[
        float,
        Number(above=0, unit="px"),
        "Distance of a mark from the border below which the condition holds.",
    ]
    size: Annotated[tuple[int, int], SIZE, "Width and height of the image in pixels."]

    def stages(self, program: Program, first: SchemeRows, second: SchemeRows) -> BlockRows:
        """Add the stage of the condition, and return its row."""
        numbers = program.constant([self.margin, *np.subtract(self.size, 1)])
        images = [(pixels,) for pixels in first.images]
        return program.result(kernels.detect_near_border, "out", numbers=numbers, images=images)
