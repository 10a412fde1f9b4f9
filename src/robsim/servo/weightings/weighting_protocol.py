"""Weightings: weights of the marks, or of the components of s, in a servo task.

With weights w the law uses diag(w) L and diag(w) e, the weighted least squares. The weights of
several weightings multiply.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

from robsim.base.arrays import Array, view_for_user
from robsim.declare import KindOf, ListOf, family
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.controller_rows import ControllerInputs, ViewRows

WEIGHTINGS = family("weighting")


class MarkRows(NamedTuple):
    """Rows of the N marks of a camera-target pair, the input of a weighting."""

    inputs: ControllerInputs
    N: int
    view: ViewRows  # measured pixels, or NaN; a hidden mark keeps its last measured pixels
    camera: BlockRows  # in the order of `robsim.kernels.images.projection`
    present: BlockRows  # (N,) 1 for a mark measured in this image, else 0
    goal: Array  # (N, 2, runs) pixels at the goal, or (N, 2, 1) for all runs


class ComponentGroup(NamedTuple):
    """Components of s that one feature computes from the same marks."""

    part: int  # index of the feature in the task
    numbers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Residuals:
    """Input of a user's weighting, for B runs.

    Attributes
    ----------
    error_last : ndarray of shape (k, B)
        Error s - s_goal, zero for components without a measurement.
    weights_last : ndarray of shape (k, B)
        Weights from the marks, zero for components without a measurement.
    tolerances : ndarray of shape (k,)
        Tolerances in the units of s.
    groups : tuple of ComponentGroup
        Components computed from the same marks, one group for each mark or set of marks.
    """

    error_last: Array
    weights_last: Array
    tolerances: Array
    groups: tuple[ComponentGroup, ...]

    @property
    def error(self) -> Array:
        """Error (B, k)."""
        return view_for_user(self.error_last)

    @property
    def weights(self) -> Array:
        """Weights (B, k) from the marks."""
        return view_for_user(self.weights_last)


@runtime_checkable
class Weighting(Protocol):
    """Protocol of a weighting: any object with this method, called at every step.

    Examples
    --------
    >>> class FirstMark:  # counts twice as much as the other marks
    ...     def weigh(self, now):
    ...         weights = np.full(now.error.shape, 0.5)
    ...         weights[:, list(now.groups[0].numbers)] = 1.0
    ...         return weights
    >>> now = Residuals(np.zeros((4, 1)), np.ones((4, 1)), np.ones(4), (ComponentGroup(0, (0, 1)),))
    >>> FirstMark().weigh(now)
    array([[1. , 1. , 0.5, 0.5]])
    """

    def weigh(self, now: Residuals) -> Array:
        """Return the weights of the components of s.

        Parameters
        ----------
        now : Residuals
            Error, and weights from the marks, of B runs.

        Returns
        -------
        ndarray of shape (B, k)
            Weights from 0 to 1.
        """


class MarkWeighting(ABC):
    """Base of weightings by the image of each mark, evaluated before the features."""

    excuses: ClassVar[bool] = False  # whether marks may leave the image without ending the run
    fades: ClassVar[bool] = False  # whether a hidden mark may still count
    by_goal: ClassVar[bool] = False  # whether it needs the image of the marks at the goal
    least_marks: ClassVar[int] = 1  # smallest number of marks of a target

    @abstractmethod
    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stages of the weights of the marks of a pair; return their rows (N,)."""


# weightings, or their names
Weights = Weighting | MarkWeighting | str | Sequence[Weighting | MarkWeighting | str]
WEIGHTING = KindOf(WEIGHTINGS, protocol=Weighting)
WEIGHTING_LIST = ListOf(WEIGHTING, most=16, alone=True)
