"""The luminance of all pixels (photometric visual servoing)."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Flag, Word, register
from robsim.features.feature import Observation
from robsim.features.images.dense_feature import DenseFeature, NormalEquations
from robsim.features.images.goal_pictures_of_runs import (
    GoalPicture,
    PreparedGoals,
    get_inverse_depth,
    make_equations,
)
from robsim.features.images.picture_plane import (
    PicturePlane,
    Pixels,
    build_picture_plane,
    compute_rows,
)
from robsim.kernels.image_features.luminance_equations import (
    CURRENT,
    DESIRED,
    MEAN,
    compute_luminance_equations,
)
from robsim.kernels.image_features.luminance_rows import CENTRAL, SEVEN_TAPS
from robsim.kernels.image_features.picture_sums import LANES, compute_gram_matrix

MODELS = {"desired": DESIRED, "current": CURRENT, "mean": MEAN}
TAPS = {"central": CENTRAL, "seven_taps": SEVEN_TAPS}


class LuminanceGoal(NamedTuple):
    """The picture at the goal of a run, with its pixels, its L (6, N), L'L, and its contrast."""

    plane: PicturePlane
    image: Pixels
    rows: Pixels
    products: Array
    contrast: float


@register("feature", "luminance")
@dataclass(frozen=True, eq=False)
class Luminance(PreparedGoals[LuminanceGoal], DenseFeature):
    """Grey values of all pixels, which are compared with the picture at the goal.

    Photometric visual servoing needs no marks, no matching and no tracking (Collewet and Marchand
    2011, IEEE Trans. Robotics 27, 828). The error is the difference of two pictures, e = I - I*.
    For a scene whose points keep their grey values, it changes with the twist V_c of the camera as

        edot = L V_c,    L = -(dI/dx, dI/dy) L_x,

    with the interaction matrix L_x of the point (x, y) at every pixel. Its depth is the depth of a
    plane through the marks of the target, or constant (`depth` of the task). The law commands

        V_c = -gain (H + damping diag(H))^-1 L'e,    H = L'L.

    Many pixels make the end very exact, but the start must be near: about as near as the pictures
    overlap within their coarsest texture. `level` and a mixture of Gaussians (`PhotometricMixture`)
    widen this basin. Light that changes, and reflections, violate the assumption; `robust` pixels
    reduce the weight of those that differ most. A narrow field of view confuses a translation along
    x with a rotation about y: judge the end by `step`, not by the grey values alone.

    `interaction` of the task selects L: "desired" is constant and cheapest, "current" follows the
    picture, and "mean" is the mean of both (Malis 2004).

    Raises
    ------
    InputError
        If the camera has no size, or the border leaves no pixels.
    GoalError
        By `simulate`, if the picture at the goal is constant.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("photometric"))
    >>> run = scenario.run()
    >>> rs.Outcome(int(run.outcome)).name, bool(run.distance_to_goal < 1e-3)
    ('CONVERGED', True)
    """

    _: KW_ONLY
    derivative: Annotated[
        str,
        Word(tuple(TAPS), "derivative"),
        "Derivative of a picture: central difference, or seven taps, which smooth.",
    ] = "central"
    robust: Annotated[
        bool, Flag(), "Whether pixels that differ much weigh less (biweight of Tukey)."
    ] = False

    @property
    def has_constant_products(self) -> bool:
        """Whether every picture has L'L of the goal."""
        return self.interaction_model == "desired" and not self.robust

    def compute_normal_equations(self, seen: Observation) -> NormalEquations:
        """Return the normal equations of the difference of pictures from their goal.

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
            plane = goal.plane
            window = plane.border, TAPS[self.derivative], plane.points, plane.slopes
            compute_luminance_equations(
                images[part],
                goal.image,
                goal.rows,
                goal.products,
                MODELS[self.interaction_model],
                goal.contrast if self.robust else 0.0,
                window,
                near[part],
                *(each[part] for each in out),
            )
        return out

    def prepare_goal(self, shown: GoalPicture) -> LuminanceGoal:
        """Return the picture and L at the goal of a run."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self.reduce_pictures(shown.picture[None])[0]
        rows = compute_rows(image, plane, TAPS[self.derivative], shown.inverse_depth)
        products = np.empty((6, 6))
        compute_gram_matrix(rows, np.empty(LANES, dtype=np.float32), products)
        contrast = float(self.measure_contrasts(shown.picture[None])[0])
        return LuminanceGoal(plane, image, rows, products, contrast)
