"""Features of pictures that are functions in Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_positive
from robsim.base.errors import GoalError, InputError, format_value
from robsim.base.value import replace_unchecked
from robsim.features.feature import Observation, check_goal_observation
from robsim.features.numeric_interaction import difference_interaction

PictureCall = Callable[[NDArray[Any], NDArray[Any]], ArrayLike]


@dataclass(frozen=True, eq=False)
class _PictureCalls:
    """Base of features that call a function with the pictures and the pictures at the goal."""

    uses_pictures: ClassVar[bool] = True

    function: PictureCall
    unit: str = "1"
    tolerance: float = 1e-3
    goal_pictures: NDArray[np.uint8] | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise InputError(f"function: expected a function, got {format_value(self.function)}")
        as_positive(self.tolerance, "tolerance")

    def towards(self, goal: Observation) -> Self:
        """Return the feature with the pictures at the goal.

        Parameters
        ----------
        goal : Observation
            Observation with the pictures at the goal.

        Returns
        -------
        PictureFunction or PictureTwist
            The feature with these pictures.

        Raises
        ------
        InputError
            If `goal` is not an Observation.
        GoalError
            If there is no picture at the goal.
        """
        shown = check_goal_observation(goal, type(self).__name__)
        if shown.pictures is None:
            raise GoalError(f"{type(self).__name__}: there is no picture at the goal")
        return replace_unchecked(self, goal_pictures=shown.pictures)

    def _call(self, function: PictureCall, seen: Observation) -> Array:
        """Return the values of a function of pictures (B, h, w) and their goals (B, h, w)."""
        if seen.pictures is None or self.goal_pictures is None:
            missing = "pictures" if seen.pictures is None else "a goal: call towards first"
            raise InputError(f"{type(self).__name__} needs {missing}")
        goals, count = self.goal_pictures, len(seen.pictures)
        if len(goals) > 1 and seen.runs is not None:
            goals = goals[seen.runs]
        shown = np.broadcast_to(goals, (count, *goals.shape[1:]))
        return np.asarray(function(seen.pictures, shown), dtype=float)


@dataclass(frozen=True, eq=False)
class PictureFunction(_PictureCalls):
    """Feature of your own: a function of pictures and their goals.

    Parameters
    ----------
    function : callable
        `function(pictures, goal_pictures)` returns s (B, k) for grey values (B, h, w) of B runs.
    unit : str, default "1"
        Unit of s.
    tolerance : float, default 1e-3
        Largest |e| at convergence.
    interaction_function : callable, optional
        `interaction_function(pictures, goal_pictures)` returns L (B, k, 6) with sdot = L V_c.
        Default: differences of s of pictures that are warped by small motions of the camera before
        the plane of the target.

    Raises
    ------
    InputError
        If a function is not callable, or the tolerance is not positive; by `simulate`, if it
        returns an array of another shape.

    Examples
    --------
    The mean grey value of four quarters of the picture:

    >>> def quarters(pictures, goal_pictures):
    ...     B, h, w = pictures.shape
    ...     parts = pictures.reshape(B, 2, h // 2, 2, w // 2)
    ...     return parts.mean(axis=(2, 4)).reshape(B, 4)
    >>> import robsim as rs
    >>> feature = rs.features.PictureFunction(quarters, unit="grey", tolerance=0.5)
    >>> feature.unit, feature.tolerance
    ('grey', 0.5)
    """

    interaction_function: PictureCall | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        own = self.interaction_function
        if own is not None and not callable(own):
            raise InputError(f"interaction_function: expected a function, got {format_value(own)}")

    def measure(self, seen: Observation) -> Array:
        """Return the features.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, k)
            Features s.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        return self._call(self.function, seen)

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix, of the own function or by differences.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, k, 6)
            Interaction matrix L.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        if self.interaction_function is None:
            return difference_interaction(self, seen)
        return self._call(self.interaction_function, seen)


@dataclass(frozen=True, eq=False)
class PictureTwist(_PictureCalls):
    """Law of your own from pictures to a twist of the camera, such as a network.

    The error is s = -V with L = I and s_goal = 0, so that a task with a gain of 1 commands the
    twist V itself, and the joints of any robot follow it as well as they can.

    Parameters
    ----------
    function : callable
        `function(pictures, goal_pictures)` returns twists V (B, 6) = (v, omega) in camera axes, in
        m/s and rad/s, for grey values (B, h, w) of B runs.
    unit : str, default "1"
        Unit of s.
    tolerance : float, default 1e-3
        Largest |V| at convergence.

    Raises
    ------
    InputError
        If the function is not callable, or the tolerance is not positive; by `simulate`, if it
        returns an array of another shape.

    Examples
    --------
    >>> import robsim as rs
    >>> stop = rs.features.PictureTwist(lambda pictures, goals: np.zeros((len(pictures), 6)))
    >>> stop.tolerance
    0.001
    """

    zero_at_goal: ClassVar[bool] = True

    def measure(self, seen: Observation) -> Array:
        """Return the error.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, 6)
            Error s = -V.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        return -self._call(self.function, seen)

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, 6, 6)
            Identity matrices.
        """
        assert seen.pictures is not None
        return np.broadcast_to(np.eye(6), (len(seen.pictures), 6, 6))
