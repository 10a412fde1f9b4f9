"""Photometric Gaussian mixtures: the luminance of blurred pictures."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Number, register
from robsim.features.feature import Observation
from robsim.features.images.dense_feature import DenseFeature, NormalEquations
from robsim.features.images.gaussian_blur import (
    BlurredGoal,
    Gaussians,
    build_blurred_goal,
    build_gaussians,
)
from robsim.features.images.goal_pictures_of_runs import (
    GoalPicture,
    PreparedGoals,
    get_inverse_depth,
    make_equations,
)
from robsim.features.images.luminance import MODELS
from robsim.features.images.picture_plane import Pixels, build_picture_plane
from robsim.kernels.image_features.blurred_pictures import find_shares_of_contrast
from robsim.kernels.image_features.blurred_rows import compute_blurred_equations

STEP_OF_EXTENSIONS = 1.4  # largest ratio of successive extensions
EXTENSION_OF_SHARE = 2.0  # extension over the motion of the picture that it is chosen for


@register("feature", "photometric_mixture")
@dataclass(frozen=True, eq=False)
class PhotometricMixture(PreparedGoals[BlurredGoal], DenseFeature):
    """Mixture of Gaussians, one at each pixel: the luminance of blurred pictures.

    Each pixel spreads its grey value by a Gaussian of the extension sigma, so that the mixture

        G(x) = sum over u of I(u) g_sigma(x - u)

    is the blurred picture (Crombez, Mouaddib, Caron and Chaumette 2019, "Visual servoing with
    photometric Gaussian mixtures as dense features", IEEE T-RO 35(1); there without the factor of
    the Gaussian). Its L is the L of the luminance of G and, as a motion also spreads or squeezes
    the grey values within a Gaussian, the term of the second derivatives

        -sigma^2 (dp_i/du_j) d2G/du_i du_j

    of the velocity p of the pixels. The wider the Gaussians, the wider is the basin, and the less
    exact the end. The extension therefore follows the pictures: with the share r of the difference
    of the widest mixtures in their contrast, it is 2 r `extension`, but at least
    `final_extension`. It depends on the present picture alone.

    Extensions up to a tenth of the width of the picture help. Wide Gaussians need a border of about
    one extension, since the picture ends there.

    Raises
    ------
    InputError
        If `final_extension` is larger than `extension`.
    GoalError
        By `simulate`, if the picture at the goal is constant.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[40, 0, 19.5], [0, 40, 14.5], [0, 0, 1]], size=(40, 30))
    >>> y, x = np.mgrid[:30, :40]
    >>> goal = np.rint(128 + 50 * np.sin(x / 4) + 40 * np.cos(y / 3)).astype(np.uint8)
    >>> at_goal, now = (
    ...     Observation.of([[20, 15]], [1.0], camera, pictures=each)
    ...     for each in (goal, np.roll(goal, 1, axis=1))
    ... )
    >>> feature = PhotometricMixture(extension=3.0, border=4).towards(at_goal)
    >>> feature.find_extensions(at_goal), feature.find_extensions(now).round(2)
    (array([1.]), array([1.32]))
    """

    _: KW_ONLY
    extension: Annotated[
        float, Number(above=0, most=200, unit="px"), "Largest extension of the Gaussians."
    ] = 6.0
    final_extension: Annotated[
        float, Number(above=0, most=200, unit="px"), "Extension of the Gaussians at the goal."
    ] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.final_extension > self.extension:
            raise InputError(
                f"PhotometricMixture: final_extension {self.final_extension} is larger than "
                f"extension {self.extension}"
            )

    @cached_property
    def gaussians(self) -> Gaussians:
        """The Gaussians, the widest first, in equal ratios of at most 1.4."""
        ratio = self.extension / self.final_extension
        count = 1 + int(np.ceil(np.log(ratio) / np.log(STEP_OF_EXTENSIONS) - 1e-9))
        return build_gaussians(np.geomspace(self.extension, self.final_extension, count))

    @cached_property
    def terms(self) -> Array:
        """The numbers (n, 2) of the blur in L, see `compute_blurred_rows`."""
        return np.stack([self.gaussians.deviations**2, 0.0 * self.gaussians.deviations], axis=1)

    def find_extensions(self, seen: Observation) -> Array:
        """Return the extensions (B,) in pixels that the pictures of B runs are given.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        images = self.reduce_pictures(self.get_pictures(seen))
        parts = self.split_runs(seen)
        level = np.concatenate([self._find_levels(images[part], goal) for part, goal in parts])
        extensions: Array = self.gaussians.deviations[level]
        return extensions

    def compute_normal_equations(self, seen: Observation) -> NormalEquations:
        """Return the normal equations of the difference of mixtures from the goal.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        NormalEquations
            Their means over the pixels, in squares of grey values.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        images, near = self.reduce_pictures(self.get_pictures(seen)), get_inverse_depth(seen)
        out = make_equations(len(images))
        for part, goal in self.split_runs(seen):
            level = self._find_levels(images[part], goal)
            window = goal.plane.border, goal.plane.points, goal.plane.slopes
            compute_blurred_equations(
                self.gaussians.blur(images[part], level),
                goal.images,
                goal.rows,
                goal.products,
                level,
                MODELS[self.interaction_model],
                self.terms[level],
                window,
                near[part],
                *(each[part] for each in out),
            )
        return out

    def prepare_goal(self, shown: GoalPicture) -> BlurredGoal:
        """Return the mixtures at the goal of a run, of each extension, and their L."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self.reduce_pictures(shown.picture[None])[0]
        return build_blurred_goal(image, plane, shown.inverse_depth, self.gaussians, self.terms)

    def _find_levels(self, images: Pixels, goal: BlurredGoal) -> NDArray[np.int64]:
        """Return the number (B,) of the Gaussian of each picture."""
        widest = self.gaussians.blur(images, np.zeros(len(images), dtype=np.int64))
        share = np.empty(len(images))
        find_shares_of_contrast(widest, goal.images[0], goal.plane.border, share)
        wanted = np.minimum(EXTENSION_OF_SHARE * share, 1.0) * self.extension
        narrower = (self.gaussians.deviations[None, :] >= wanted[:, None]).sum(axis=1)
        level: NDArray[np.int64] = np.maximum(narrower - 1, 0).astype(np.int64)
        return level
