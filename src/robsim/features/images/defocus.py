"""The luminance of a camera that is focused beside the object."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Flag, Length, Number, register
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
from robsim.features.images.picture_plane import build_picture_plane
from robsim.kernels.image_features.blurred_rows import compute_blurred_equations

DEVIATION_OF_DISC = 0.25  # standard deviation along an axis over the diameter of a uniform disc


@register("feature", "defocus")
@dataclass(frozen=True, eq=False)
class Defocus(PreparedGoals[BlurredGoal], DenseFeature):
    """Luminance of a camera that is focused before or behind the object.

    A point at the depth Z, seen through a thin lens of the focal length f with the f-number N that
    is focused at F, becomes a disc of the diameter f^2 |Z - F| / (N Z (F - f)) on the sensor. The
    picture is blurred by a Gaussian of the same variance, sigma(Z) = diameter/4. Its grey values
    change with the picture and with the blur,

        dG/dt = -grad G . p - sigma^2 (dp_i/du_j) d2G/du_i du_j + sigma sigma' (G_uu + G_vv) dZ/dt

    with the velocity p of the pixels, sigma' = d sigma/dZ and dZ/dt = -v_z - y Z w_x + x Z w_y
    (Caron 2021, "Defocus-based direct visual servoing", IEEE RA-L 6(2)). Blur widens the basin as
    `PhotometricMixture` does, without a computation on a real camera. Focus the camera such that
    the blur grows with the distance from the goal, and vanishes nearly at the goal.

    With ``simulated=True`` the feature blurs the sharp pictures of a scene itself, by sigma at the
    believed depth on the optical axis. Pictures of a real lens are already blurred: then set it to
    False. The depth decides on the blur, so the depth of the task should be "true" or filtered.

    Raises
    ------
    InputError
        If the camera is focused nearer than its focal length.
    GoalError
        By `simulate`, if the picture at the goal is constant.

    Examples
    --------
    >>> lens = Defocus(focal_length=0.02, f_number=1.0, focus=0.52, pixel=1e-4)
    >>> sigma, slope = lens.find_blur(1.0)
    >>> round(sigma, 9), round(slope, 9)
    (0.96, 1.04)
    """

    _: KW_ONLY
    focal_length: Annotated[float, Length(above=0), "Focal length of the lens."] = 0.017
    f_number: Annotated[
        float, Number(above=0), "Focal length over the diameter of the aperture."
    ] = 1.8
    focus: Annotated[float, Length(above=0), "Depth at which the lens is focused."] = 1.0
    pixel: Annotated[float, Length(above=0), "Width of a pixel on the sensor."] = 2e-5
    simulated: Annotated[
        bool, Flag(), "Whether the feature blurs sharp pictures as the lens would."
    ] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.focus <= self.focal_length:
            raise InputError(
                f"Defocus: focus {self.focus} m is not beyond the focal length "
                f"{self.focal_length} m"
            )

    def find_blur(self, depth: float) -> tuple[float, float]:
        """Return the deviation of the blur at a depth in pixels, and its derivative in 1/m."""
        scale = DEVIATION_OF_DISC * self.focal_length**2 / (self.f_number * self.pixel)
        scale /= self.focus - self.focal_length
        side = 1.0 if depth >= self.focus else -1.0
        block = 2.0**self.level
        return side * scale * (1.0 - self.focus / depth) / block, (
            side * scale * self.focus / (depth * depth) / block
        )

    def compute_normal_equations(self, seen: Observation) -> NormalEquations:
        """Return the normal equations of the difference of blurred pictures from the goal.

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
        terms = np.array([self._find_terms(each) for each in near.tolist()])
        images = self._build_gaussians(near).blur(images, np.arange(len(images)))
        out = make_equations(len(images))
        for part, goal in self.split_runs(seen):
            window = goal.plane.border, goal.plane.points, goal.plane.slopes
            compute_blurred_equations(
                images[part],
                goal.images,
                goal.rows,
                goal.products,
                np.zeros(part.stop - part.start, dtype=np.int64),
                MODELS[self.interaction_model],
                terms[part],
                window,
                near[part],
                *(each[part] for each in out),
            )
        return out

    def prepare_goal(self, shown: GoalPicture) -> BlurredGoal:
        """Return the blurred picture at the goal of a run, and its L."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self.reduce_pictures(shown.picture[None])[0]
        near = shown.inverse_depth
        gaussians = self._build_gaussians(near[None])
        return build_blurred_goal(
            image, plane, near, gaussians, np.array([self._find_terms(near.tolist())])
        )

    def _find_terms(self, inverse_depth: list[float]) -> tuple[float, float]:
        """Return the numbers of the blur in L, see `compute_blurred_rows`."""
        sigma, rate = self.find_blur(1.0 / inverse_depth[2])
        return sigma * sigma, sigma * rate

    def _build_gaussians(self, near: Array) -> Gaussians:
        """Return the Gaussians of inverse depths (B, 3); of one pixel if pictures are blurred."""
        depths = (1.0 / each for each in near[:, 2].tolist())
        return build_gaussians(
            np.array([self.find_blur(Z)[0] if self.simulated else 0.0 for Z in depths])
        )
