"""Weightings: how much each mark, or each number that is made of it, counts in a servo task.

With weights w the command is the least-squares one of diag(w) L and diag(w) e. Where several
weightings are given, their weights multiply.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

from robsim.base.arrays import Array, view_for_user
from robsim.declare import KindOf, ListOf, family
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.controller_rows import ControllerInputs, ViewRows

WEIGHTINGS = family("weighting")


class MarkRows(NamedTuple):
    """The rows of the N marks of a sight, of which a weighting makes weights (N,)."""

    given: ControllerInputs
    N: int
    view: (
        ViewRows  # pixels as measured, NaN where none are; a hidden mark is where it was seen last
    )
    camera: BlockRows  # as `robsim.kernels.images.projection` has it
    there: BlockRows  # (N,) 1 where a mark is measured in this image, else 0
    goal: Array  # (N, 2, runs) pixels at the goal, or (N, 2, 1) of all runs


class ComponentGroup(NamedTuple):
    """The numbers of s that are made of the same marks by one feature."""

    part: int  # number of the feature among those of the task
    numbers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Residuals:
    """What a weighting of a user's is shown of B runs, with the run first.

    error       s - s_goal (B, k), zero where nothing is there
    weights     weights (B, k) by marks, zero where nothing is there
    tolerances  (k,) in the units of s
    groups      the numbers that are made of the same marks, of each mark or set of marks
    """

    error_last: Array
    weights_last: Array
    tolerances: Array
    groups: tuple[ComponentGroup, ...]

    @property
    def error(self) -> Array:
        """The error (B, k)."""
        return view_for_user(self.error_last)

    @property
    def weights(self) -> Array:
        """The weights (B, k) by marks."""
        return view_for_user(self.weights_last)


@runtime_checkable
class Weighting(Protocol):
    """The interface of a weighting: any object with this method, asked at every step."""

    def weigh(self, now: Residuals) -> Array:
        """Return weights (B, k) from 0 to 1, of each number of s in each run."""


class MarkWeighting(ABC):
    """The base of weightings by the image of each mark, which come before the features."""

    excuses: ClassVar[bool] = False  # whether marks may leave the image without ending the run
    fades: ClassVar[bool] = False  # whether a mark may still count where it is hidden
    by_goal: ClassVar[bool] = False  # whether it needs the image of the marks at the goal
    least_marks: ClassVar[int] = 1  # of a target

    @abstractmethod
    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stages of the weights of the marks of a sight, and return their rows (N,)."""


WEIGHTING = KindOf(WEIGHTINGS, protocol=Weighting)
WEIGHTING_LIST = ListOf(WEIGHTING, most=16, alone=True)
