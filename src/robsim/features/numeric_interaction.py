"""The interaction matrix of any feature: analytic, or by central differences."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import replace_unchecked
from robsim.features.feature import Feature, Observation
from robsim.features.images.picture_warp import warp_pictures
from robsim.kernels.formulas import se3
from robsim.kernels.formulas.perspective import transform_image_points
from robsim.vision.camera import Camera

DIFFERENCE_STEP = 1e-5  # metres and radians: rounding and truncation both near 1e-10 of L
UNIT_CAMERA = Camera(np.eye(3))  # pixels are normalised points


def compute_interaction(feature: Feature, seen: Observation) -> ArrayLike:
    """Return L (B, k, 6) from the feature, or by central differences of its measurement.

    The differences move the believed marks: normalised points at believed depths. Pictures are
    warped as the picture of the plane of the target.
    """
    analytic = getattr(feature, "interaction", None)
    if analytic is None:
        return difference_interaction(feature, seen)
    L: ArrayLike = analytic(seen)
    return L


def difference_interaction(feature: Feature, seen: Observation) -> Array:
    """Return L (B, k, 6) by central differences of `measure` along the six camera motions."""
    columns = []
    for axis in range(6):
        ahead, behind = (
            np.asarray(feature.measure(displace_camera(seen, axis, step)), dtype=np.float64)
            for step in (DIFFERENCE_STEP, -DIFFERENCE_STEP)
        )
        columns.append((ahead - behind) / (2.0 * DIFFERENCE_STEP))
    return np.stack(columns, axis=-1)


def displace_camera(seen: Observation, axis: int, step: float) -> Observation:
    """Return the observation after the camera moved by `step` along or about one of its axes.

    With T = exp(-step), the pose of the camera's old axes in its new axes, a point X in camera
    axes becomes T X. A second camera has the fixed pose B = `between` in the first camera, so its
    T is B^-1 T B.
    """
    twist = np.zeros((6, seen.points_last.shape[-1]))
    twist[axis] = -step
    T = np.empty((3, 4, twist.shape[1]))
    se3.exp_se3(twist, T)
    after = _displace_marks(seen, T)
    if seen.pictures is not None and seen.plane_last is not None:
        warped = make_read_only(warp_pictures(seen.pictures, seen.camera, seen.plane_last, T))
        after = replace_unchecked(after, pictures=warped)
    if seen.other is not None:
        assert seen.between_last is not None
        other = _displace_marks(seen.other, _express_motion(seen.between_last.copy(), T))
        return replace_unchecked(after, other=other)
    return after


def _express_motion(B: Array, T: Array) -> Array:
    """Return B^-1 T B: the motion T, expressed in axes at pose B."""
    back, product, out = np.empty_like(T), np.empty_like(T), np.empty_like(T)
    se3.inverse_pose(B, back)
    se3.compose(T, B, product)
    se3.compose(back, product, out)
    return out


def _displace_marks(seen: Observation, T: Array) -> Observation:
    """Return the observation after all marks moved by T (3, 4, B) in camera axes."""
    x = seen.points_last.copy()  # kernels are compiled for writeable arrays
    X = np.empty((x.shape[0], 3, x.shape[-1]))
    transform_image_points(x, seen.depth_last.copy(), T, X)
    depth = np.ascontiguousarray(X[:, 2])
    fields = {"depth_last": depth, "pixels_last": seen.camera.image_of(X)[0]}
    fields["points_last"] = UNIT_CAMERA.image_of(X)[0]
    if seen.guess_last is not None:
        fields["guess_last"] = np.empty_like(T)
        se3.compose(T, seen.guess_last.copy(), fields["guess_last"])
    return replace_unchecked(
        seen, **{name: make_read_only(array) for name, array in fields.items()}
    )
