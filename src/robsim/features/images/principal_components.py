"""Principal components of the pictures around a goal."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import GoalError
from robsim.declare import Angle, Integer, Number, register
from robsim.features.images.goal_pictures_of_runs import GoalPicture
from robsim.features.images.linear_feature import LinearFeature, LinearGoal
from robsim.features.images.picture_plane import PicturePlane, Pixels
from robsim.features.images.plane_motions import list_small_motions, warp_picture
from robsim.kernels.image_features.principal_pictures import find_principal_pictures


@register("feature", "principal_components")
@dataclass(frozen=True, eq=False)
class PrincipalComponents(LinearFeature):
    """Principal components of a picture, in a basis of the pictures around the goal.

    The basis U (k, N) has the directions in which the pictures around the goal differ most. It is
    learned from `pictures` pictures: the picture at the goal, warped by the homographies

        H = R + t n'R / (1 - n't),    n = (a, b, c),    1/Z = a x + b y + c,

    of small motions (R, t) of the camera before the plane of the target, which follow a sequence of
    Halton and thus are always the same. The features s = U I / sqrt(N) are linear in the grey
    values, with L = U L_I / sqrt(N) (Marchand 2019, "Subspace-based direct visual servoing", IEEE
    RA-L 4(3)).

    The basis has the frequencies that the motions around the goal excite, so that few components
    reach as far as many cosines. It has to be learned for each goal, within a range `angle` and
    `distance` that fits the starts: pictures far outside of it project to noise. Components of
    nearly equal variance mix, and do not matter alone.

    Raises
    ------
    GoalError
        By `simulate`, if the picture at the goal is constant.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[40, 0, 19.5], [0, 40, 14.5], [0, 0, 1]], size=(40, 30))
    >>> y, x = np.mgrid[:30, :40]
    >>> picture = np.rint(128 + 50 * np.sin(x / 4) + 40 * np.cos(y / 3)).astype(np.uint8)
    >>> seen = Observation.of([[20, 15]], [1.0], camera, pictures=picture)
    >>> feature = PrincipalComponents(count=6, pictures=32).towards(seen)
    >>> feature.interaction(seen).shape
    (1, 6, 6)
    """

    _: KW_ONLY
    count: Annotated[int, Integer(1, 200), "Number of components."] = 16
    pictures: Annotated[int, Integer(8, 500), "Number of warped pictures of the basis."] = 96
    angle: Annotated[
        float, Angle(above=0, most=1.0), "Largest rotation of the warped pictures."
    ] = 0.2
    distance: Annotated[
        float,
        Number(above=0, most=0.5),
        "Largest translation of the warped pictures, as a share of the depth.",
    ] = 0.15

    def prepare_goal(self, shown: GoalPicture) -> LinearGoal:
        """Return the pixels, the basis and the contrast at the goal of a run."""
        if self.count >= self.pictures:
            raise GoalError(
                f"PrincipalComponents: {self.count} components need more than "
                f"{self.count} pictures, got {self.pictures}"
            )
        return super().prepare_goal(shown)

    def build_basis(self, plane: PicturePlane, image: Pixels, inverse_depth: Array) -> Array:
        """Return the principal components (k, N) of the pictures around the goal."""
        warped = np.zeros((self.pictures, plane.padded_count), dtype=np.float32)
        motions = list_small_motions(self.pictures, self.angle, self.distance / inverse_depth[2])
        for row, (R, t) in zip(warped, motions, strict=True):
            row[: plane.pixel_count] = warp_picture(image, plane, inverse_depth, R, t)
        basis = np.empty((self.count, plane.padded_count), dtype=np.float32)
        find_principal_pictures(warped, basis, np.empty(len(warped)))
        scaled: Array = basis[:, : plane.pixel_count] / np.sqrt(plane.pixel_count)
        return scaled
