"""The base of features that compare pictures with the picture at the goal."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import GoalError, InputError
from robsim.base.value import replace_unchecked
from robsim.declare import DeclaredValue, Integer
from robsim.features.feature import Observation, check_goal_observation
from robsim.features.images.picture_plane import Pixels, build_picture_plane
from robsim.kernels.image_features.picture_sums import measure_contrasts, reduce_pictures

LEAST_CONTRAST = 0.05  # share of the contrast at the goal below which nothing is in view
LEAST_DEVIATION = 0.5  # grey values: a picture with less contrast is constant
Border = Annotated[
    int, Integer(3, 1000), "Pixels along the border of the picture that are not used."
]
Level = Annotated[
    int, Integer(0, 6), "Level of the pyramid: pixels are means of 2^level x 2^level pixels."
]


class PictureFeature(DeclaredValue):
    """Base of features that know the picture at the goal, with a border and a level of pixels."""

    uses_pictures: ClassVar[bool] = True
    uses_depth: ClassVar[bool] = True

    border: int
    level: int
    goal: Observation | None

    def towards(self, goal: Observation) -> Self:
        """Return the feature relative to the picture at the goal.

        Parameters
        ----------
        goal : Observation
            Observation with the pictures at the goal.

        Returns
        -------
        PictureFeature
            The feature relative to these pictures.

        Raises
        ------
        InputError
            If `goal` is not an Observation, or the border leaves no pixels.
        GoalError
            If there is no picture at the goal, or it is constant.
        """
        shown = check_goal_observation(goal, type(self).__name__)
        if shown.pictures is None:
            raise GoalError(f"{type(self).__name__}: there is no picture at the goal")
        build_picture_plane(shown.camera.of_run(0), self.border, self.level)  # checks the border
        at_goal = replace_unchecked(self, goal=shown)
        if (at_goal.measure_contrasts(shown.pictures) < LEAST_DEVIATION).any():
            raise GoalError(
                f"{type(self).__name__}: the picture at the goal is constant; expected a picture "
                "with texture inside its border"
            )
        return at_goal

    def get_pictures(self, seen: Observation) -> NDArray[np.uint8]:
        """Return the pictures (B, h, w) of an observation; raise InputError without a picture."""
        if seen.pictures is None or self.goal is None:
            missing = "a goal: call towards first" if self.goal is None else "pictures"
            raise InputError(f"{type(self).__name__} needs {missing}")
        return seen.pictures

    def measure_contrasts(self, pictures: NDArray[np.uint8]) -> Array:
        """Return the standard deviations (B,) of the grey values of pictures (B, h, w)."""
        contrasts = np.empty(len(pictures))
        measure_contrasts(pictures, self.border, contrasts)
        return contrasts

    def reduce_pictures(self, pictures: NDArray[np.uint8]) -> Pixels:
        """Return pictures (B, h, w) at the level of the feature."""
        block = 2**self.level
        count, height, width = pictures.shape
        images = np.empty((count, height // block, width // block), dtype=np.float32)
        reduce_pictures(pictures, block, images)
        return images
