"""Interaction matrices with the names of their rows and columns, their rank and free motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import KindOf
from robsim.features.feature import FEATURES, Feature, Observation
from robsim.features.motion_words import describe_joint_motion, describe_twist, reduce_motions
from robsim.features.numeric_interaction import compute_interaction

FEATURE = KindOf(FEATURES, protocol=Feature)
TWIST = ("v_x", "v_y", "v_z", "omega_x", "omega_y", "omega_z")
RANK_TOLERANCE = 1e-6  # relative size below which a singular value counts as zero
XYZ = ("X", "Y", "Z")
COMPONENTS = {  # names of the components of a feature, of each mark if it is measured mark by mark
    "points": ("x", "y"),
    "pixels": ("u", "v"),
    "log_depth": ("log Z",),
    "points_3d": XYZ,
    "stereo_points": XYZ,
    "polar": ("rho", "theta"),
    "spherical": ("s_x", "s_y", "s_z"),
    "segments": ("x_c", "y_c", "length", "angle"),
    "theta_u": ("theta u_x", "theta u_y", "theta u_z"),
    "translation": ("t_x", "t_y", "t_z"),
}


@dataclass(frozen=True, eq=False)
class InteractionMatrix:
    """Interaction matrix L with sdot = L V, or its product with a Jacobian, sdot = L J qdot.

    It is an array for NumPy: ``np.linalg.pinv(L) @ e`` and ``L @ V`` work.

    Attributes
    ----------
    matrix : ndarray of shape (..., k, n)
        The numbers, with leading dimensions for several configurations.
    rows : tuple of str
        Names of the k features.
    columns : tuple of str
        Names of the n motions: the camera twist V = (v, omega) in camera axes (m/s, rad/s), or
        joint velocities.
    tolerance : float, default 1e-6
        Singular values below `tolerance` times the largest count as zero.

    Examples
    --------
    >>> numbers = np.array([[-2.0, 0, 0.2], [0, -2.0, 0.4]])
    >>> L = InteractionMatrix(numbers, ("x", "y"), ("a", "b", "c"))
    >>> L.rank, L @ [1.0, 0.0, 0.0]
    (2, array([-2.,  0.]))
    >>> L.free_motions()
    ('a 0.1, b 0.2, c 1',)
    """

    matrix: Array
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    tolerance: float = RANK_TOLERANCE

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return the numbers, for NumPy."""
        return np.array(self.matrix, dtype=dtype, copy=copy)

    def __matmul__(self, other: Any) -> Any:  # Any: an array, as NumPy returns it
        """Return the product with an array."""
        return self.matrix @ np.asarray(other)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the matrix."""
        return self.matrix.shape

    @property
    def singular_values(self) -> Array:
        """Singular values (..., min(k, n)), the largest first; NaN if a number is not finite."""
        finite = np.asarray(np.isfinite(self.matrix).all(axis=(-2, -1)))
        known = np.where(finite[..., None, None], self.matrix, 0.0)
        values = np.linalg.svd(known, compute_uv=False)
        return np.where(finite[..., None], values, np.nan)

    @property
    def rank(self) -> Any:  # Any: one number, or an array (...)
        """Number of singular values above `tolerance` times the largest; 0 if it is unknown."""
        values = self.singular_values
        count = (values > self.tolerance * values[..., :1]).sum(axis=-1)
        return int(count) if count.ndim == 0 else count

    @property
    def condition(self) -> Any:  # Any: one number, or an array (...)
        """Ratio of the largest singular value and the smallest that does not count as zero."""
        values, rank = self.singular_values, np.asarray(self.rank)
        least = np.take_along_axis(values, np.maximum(rank[..., None] - 1, 0), axis=-1)[..., 0]
        with np.errstate(all="ignore"):
            condition = np.where(rank > 0, values[..., 0] / least, np.nan)
        return float(condition) if condition.ndim == 0 else condition

    def null_space(self) -> Array:
        """Return the motions (n, n - rank) that change no feature, in a basis with many zeros.

        Raises
        ------
        InputError
            If there are several configurations, or if a number is not finite.
        """
        if self.matrix.ndim != 2 or not np.isfinite(self.matrix).all():
            raise InputError("free motions: expected one matrix of finite numbers")
        _, _, Vt = np.linalg.svd(self.matrix, full_matrices=True)
        return reduce_motions(Vt[self.rank :].T, self.columns == TWIST)

    def free_motions(self) -> tuple[str, ...]:
        """Return the motions that change no feature, in words."""
        motions = self.null_space().T
        if self.columns == TWIST:
            return tuple(describe_twist(each) for each in motions)
        return tuple(describe_joint_motion(each, self.columns) for each in motions)


def check_features(value: Any, cameras: int, marks: int) -> list[Feature]:
    """Return features from a feature, a name or a list; InputError if they do not fit.

    `cameras` and `marks` are the numbers of cameras and marks that observe and form the target.
    """
    values = value if isinstance(value, list | tuple) else [value]
    if not values:
        raise InputError("features: expected at least one feature")
    features = [FEATURE.check(each, "features") for each in values]
    for each in features:
        needed, least = getattr(each, "cameras", 1), getattr(each, "least_marks", 1)
        if needed != cameras:
            raise InputError(f"{type(each).__name__} needs {needed} camera(s), got {cameras}")
        if marks < least:
            raise InputError(f"{type(each).__name__} needs at least {least} marks, got {marks}")
    return features


def stack_interactions(
    features: Sequence[Feature], seen: Observation, shape: tuple[int, ...]
) -> InteractionMatrix:
    """Return L of stacked features, from an observation of the configurations of a shape."""
    matrices = [np.asarray(compute_interaction(each, seen)) for each in features]
    N = seen.pixels_last.shape[0]
    rows = [
        name
        for each, L in zip(features, matrices, strict=True)
        for name in name_components(each, L.shape[1], range(N))
    ]
    L = np.concatenate(matrices, axis=1)
    L[~np.isfinite(L).all(axis=-1)] = np.nan
    return InteractionMatrix(L.reshape(*shape, *L.shape[1:]), tuple(rows), TWIST)


def name_components(feature: Feature, k: int, marks: Sequence[int]) -> list[str]:
    """Return the names of the k components of a feature that is measured on some marks."""
    kind = FEATURES.name_of(feature) or type(feature).__name__
    own = COMPONENTS.get(kind, ())
    if kind == "segments" and k == 2 * len(marks):
        pairs = zip(marks[::2], marks[1::2], strict=True)
        return [f"{name} of marks {a}, {b}" for a, b in pairs for name in own]
    if own and k == len(own) * len(marks) and not getattr(feature, "uses_pose", False):
        return [f"{name} of mark {mark}" for mark in marks for name in own]
    return list(own) if k == len(own) else [f"{kind}[{i}]" for i in range(k)]
