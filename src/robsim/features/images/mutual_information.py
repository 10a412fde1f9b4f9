"""Mutual information of the picture with the picture at the goal."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare import Integer, Number, register
from robsim.features.feature import Observation
from robsim.features.images.dense_feature import DenseFeature, NormalEquations
from robsim.features.images.goal_pictures_of_runs import (
    GoalPicture,
    PreparedGoals,
    get_inverse_depth,
    make_equations,
)
from robsim.features.images.picture_plane import PicturePlane, build_picture_plane, compute_rows
from robsim.kernels.image_features.grey_bins import TAPS
from robsim.kernels.image_features.luminance_rows import CENTRAL
from robsim.kernels.image_features.mutual_information import (
    compute_information_equations,
    fill_joint_histogram,
    find_information_hessian,
    find_log_shares,
    find_standard_bins,
)


class InformationGoal(NamedTuple):
    """Pixels, their bins at the goal, information of the goal with itself, and the Hessian."""

    plane: PicturePlane
    bins: tuple[NDArray[np.int64], Array]
    most: float
    hessian: Array


@register("feature", "mutual_information")
@dataclass(frozen=True, eq=False)
class MutualInformation(PreparedGoals[InformationGoal], DenseFeature):
    """Mutual information of the picture with the picture at the goal, which is to be largest.

    With the shares p_ij of the pixels in bin i of one picture and in bin j of the other, by cubic
    B-splines phi of the standard grey values z = (I - mean)/deviation,

        MI = sum p_ij log(p_ij / (p_i p_j)).

    The features descend the missing information of the picture I,

        D = (MI(I, I) + MI(I*, I*)) / 2 - MI(I, I*),    gain H^-1 dD/dr,

    with the second derivatives at the goal

        H = 1/N sum over the pixels of E L'L + sum over the bins of A_ij' A_ji / p_ij,
        E = sum of phi_i' phi_j' log(p_ij / (p_i p_j)),    A_ij = mean of phi_i' phi_j L

    and L of the standard values, so that the law takes a step of Newton at the goal. The error has
    the norm sqrt(2 D), in the root of nats. Dame and Marchand (2011, "Mutual information-based
    visual servoing", IEEE T-RO 27(5)) climb MI(I, I*) alone, of grey values. Its maximum is beside
    the goal if texture enters the view, since a picture with more grey values shares more
    information: by 2 to 16 cm with 8 bins in our tests, where D has its minimum at the goal.

    Brightness and contrast do not matter, nor does a negative: grey values now need only predict
    the values at the goal. Light that differs from place to place does matter. The basin is smaller
    than with the luminance, since the bins of pictures that do not overlap are independent. A
    coarser `level` widens it. The law always takes the derivative of the present picture and H of
    the goal, so `interaction` of the task has no effect.

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
    >>> goal = np.rint(128 + 50 * np.sin(x / 4) + 40 * np.cos(y / 3)).astype(np.uint8)
    >>> at_goal, negative = (
    ...     Observation.of([[20, 15]], [1.0], camera, pictures=each) for each in (goal, 255 - goal)
    ... )
    >>> feature = MutualInformation(border=4).towards(at_goal)
    >>> feature.measure(negative).round(3) + 0.0  # the negative has the same information
    array([[0., 0., 0., 0., 0., 0., 0.]])
    """

    tolerance: Annotated[
        float,
        Number(above=0),
        "Largest root of twice the missing information in nats at convergence.",
    ] = 0.5
    _: KW_ONLY
    bins: Annotated[int, Integer(4, 64), "Number of bins of grey values."] = 8
    unit: ClassVar[str] = "nat^0.5"

    def compute_normal_equations(self, seen: Observation) -> NormalEquations:
        """Return normal equations whose step descends the missing information.

        Parameters
        ----------
        seen : Observation
            Pictures of B runs.

        Returns
        -------
        NormalEquations
            The Hessian at the goal, the gradient, and twice the missing information.

        Raises
        ------
        InputError
            If there are no pictures, or no goal.
        """
        images, near = self.reduce_pictures(self.get_pictures(seen)), get_inverse_depth(seen)
        out = make_equations(len(images))
        for part, goal in self.split_runs(seen):
            window = goal.plane.border, goal.plane.points, goal.plane.slopes
            compute_information_equations(
                images[part],
                goal.bins,
                self.bins,
                goal.most,
                goal.hessian,
                window,
                near[part],
                *(each[part] for each in out),
            )
        return out

    def find_large_error(self, seen: Observation) -> Array:
        """Return twice the information (B,) of the goals, which pictures without relation miss."""
        parts = [(part.stop - part.start, goal.most) for part, goal in self.split_runs(seen)]
        return np.concatenate([np.full(count, 2.0 * most) for count, most in parts])

    def prepare_goal(self, shown: GoalPicture) -> InformationGoal:
        """Return the bins, the information and the Hessian at the goal of a run."""
        plane = build_picture_plane(shown.camera, self.border, self.level)
        image = self.reduce_pictures(shown.picture[None])[0]
        N, bins = plane.pixel_count, self.bins
        first, weights, slopes = np.empty(N, np.int64), np.empty((N, TAPS)), np.empty((N, TAPS))
        standard = np.empty(N)
        find_standard_bins(image, plane.border, bins, first, weights, slopes, standard)
        p, logs, hessian = np.empty((bins, bins)), np.empty((bins, bins)), np.empty((6, 6))
        fill_joint_histogram(first, weights, first, weights, p)
        most = find_log_shares(p, logs)
        rows = compute_rows(image, plane, CENTRAL, shown.inverse_depth)
        find_information_hessian(first, weights, slopes, standard, logs, p, rows, hessian)
        return InformationGoal(plane, (first, weights), most, hessian)
