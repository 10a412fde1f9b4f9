"""Features that are linear in the grey values of a picture."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from typing import Annotated, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare import Number
from robsim.features.feature import Observation
from robsim.features.images.goal_pictures_of_runs import (
    GoalPicture,
    PreparedGoals,
    get_inverse_depth,
)
from robsim.features.images.picture_feature import LEAST_CONTRAST, Border, Level, PictureFeature
from robsim.features.images.picture_plane import PicturePlane, Pixels, build_picture_plane
from robsim.kernels.formulas.perspective import IN_IMAGE, NOTHING_IN_VIEW
from robsim.kernels.image_features.linear_features import project_luminance_rows, project_pictures
from robsim.kernels.image_features.luminance_rows import CENTRAL


class LinearGoal(NamedTuple):
    """The pixels of the pictures of a run, the basis (k, N) of its feature, and the contrast."""

    plane: PicturePlane
    basis: Pixels
    contrast: float


@dataclass(frozen=True, eq=False)
class LinearFeature(PreparedGoals[LinearGoal], PictureFeature):
    """Base of features s = B I of the grey values I of a picture, with L = B L_I.

    The basis B (k, N) is constant. L_I (N, 6) is the interaction matrix of the luminance.
    """

    tolerance: Annotated[
        float,
        Number(above=0, unit="grey values"),
        "Largest |e| at convergence, in the unit of the feature.",
    ] = 0.2
    _: KW_ONLY
    step: Annotated[
        float,
        Number(above=0, unit="m, rad"),
        "Largest remaining step of the camera at convergence.",
    ] = 1e-4
    border: Border = 4
    level: Level = 0

    goal: Observation | None = field(default=None, init=False, repr=False)

    @property
    def unit(self) -> str:
        """Unit of s."""
        return "grey"

    @abstractmethod
    def build_basis(self, plane: PicturePlane, image: Pixels, inverse_depth: Array) -> Array:
        """Return the basis (k, N), from the pixels, picture and inverse depth at the goal."""

    def towards(self, goal: Observation) -> Self:
        """Return the feature with the basis of the picture at the goal."""
        at_goal = super().towards(goal)
        list(at_goal.split_runs(goal))  # a basis that does not fit is an error of the goal
        return at_goal

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
        parts = []
        for part, goal in self.split_runs(seen):
            images = self.reduce_pictures(self.get_pictures(seen)[part])
            s = np.empty((len(images), len(goal.basis)))
            project_pictures(images, goal.plane.border, goal.basis, s)
            parts.append(s)
        return np.concatenate(parts)

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of shape (B, k, 6)
            Interaction matrix L with sdot = L V_c.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        parts, near = [], get_inverse_depth(seen)
        for part, goal in self.split_runs(seen):
            images = self.reduce_pictures(self.get_pictures(seen)[part])
            window = goal.plane.border, CENTRAL, goal.plane.points, goal.plane.slopes
            L = np.empty((len(images), len(goal.basis), 6))
            project_luminance_rows(images, goal.basis, window, near[part], L)
            parts.append(L)
        return np.concatenate(parts)

    def find_faults(self, seen: Observation) -> NDArray[np.int64]:
        """Return the status of each picture (B,): in view, or empty.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        ndarray of int, shape (B,)
            IN_IMAGE or NOTHING_IN_VIEW of `robsim.kernels.formulas.perspective`.
        """
        parts = []
        for part, goal in self.split_runs(seen):
            contrast = self.measure_contrasts(self.get_pictures(seen)[part])
            empty = contrast < LEAST_CONTRAST * goal.contrast
            parts.append(np.where(empty, NOTHING_IN_VIEW, IN_IMAGE))
        return np.concatenate(parts)

    def prepare_goal(self, shown: GoalPicture) -> LinearGoal:
        """Return the pixels, the basis and the contrast at the goal of a run."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self.reduce_pictures(shown.picture[None])[0]
        numbers = self.build_basis(plane, image, shown.inverse_depth)
        basis = np.zeros((len(numbers), plane.padded_count), dtype=np.float32)
        basis[:, : plane.pixel_count] = numbers
        return LinearGoal(plane, basis, float(self.measure_contrasts(shown.picture[None])[0]))
