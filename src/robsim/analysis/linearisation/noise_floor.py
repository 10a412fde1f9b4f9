"""The jitter that image noise causes in a linear loop."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robsim.analysis.linearisation.discrete_loop import DiscreteLoop
from robsim.analysis.linearisation.gain_dependence import GainDependence
from robsim.analysis.linearisation.linear_response import LinearResponse
from robsim.analysis.linearisation.loop_delays import LoopDelays
from robsim.analysis.linearisation.stability_limit import is_stable
from robsim.base.arrays import Array
from robsim.vision.detectors.mark_detector import MarkDetector
from robsim.world.sensing import Sensing

if TYPE_CHECKING:  # few loops have drives
    from robsim.analysis.linearisation.driven_loop import DrivenLoop

DOUBLINGS, ROUNDS, RELATIVE_TOLERANCE = 60, 100_000, 1e-12  # of the sums of covariances


@dataclass(frozen=True)
class NoiseFloor:
    """Jitter at the end of a run as root mean squares over time; infinite if the loop is unstable.

    Attributes
    ----------
    pixels : float
        Distance of a mark from its goal, in pixels.
    metres : float
        Distance of the camera from its position of rest, relative to the target.
    radians : float
        Angle of the camera from its orientation of rest, relative to the target.

    Examples
    --------
    >>> NoiseFloor(0.5, 1e-3, 0.01).metres
    0.001
    """

    pixels: float
    metres: float
    radians: float


def pixel_deviation(
    sensing: Sensing, robust: bool, detectors: Iterable[MarkDetector] = ()
) -> float:
    """Return the standard deviation of a pixel coordinate, with or without robust weights.

    The largest deviation of the detectors counts.
    """
    effects = (each.effect.deviation(robust) for each in sensing.list_active())
    return math.hypot(*effects, max((each.deviation for each in detectors), default=0.0))


def compute_noise_floor(
    response: LinearResponse,
    scaled: GainDependence,
    timing: LoopDelays,
    pixel: float,
    encoder: Array,
    driven: DrivenLoop | None = None,
) -> NoiseFloor:
    """Return the jitter for the standard deviations of a pixel and of the measured joints (n,).

    The covariance X of the state is the solution of X = A X A' + B W B', with the covariance W of
    the command. A loop `driven` by drives takes the place of the response to commands.
    """
    if driven is not None:
        return _driven_noise_floor(driven, response, timing, pixel, encoder)
    U, short = response.basis, timing.with_rarer_images
    loop = scaled.at(1.0, short)
    together = short.every // timing.every  # images for each image of the shorter loop
    if not is_stable(loop):
        return NoiseFloor(math.inf, math.inf, math.inf)
    share = pixel / math.sqrt(together)
    noise = np.hstack([U.T @ response.pixels * share, U.T @ response.joint_part * encoder])
    return _measure_jitter(loop, noise, U, response)


def _driven_noise_floor(
    driven: DrivenLoop, response: LinearResponse, timing: LoopDelays, pixel: float, encoder: Array
) -> NoiseFloor:
    """Return the jitter of a loop with drives."""
    short = timing.with_rarer_images
    loop = driven.at(1.0, short)
    if not is_stable(loop):
        return NoiseFloor(math.inf, math.inf, math.inf)
    share = pixel / math.sqrt(short.every // timing.every)
    noise = np.hstack([response.pixels * share, response.joint_part * encoder])
    return _measure_jitter(loop, noise, driven.basis, driven.response)


def _measure_jitter(
    loop: DiscreteLoop, noise: Array, basis: Array, response: LinearResponse
) -> NoiseFloor:
    """Return the jitter for errors of the command, columns of `noise`, of deviation 1."""
    size = float(np.abs(noise).max()) or 1.0
    W = (noise / size) @ (noise / size).T
    C = basis @ _mean_covariance(loop, _stationary_covariance(loop, W), W) @ basis.T
    marks, place, turn = (A @ C @ A.T for A in (response.marks, response.place, response.turn))
    each = np.trace(marks) * 2.0 / len(marks), np.trace(place), np.trace(turn)
    return NoiseFloor(*(size * math.sqrt(max(float(x), 0.0)) for x in each))


def _stationary_covariance(loop: DiscreteLoop, W: Array) -> Array:
    """Return the stationary covariance of the state at the arrival of images."""
    used_step, p = loop.steps()[0], loop.timing.lost
    if not p:
        return _sum_powers(used_step.of_state, used_step.of_error @ W @ used_step.of_error.T)
    lost_step = loop.steps(lost=True)[0]
    X = np.zeros((loop.size, loop.size))
    for _ in range(ROUNDS):
        before, X = X, (1.0 - p) * used_step.covariance(X, W) + p * lost_step.covariance(X, W)
        if np.abs(X - before).max() <= RELATIVE_TOLERANCE * np.abs(X).max():
            break
    return X


def _sum_powers(A: Array, Q: Array) -> Array:
    """Return the sum of A^k Q A'^k over k = 0, 1, 2, ..., by squaring A (Smith 1968)."""
    X = Q
    for _ in range(DOUBLINGS):
        more = A @ X @ A.T
        X, A = X + more, A @ A
        if np.abs(more).max() <= RELATIVE_TOLERANCE * np.abs(X).max():
            break
    return X


def _mean_covariance(loop: DiscreteLoop, X: Array, W: Array) -> Array:
    """Return the covariance of the motion, averaged over the periods from one image to the next."""
    p, k = loop.timing.lost, loop.image_part.shape[1]
    total = np.zeros((k, k))
    for share, lost in ((1.0 - p, False), (p, True)):
        path = loop.steps(lost)[1] if share else []
        total += share * sum((step.covariance(X, W) for step in path), start=np.zeros_like(total))
    return total / loop.timing.every
