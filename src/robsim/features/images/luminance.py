"""The luminance of all pixels (photometric visual servoing)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from typing import Annotated, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Flag, Word, register
from robsim.features.feature import Observation
from robsim.features.images.dense_feature import DenseFeature, NormalEquations
from robsim.features.images.picture_plane import PicturePlane, Pixels
from robsim.kernels.image_features.luminance_equations import (
    CURRENT,
    DESIRED,
    MEAN,
    compute_luminance_equations,
)
from robsim.kernels.image_features.luminance_rows import CENTRAL, SEVEN_TAPS, compute_luminance_rows
from robsim.kernels.image_features.picture_sums import LANES, compute_gram_matrix

MODELS = {"desired": DESIRED, "current": CURRENT, "mean": MEAN}
TAPS = {"central": CENTRAL, "seven_taps": SEVEN_TAPS}


class LuminanceGoal(NamedTuple):
    """The picture at the goal of a run, with its pixels its L (6, N), L'L, and its contrast."""

    plane: PicturePlane
    image: Pixels
    rows: Pixels
    products: Array
    contrast: float


@register("feature", "luminance")
@dataclass(frozen=True, eq=False)
class Luminance(DenseFeature):
    """Grey values of all pixels, which are compared with the picture at the goal.

    Photometric visual servoing needs no marks, no matching and no tracking (Collewet and Marchand
    2011, IEEE Trans. Robotics 27, 828). The error is the difference of two pictures, e = I - I*.
    For a scene whose points keep their grey values, it changes with the twist V_c of the camera as

        edot = L V_c,    L = -(dI/dx, dI/dy) L_x,

    with the interaction matrix L_x of the point (x, y) at every pixel. Its depth is that of a plane
    through the marks of the target, or constant, as `depth` of the task says. The law commands

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
        images = self.reduce_pictures(self.get_pictures(seen))
        B = len(images)
        out = NormalEquations(np.empty((B, 6, 6)), np.empty((B, 6)), np.empty(B))
        near = self._find_inverse_depth(seen)
        for part, goal in self._split_runs(seen):
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

    def _find_inverse_depth(self, seen: Observation) -> Array:
        """Return the coefficients (B, 3) of the inverse depth of the plane of the target."""
        assert seen.plane_last is not None
        return np.ascontiguousarray(seen.plane_last.T)

    def _split_runs(self, seen: Observation) -> Iterator[tuple[slice, LuminanceGoal]]:
        """Yield slices of runs with one goal, and the goal."""
        assert (
            self.goal is not None and self.goal.pictures is not None and seen.pictures is not None
        )
        count = len(seen.pictures)
        if len(self.goal.pictures) == 1 and self.goal.camera.rows.shape[1] == 1:
            yield slice(0, count), self._find_goal(0)
            return
        runs = np.arange(count) if seen.runs is None else seen.runs
        for b, run in enumerate(runs.tolist()):
            yield slice(b, b + 1), self._find_goal(run)

    def _find_goal(self, run: int) -> LuminanceGoal:
        """Return the picture and L at the goal of a run, computed once."""
        known: dict[int, LuminanceGoal] = vars(self).setdefault("_goals", {})
        if run not in known:
            known[run] = self._prepare_goal(run)
        return known[run]

    def _prepare_goal(self, run: int) -> LuminanceGoal:
        """Return the picture and L at the goal of a run."""
        goal = self.goal
        assert goal is not None and goal.pictures is not None
        plane = self.build_plane(goal, run)
        one = run if len(goal.pictures) > 1 else 0
        image = self.reduce_pictures(goal.pictures[one : one + 1])[0]
        near = self._find_inverse_depth(goal)
        inverse_depth = near[run if len(near) > 1 else 0]
        rows = np.empty((6, plane.padded_count), dtype=np.float32)
        buffer = np.empty((2, image.shape[1] - 2 * plane.border), dtype=np.float32)
        compute_luminance_rows(
            image,
            plane.border,
            TAPS[self.derivative],
            plane.points,
            plane.slopes,
            inverse_depth,
            buffer,
            rows,
        )
        products = np.empty((6, 6))
        compute_gram_matrix(rows, np.empty(LANES, dtype=np.float32), products)
        contrast = self.measure_contrasts(goal)[one]
        return LuminanceGoal(plane, image, rows, products, float(contrast))
