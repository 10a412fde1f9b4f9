"""Histograms of the grey values in cells of a picture."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import GoalError
from robsim.declare import Integer, Number, register
from robsim.features.feature import Observation
from robsim.features.images.dense_feature import DenseFeature, NormalEquations
from robsim.features.images.goal_pictures_of_runs import (
    GoalPicture,
    PreparedGoals,
    get_inverse_depth,
    make_equations,
)
from robsim.features.images.luminance import MODELS
from robsim.features.images.picture_plane import PicturePlane, build_picture_plane
from robsim.kernels.image_features.histogram_equations import (
    compute_histogram_equations,
    measure_histograms,
)

LARGE_DISTANCE = 0.5  # of Matusita, of histograms half of which overlap


class HistogramGoal(NamedTuple):
    """Pixels and their cells (N,), roots (cells, bins) at the goal, and their L."""

    plane: PicturePlane
    cells: NDArray[np.int64]
    roots: Array
    rows: Array


@register("feature", "histogram")
@dataclass(frozen=True, eq=False)
class Histogram(PreparedGoals[HistogramGoal], DenseFeature):
    """Histograms of the grey values in cells of a picture.

    The picture inside the border is divided into `columns` x `rows` cells. The share of the n
    pixels of a cell in bin i is

        p_i = 1/n sum over the pixels of phi(t - i),    L_p = 1/n sum of phi'(t - i) dt/dI L_I,

    with the cubic B-spline phi, the grey value I at the place t of an axis of `bins` bins, and the
    interaction matrix L_I of the luminance (Bateux and Marchand 2017, "Histograms-based visual
    servoing", IEEE RA-L 2(1)). The features are the roots of p_i + 0.001, so that their squared
    error is the distance of Matusita between the histograms of each cell, summed over its bins; the
    normal equations are means over the cells.

    Few bins have wide splines, so that a grey value moves smoothly from bin to bin: 8 bins have a
    larger basin than 16 or 32. A histogram does not know where its grey values are, so that it
    tolerates larger motions within a cell than the luminance. Pictures with the same share of each
    grey value in all cells look alike. Light that changes moves grey values to other bins.

    `tolerance` has the unit of the error: 0 for equal histograms, and at most the root of 2.

    Raises
    ------
    GoalError
        By `simulate`, if the picture at the goal is constant, or has fewer pixels than cells.

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
    >>> feature = Histogram(columns=2, rows=2, border=4).towards(at_goal)
    >>> float(np.linalg.norm(feature.measure(now)).round(3))
    0.058
    """

    tolerance: Annotated[
        float,
        Number(above=0),
        "Largest root of the mean distance of the histograms at convergence.",
    ] = 0.1
    _: KW_ONLY
    bins: Annotated[int, Integer(4, 256), "Number of bins of grey values."] = 8
    columns: Annotated[int, Integer(1, 100), "Number of cells along a row of the picture."] = 5
    rows: Annotated[int, Integer(1, 100), "Number of cells along a column of the picture."] = 4
    unit: ClassVar[str] = "1"

    def towards(self, goal: Observation) -> Self:
        """Return the feature relative to the histograms of the picture at the goal."""
        at_goal = super().towards(goal)
        list(at_goal.split_runs(goal))  # cells that do not fit are an error of the goal
        return at_goal

    def compute_normal_equations(self, seen: Observation) -> NormalEquations:
        """Return the normal equations of the roots of the histograms.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        NormalEquations
            Their means over the cells.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        images, near = self.reduce_pictures(self.get_pictures(seen)), get_inverse_depth(seen)
        out = make_equations(len(images))
        for part, goal in self.split_runs(seen):
            window = goal.plane.border, goal.plane.points, goal.plane.slopes
            compute_histogram_equations(
                images[part],
                goal.roots,
                goal.rows,
                MODELS[self.interaction_model],
                window,
                goal.cells,
                near[part],
                *(each[part] for each in out),
            )
        return out

    def find_large_error(self, seen: Observation) -> Array:
        """Return the mean distance of Matusita (1,) of histograms that differ."""
        return np.full(1, LARGE_DISTANCE)

    def prepare_goal(self, shown: GoalPicture) -> HistogramGoal:
        """Return the histograms at the goal of a run, and their L."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self.reduce_pictures(shown.picture[None])[0]
        cells = self._number_cells(plane)
        roots = np.empty((self.rows * self.columns, self.bins))
        L = np.empty((*roots.shape, 6))
        window = plane.border, plane.points, plane.slopes
        measure_histograms(image, window, cells, shown.inverse_depth, roots, L)
        return HistogramGoal(plane, cells, roots, L)

    def _number_cells(self, plane: PicturePlane) -> NDArray[np.int64]:
        """Return the cell (N,) of each pixel inside the border."""
        height, width = (side - 2 * plane.border for side in plane.size)
        if self.columns > width or self.rows > height:
            raise GoalError(
                f"Histogram: {self.columns} x {self.rows} cells of {width} x {height} pixels"
            )
        column = np.arange(width) * self.columns // width
        row = np.arange(height) * self.rows // height
        return np.add.outer(row * self.columns, column).ravel().astype(np.int64)
