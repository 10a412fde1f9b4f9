"""Coordinates of the next views of a calibration, which add the most information on the mount."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.calibration.calibration_fit import CalibrationFit
from robsim.calibration.calibration_model import predict_rates
from robsim.vision.camera import Visibility


@dataclass(frozen=True, eq=False, repr=False)
class NextPoses(Value):
    """Coordinates for the next views of a calibration, the most informative first.

    Attributes
    ----------
    q : ndarray of shape (n, nq)
        Coordinates of the views.
    number : ndarray of int, shape (n,)
        Indices of the chosen candidates.
    position : ndarray of shape (n,)
        Predicted standard deviation of the mount's position in metres after each view: the root of
        the sum of the variances along three axes.
    angle : ndarray of shape (n,)
        Predicted standard deviation of the mount's orientation in radians after each view: the root
        of the sum of the variances about three axes.

    Examples
    --------
    >>> NextPoses(np.zeros((2, 6)), np.array([4, 1]), np.array([2e-3, 1e-3]), np.radians([1, 0.5]))
    <NextPoses [4, 1]: to 1 mm, 0.5 deg>
    """

    q: Array
    number: NDArray[np.int64]
    position: Array
    angle: Array

    def __repr__(self) -> str:
        return (
            f"<NextPoses {self.number.tolist()}: to {1e3 * self.position[-1]:.3g} mm, "
            f"{np.degrees(self.angle[-1]):.3g} deg>"
        )


def select_next_poses(calibration: CalibrationFit, candidates: ArrayLike, count: int) -> NextPoses:
    """Return the candidates that add the most information on the mount, selected one by one.

    A view with Jacobian J adds J'J / sigma^2 to the information matrix of all parameters. Each step
    selects the view with the largest log det of the information on the mount, in which the other
    parameters are marginalised: a D-optimal design for the mount alone (D_s optimality: Atkinson,
    Donev and Tobias 2007), which does not depend on units.

    Parameters
    ----------
    calibration : CalibrationFit
        Calibration from the previous views.
    candidates : array_like of shape (n, nq)
        Coordinates to choose from, for example from `sample_viewpoints`. Candidates outside the
        limits of the joints, or without a view of the whole target, are left out.
    count : int
        Number of views to choose. No candidate is chosen twice.

    Returns
    -------
    NextPoses
        Coordinates, and standard deviations of the mount after each view.

    Raises
    ------
    InputError
        If fewer than `count` candidates are usable.

    Examples
    --------
    >>> from robsim import calibrate, examples, load_scenario
    >>> from robsim.calibration import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> q = bench.start + turns
    >>> calibration = calibrate(simulate_views(bench, q), ["focal", "center"])
    >>> select_next_poses(calibration, q, 2).number  # the same views as candidates
    array([2, 0])
    """
    views = calibration.views
    q = views.scene.coordinates(candidates, "candidates", limits=False)
    if q.ndim != 2:
        raise InputError(f"candidates: expected (n, {views.scene.nq}), got {q.shape}")
    usable = np.flatnonzero(_is_usable_view(calibration, q))
    view_count = as_integer(count, "count", 1)
    if len(usable) < view_count:
        raise InputError(
            f"candidates: {len(usable)} of {len(q)} see the whole target within the limits of the "
            f"joints, and count is {view_count}"
        )
    information = _view_information(calibration, q[usable])
    selection, variances = _select_greedily(
        np.asarray(np.linalg.inv(calibration.covariance)), information, view_count
    )
    deviations = np.sqrt([[C[:3].sum(), C[3:].sum()] for C in variances]).T
    number = usable[selection]
    return NextPoses(
        make_read_only(q[number]),
        make_read_only(number),
        make_read_only(deviations[0]),
        make_read_only(deviations[1]),
    )


def _is_usable_view(calibration: CalibrationFit, q: Array) -> NDArray[np.bool_]:
    """Return whether coordinates (n, nq) are within limits and see the whole target."""
    low, high = calibration.views.scene.limits.T
    view = calibration.scene.view(q, calibration.views.camera, calibration.views.target)
    within = ((q >= low) & (q <= high)).all(axis=1)
    return np.asarray(within & (view.visibility == Visibility.IN_IMAGE).all(axis=1))


def _view_information(calibration: CalibrationFit, q: Array) -> Array:
    """Return the information J'J / sigma^2 (n, P, P) of a view at each row of q (n, nq)."""
    views = calibration.views
    J = predict_rates(calibration.model, views.thing.marks, views.chain, q, calibration.free)
    J = J.reshape(len(q), -1, J.shape[-1]) / calibration.sigma
    return np.asarray(J.swapaxes(1, 2) @ J)


def _select_greedily(total: Array, information: Array, count: int) -> tuple[list[int], list[Array]]:
    """Return the indices of the most informative views, and the variances (6,) of the mount.

    The second list has the variances after each selected view.
    """
    selection: list[int] = []
    variances = []
    for _ in range(count):
        gain = _mount_log_det(total + information)
        gain[selection] = -np.inf
        selection.append(int(gain.argmax()))
        total = total + information[selection[-1]]
        variances.append(np.diag(np.linalg.inv(total))[:6])
    return selection, variances


def _mount_log_det(M: Array) -> Array:
    """Return log det (n,) of the information on the mount, with other parameters marginalised."""
    size = np.sqrt(np.einsum("nii->ni", M))
    scaled = M / size[:, :, None] / size[:, None, :]
    all_numbers, other_numbers = (
        np.linalg.slogdet(scaled)[1],
        np.linalg.slogdet(scaled[:, 6:, 6:])[1],
    )
    return np.asarray(all_numbers - other_numbers + 2 * np.log(size[:, :6]).sum(axis=1))
