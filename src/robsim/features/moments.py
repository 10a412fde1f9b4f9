"""Image moments of a planar region, or of a set of marks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Self

import numpy as np

from robsim.base.arrays import Array, euclidean_length, make_read_only
from robsim.base.value import replace_unchecked
from robsim.declare import DeclaredValue, Word, register
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Observation, Tolerance, check_goal_observation
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.features.mark_feature import MarkFeature
from robsim.kernels.features import moment_features as features
from robsim.kernels.formulas import image_moments as kernels
from robsim.kernels.formulas.image_moments import ORDER_3, ORDER_4
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages

MOMENT_KINDS = ("points", "region")
# least length of the vector of third moments that determines the head, and its least ratio to the
# radius of gyration in the image; the tilt of a rectangle by 0.45 rad causes as much
LEAST_SKEW, LEAST_SKEW_RATIO = 0.05, 0.9
DEFAULT_GOAL = make_read_only(np.array([[1.0]] * 2 + [[0.0]] * 5))  # used without a goal


def measure_moments(points: Array, depth: Array, of_marks: bool) -> list[Array]:
    """Return the centre (2, B) and the centred moments (15, B) of marks or of a region.

    The marks, or the corners, are at normalised points (N, 2, B). Moments of marks end with the
    third order, and the other rows are zero.
    """

    def add(program: Program, points: BlockRows, depth: BlockRows) -> list[BlockRows]:
        rows = _add_moments(program, {"points": points, "depth": depth}, of_marks)
        return [rows["centre"], rows["mu"]]

    return evaluate_stages(add, [points, depth], [(2,), (ORDER_4,)])


def _fit_plane(goal: Observation) -> Array:
    """Return (A, B, C) (3, B) of the plane 1/Z = A x + B y + C through the marks."""
    ABC = np.empty((3, goal.points_last.shape[2]))
    kernels.fit_inverse_depth_plane(goal.points_last.copy(), goal.depth_last.copy(), ABC)
    return ABC


def _add_moments(
    program: Program, image: dict[str, BlockRows], of_marks: bool
) -> dict[str, BlockRows]:
    """Add the stage of the moments of a region or of marks; return the rows that it fills."""
    rows = program.rows
    moments = {"centre": rows(2), "mu": rows(ORDER_4), "R": rows(ORDER_3, 6)}
    if of_marks:
        L = rows(2 * image["points"].shape[0], 6)
        program.add(features.marks_stage, **image, **moments, L=L)
    else:
        scratch = {"ABC": rows(3), "terms": rows(ORDER_4)}
        program.add(features.region_stage, **image, **moments, **scratch)
    return moments


@dataclass(frozen=True)
class _BasicMoments(MarkFeature):
    """Base of the features s = (a, xg, yg, alpha) of a region or of marks."""

    alpha_goal: Array | None = field(default=None, init=False, repr=False)  # (1, B)
    of_marks: ClassVar[bool]

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        moments = _add_moments(seen.program, seen.image, self.of_marks)
        goal = seen.goal(self.alpha_goal, 1)
        return seen.computed(features.basic_stage, 4, of_marks=self.of_marks, goal=goal, **moments)

    def towards(self, goal: Observation) -> Self:
        """Return the feature with alpha within a quarter turn of its value at the goal.

        Parameters
        ----------
        goal : Observation
            Observation of the marks at the goal.

        Returns
        -------
        RegionMoments or PointMoments
            The feature with `alpha_goal` from the observation.

        Raises
        ------
        InputError
            If `goal` is not an Observation, or has too few marks.
        """
        return replace_unchecked(
            self, alpha_goal=make_read_only(self.measure(goal)[:, 3][None].copy())
        )


@register("feature", "region_moments")
@dataclass(frozen=True)
class RegionMoments(_BasicMoments):
    """Area, centroid and orientation of a planar region, s = (a, xg, yg, alpha).

    The region is the polygon with the marks as corners, in their order, clockwise or not, in the
    image at unit depth. The orientation

        alpha = atan2(2 mu11, mu20 - mu02)/2

    is the angle of the longer principal axis in radians. L needs the plane 1/Z = A x + B y + C,
    which is fitted to the marks (Chaumette 2004, "Image moments: a general and useful set of
    features for visual servoing", IEEE T-RO 20(4)).

    The four numbers describe distance, lateral position and roll of the camera, so they fix four
    of its motions and need no correspondence of single points. Add other features for the two
    tilts, or use `DecoupledMoments`.

    Raises
    ------
    InputError
        If the target has fewer than three marks.

    Notes
    -----
    An axis has no head, so alpha is defined modulo pi. The orientation of a region with equal
    principal axes, such as a square, is noise. s is NaN if all marks are at one point.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> corners = [[0, 0], [0.4, 0], [0.4, 0.2], [0, 0.2]]
    >>> seen = Observation.of(corners, np.ones(4), Camera(np.eye(3)))
    >>> np.round(RegionMoments().measure(seen), 12) + 0.0
    array([[0.08, 0.2 , 0.1 , 0.  ]])
    """

    singular: ClassVar[str] = "the polygon of the marks, in their order, must not cross itself"
    least_marks: ClassVar[int] = 3
    of_marks: ClassVar[bool] = False


@register("feature", "point_moments")
@dataclass(frozen=True)
class PointMoments(_BasicMoments):
    """Spread, centroid and orientation of the marks as a set of points, s = (a, xg, yg, alpha).

    With mu_ij = sum of (x - xg)^i (y - yg)^j over the marks in the image at unit depth,

        a = mu20 + mu02,    alpha = atan2(2 mu11, mu20 - mu02)/2

    (Tahri and Chaumette 2005, "Point-based and region-based image moments for visual servoing of
    planar objects", IEEE T-RO 21(6)). The order of the marks does not matter. L uses the depth of
    every mark, so the marks need not lie in one plane.

    Use the components (1, 2) of a `FeatureBlock` to keep a target in the centre of the image.

    Raises
    ------
    InputError
        If the target has fewer than two marks.

    Notes
    -----
    alpha is defined modulo pi, and is noise if the principal axes are equal. L is not finite if
    all marks are at one point.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> marks = [[0, 0], [0.4, 0], [0.4, 0.2], [0, 0.2]]
    >>> seen = Observation.of(marks, np.ones(4), Camera(np.eye(3)))
    >>> np.round(PointMoments().measure(seen), 12) + 0.0
    array([[0.2, 0.2, 0.1, 0. ]])
    """

    least_marks: ClassVar[int] = 2
    of_marks: ClassVar[bool] = True


@register("feature", "decoupled_moments")
@dataclass(frozen=True)
class DecoupledMoments(CompiledFeature, DeclaredValue):
    """Six moments, one for each motion of the camera, s = (xn, yn, an, Px, Py, alpha).

    The first three control the translation,

        an = Z* sqrt(a*/a),    xn = an xg,    yn = an yg,

    in metres. The size a is the area of the polygon of the marks (of="region"), or mu20 + mu02 of
    the marks (of="points"). a* is the size and Z* the depth of the centre at the goal. If the goal
    is parallel to the image, their L has -1 on the diagonal of the translation and zeros beside it
    (Tahri and Chaumette 2005, IEEE T-RO 21(6)).

    Px and Py control the two tilts. They do not change if the image translates, rotates or scales:

        (Px, Py) = rho (cos 2 phi, sin 2 phi),    rho = sqrt(mu00) |p|/(mu20 + mu02)^1.5,
        p = (mu30 + mu12, mu21 + mu03).

    phi is the angle of p from the principal axis alpha. Up to the factor |p| (mu20 - mu02, 2
    mu11) they are the sixth invariant of Hu (1962), "Visual pattern recognition by moment
    invariants", IRE Trans. IT 8, and its counterpart in Flusser (2000), "On the independence of
    rotation moment invariants", Pattern Recognition 33.

    alpha controls the roll. It is the angle of an axis; all four third moments, which change their
    signs if the image turns by half a turn, decide between alpha and alpha + pi. They do so if they
    are larger at the goal than those that a tilt of 0.45 rad causes in the image of a rectangle.
    For a target with smaller third moments, a roll above a quarter turn ends upside down.

    Near a parallel goal each error excites its own motion, and the camera moves nearly straight
    even with a large roll. Objects with one axis of symmetry are allowed.

    Raises
    ------
    InputError
        If the target has fewer than three marks.
    GoalError
        By `simulate`, if the target looks the same after some turn, so that L is not finite.

    Notes
    -----
    Px and Py are useless if p = 0 (objects that look the same after some turn, such as a rectangle
    or a regular polygon), and if the principal axes are equal, since alpha is noise then. s is NaN
    or infinite if all marks are at one point.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> marks = [[0, 0], [0.4, 0], [0, 0.2]]
    >>> seen = Observation.of(marks, np.full(3, 2.0), Camera(np.eye(3)))
    >>> DecoupledMoments().towards(seen).measure(seen).round(3)[0, :3]
    array([0.267, 0.133, 2.   ])
    """

    of: Annotated[
        str,
        Word(MOMENT_KINDS, "kind"),
        "Moments of the marks, or of the polygon with these corners.",
    ] = "points"
    tolerance: Tolerance = 1e-5
    unit: str = "m, 1, rad"
    # (7, B): a*, Z*, alpha and head at the goal
    goal: Array | None = field(default=None, init=False, repr=False)
    singular: ClassVar[str] = "a target must not look the same after a turn, as a square does"
    least_marks: ClassVar[int] = 3

    @property
    def of_marks(self) -> bool:
        """Whether the moments belong to the marks, and not to the region within them."""
        return self.of == "points"

    @property
    def has_head(self) -> bool:
        """Whether the third moments at the goal decide between alpha and alpha + pi."""
        return self.goal is not None and bool(self.goal[3:].any())

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        goal = DEFAULT_GOAL if self.goal is None else self.goal
        moments = _add_moments(seen.program, seen.image, self.of_marks)
        arguments = moments | {"goal": seen.program.each(goal)}
        options = {"has_angle": self.goal is not None, "has_heading": self.has_head}
        return seen.computed(
            features.decoupled_stage, 6, of_marks=self.of_marks, **arguments, **options
        )

    def towards(self, goal: Observation) -> DecoupledMoments:
        """Return the feature with a*, Z*, the orientation and the head at the goal.

        Parameters
        ----------
        goal : Observation
            Observation of the marks at the goal.

        Returns
        -------
        DecoupledMoments
            The feature relative to the observation.

        Raises
        ------
        InputError
            If `goal` is not an Observation.
        """
        seen = check_goal_observation(goal, "DecoupledMoments")
        centre, mu = measure_moments(seen.points_last, seen.depth_last, self.of_marks)
        s = np.empty((4, mu.shape[1]))
        features.basic_moments(self.of_marks, centre, mu, s)
        size, x, y, alpha = s
        if self.of_marks:
            Z = sum(goal.depth_last) / len(goal.depth_last)  # mark by mark, for the same bits
        else:
            A, B, C = _fit_plane(goal)
            with np.errstate(all="ignore"):  # collinear marks determine no plane: Z is not finite
                Z = 1.0 / (A * x + B * y + C)
        return replace_unchecked(
            self, goal=make_read_only(np.stack([size, Z, alpha, *measure_head(mu, alpha)]))
        )


def measure_head(mu: Array, alpha: Array) -> Array:
    """Return the heads (4, B), or zeros if a tilt could explain them."""
    h = np.empty((4, mu.shape[1]))
    features.head_vector(mu, alpha, h)
    with np.errstate(invalid="ignore"):  # the moments of a border that crosses itself
        radius = np.sqrt((mu[3] + mu[5]) / mu[0])
    least = np.maximum(LEAST_SKEW, LEAST_SKEW_RATIO * radius)
    return np.where(euclidean_length(h) > least, h, 0.0)
