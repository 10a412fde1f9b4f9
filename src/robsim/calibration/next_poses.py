"""The views to take next: those that tell most of the mount."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.calibration.calibration_fit import CalibrationFit
from robsim.calibration.calibration_model import predict_rates
from robsim.vision.camera import Visibility


@dataclass(frozen=True, eq=False, repr=False)
class NextPoses(Value):
    """Coordinates from which to look next, the most telling first.

    q         (n, nq) coordinates
    number    (n,) which of the candidates they are
    position  (n,) standard deviation of the mount's position that is left after each, metres
    angle     (n,) likewise of its orientation, radians; both are roots of the sum over three axes
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


def select_next_poses(found: CalibrationFit, candidates: Any, count: int) -> NextPoses:
    """Return coordinates from which to look next, one after the other the most telling.

    candidates  (n, nq) coordinates, as from `viewpoints`; those beyond the limits of the joints,
                or from which not the whole target is seen, are left out
    count       how many to choose; no candidate is chosen twice

    The gain of a view with rates J is that in log det of the mount's information, what all views so
    far tell of the other numbers being taken into account: D-optimal design for the mount alone
    (D_s, Atkinson, Donev and Tobias 2007), of which no choice of units is a part. Each choice is
    the best after those before. InputError: fewer candidates than `count` will do.

    >>> from robsim import calibrate, examples, load_scenario
    >>> from robsim.calibration import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> q = bench.start + turns
    >>> found = calibrate(simulate_views(bench, q), ["focal", "center"])
    >>> select_next_poses(found, q, 2).number  # which of the same views to take once more
    array([2, 0])
    """
    views = found.views
    q = views.scene.coordinates(candidates, "candidates", limits=False)
    if q.ndim != 2:
        raise InputError(f"candidates: expected (n, {views.scene.nq}), got {q.shape}")
    fit = np.flatnonzero(_is_usable_view(found, q))
    wanted = as_integer(count, "count", 1)
    if len(fit) < wanted:
        raise InputError(
            f"candidates: {len(fit)} of {len(q)} see the whole target within the limits of the "
            f"joints, and {wanted} are wanted"
        )
    told = _view_information(found, q[fit])
    chosen, left = _select_greedily(np.asarray(np.linalg.inv(found.covariance)), told, wanted)
    spread = np.sqrt([[C[:3].sum(), C[3:].sum()] for C in left]).T
    number = fit[chosen]
    return NextPoses(
        make_read_only(q[number]),
        make_read_only(number),
        make_read_only(spread[0]),
        make_read_only(spread[1]),
    )


def _is_usable_view(found: CalibrationFit, q: Array) -> NDArray[np.bool_]:
    """Return which coordinates are within limits and see the whole target."""
    low, high = found.views.scene.limits.T
    view = found.scene.view(q, found.views.camera, found.views.target)
    within = ((q >= low) & (q <= high)).all(axis=1)
    return np.asarray(within & (view.visibility == Visibility.IN_IMAGE).all(axis=1))


def _view_information(found: CalibrationFit, q: Array) -> Array:
    """Return what a view from each of some coordinates tells, J'J / sigma^2 (n, P, P)."""
    views = found.views
    J = predict_rates(found.model, views.thing.marks, views.chain, q, found.free)
    J = J.reshape(len(q), -1, J.shape[-1]) / found.sigma
    return np.asarray(J.swapaxes(1, 2) @ J)


def _select_greedily(known: Array, told: Array, count: int) -> tuple[list[int], list[Array]]:
    """Return which views tell most, and the variances (6,) of the mount after each."""
    chosen: list[int] = []
    left = []
    for _ in range(count):
        gain = _mount_log_det(known + told)
        gain[chosen] = -np.inf
        chosen.append(int(gain.argmax()))
        known = known + told[chosen[-1]]
        left.append(np.diag(np.linalg.inv(known))[:6])
    return chosen, left


def _mount_log_det(M: Array) -> Array:
    """Return log det (n,) of the mount's information, without what the other numbers leave open."""
    size = np.sqrt(np.einsum("nii->ni", M))
    scaled = M / size[:, :, None] / size[:, None, :]
    whole_, rest = np.linalg.slogdet(scaled)[1], np.linalg.slogdet(scaled[:, 6:, 6:])[1]
    return np.asarray(whole_ - rest + 2 * np.log(size[:, :6]).sum(axis=1))
