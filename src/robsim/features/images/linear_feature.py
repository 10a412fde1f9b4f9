"""Features that are linear in the grey values of a picture."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import KW_ONLY, dataclass, field
from typing import Annotated, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import GoalError
from robsim.base.value import replace_unchecked
from robsim.declare import DeclaredValue, Integer, Number
from robsim.features.feature import Observation, check_goal_observation
from robsim.features.images.dense_feature import LEAST_CONTRAST, LEAST_DEVIATION
from robsim.features.images.goal_pictures_of_runs import (
    GoalPicture,
    PreparedGoals,
    get_inverse_depth,
)
from robsim.features.images.picture_plane import PicturePlane, Pixels, build_picture_plane
from robsim.kernels.formulas.perspective import IN_IMAGE, NOTHING_IN_VIEW
from robsim.kernels.image_features.linear_features import project_luminance_rows, project_pictures
from robsim.kernels.image_features.luminance_rows import CENTRAL
from robsim.kernels.image_features.picture_levels import reduce_pictures
from robsim.kernels.image_features.picture_sums import measure_contrasts


class LinearGoal(NamedTuple):
    """The pixels of the pictures of a run, the basis (k, N) of its feature, and the contrast."""

    plane: PicturePlane
    basis: Pixels
    contrast: float


@dataclass(frozen=True, eq=False)
class LinearFeature(PreparedGoals[LinearGoal], DeclaredValue):
    """Base of features s = B I of the grey values I of a picture, with L = B L_I.

    The basis B (k, N) is constant. L_I (N, 6) is the interaction matrix of the luminance.
    """

    uses_pictures: ClassVar[bool] = True
    uses_depth: ClassVar[bool] = True

    tolerance: Annotated[
        float,
        Number(above=0, unit="grey values"),
        "Largest |e| at convergence, in the unit of the feature.",
    ] = 0.2
    _: KW_ONLY
    step: Annotated[
        float | None,
        Number(above=0, unit="m, rad"),
        "Largest remaining step of the camera at convergence; None: the error alone decides.",
    ] = 1e-4
    border: Annotated[
        int, Integer(3, 1000), "Pixels along the border of the picture that are not used."
    ] = 4
    level: Annotated[
        int, Integer(0, 6), "Level of the pyramid: pixels are means of 2^level x 2^level pixels."
    ] = 0

    goal: Observation | None = field(default=None, init=False, repr=False)

    @property
    def unit(self) -> str:
        """Unit of s."""
        return "grey"

    @abstractmethod
    def build_basis(self, plane: PicturePlane, image: Pixels, inverse_depth: Array) -> Array:
        """Return the basis (k, N), from the pixels, picture and inverse depth at the goal."""

    def towards(self, goal: Observation) -> Self:
        """Return the feature with the basis of the picture at the goal.

        Parameters
        ----------
        goal : Observation
            Observation with the pictures at the goal.

        Returns
        -------
        LinearFeature
            The feature relative to these pictures.

        Raises
        ------
        InputError
            If `goal` is not an Observation.
        GoalError
            If there is no picture at the goal, or it is constant.
        """
        shown = check_goal_observation(goal, type(self).__name__)
        if shown.pictures is None:
            raise GoalError(f"{type(self).__name__}: there is no picture at the goal")
        at_goal = replace_unchecked(self, goal=shown)
        if any(each.contrast < LEAST_DEVIATION for _, each in at_goal.split_runs(shown)):
            raise GoalError(
                f"{type(self).__name__}: the picture at the goal is constant; expected a picture "
                "with texture inside its border"
            )
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
            images = self._reduce_pictures(seen, part)
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
            images = self._reduce_pictures(seen, part)
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
            assert seen.pictures is not None
            contrast = self._measure_contrasts(seen.pictures[part])
            empty = contrast < LEAST_CONTRAST * goal.contrast
            parts.append(np.where(empty, NOTHING_IN_VIEW, IN_IMAGE))
        return np.concatenate(parts)

    def prepare_goal(self, shown: GoalPicture) -> LinearGoal:
        """Return the pixels, the basis and the contrast at the goal of a run."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self._reduce(shown.picture[None])
        contrast = self._measure_contrasts(shown.picture[None])
        basis = np.zeros((0, plane.padded_count), dtype=np.float32)
        if contrast[0] >= LEAST_DEVIATION:
            numbers = self.build_basis(plane, image[0], shown.inverse_depth)
            basis = np.zeros((len(numbers), plane.padded_count), dtype=np.float32)
            basis[:, : plane.pixel_count] = numbers
        return LinearGoal(plane, basis, float(contrast[0]))

    def _measure_contrasts(self, pictures: NDArray[np.uint8]) -> Array:
        """Return the standard deviations (b,) of the grey values of pictures (b, h, w)."""
        contrasts = np.empty(len(pictures))
        measure_contrasts(pictures, self.border, contrasts)
        return contrasts

    def _reduce_pictures(self, seen: Observation, part: slice) -> Pixels:
        """Return the pictures (b, h, w) of some runs at the level of the feature."""
        assert seen.pictures is not None
        return self._reduce(seen.pictures[part])

    def _reduce(self, pictures: NDArray[np.uint8]) -> Pixels:
        """Return pictures (b, h, w) at the level of the feature."""
        block = 2**self.level
        count, height, width = pictures.shape
        images = np.empty((count, height // block, width // block), dtype=np.float32)
        reduce_pictures(pictures, block, images)
        return images
