"""Rejection sampling of starts: each start is sampled until an attempt is accepted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.starts.start_kinematics import StartKinematics
from robsim.starts.start_samplers import Start
from robsim.statistics.random_numbers import RandomNumbers

ROUNDS = (1, 3, 12, 48, 192, 744)  # attempts for a start that are checked together
MOST_UNREACHED = 64  # attempts after which a robot with few joints gives up out of its reach

Codes = NDArray[np.int64]
Flags = NDArray[np.bool_]
Source = Callable[[Codes, int], RandomNumbers]
Judge = Callable[[Codes, Array], Flags]


def draw_starts(
    start: Start,
    reach: StartKinematics,
    source: Source,
    draws: Codes,
    judge: Judge | None = None,
    rounds: Sequence[int] = ROUNDS,
) -> tuple[Array, Codes, Flags]:
    """Return starts (draws, nq), their attempts (draws,), and whether they are accepted (draws,).

    If no attempt is accepted, the start is the last attempt. A robot that does not reach every pose
    makes fewer attempts for a start if none of the first ones is within its reach.

    Parameters
    ----------
    start : Start
        Sampler of starts.
    reach : StartKinematics
        Moving frame, goal, target and kinematics.
    source : callable
        Function from draws and an attempt to their random numbers.
    draws : ndarray of int
        Numbers of the draws.
    judge : callable, optional
        Function from draws (n,) and starts (n, nq) to their acceptance (n,). Default: a single
        attempt, which is accepted if it is reachable.
    rounds : sequence of int
        Number of attempts in each round. All attempts of a round are checked together.
    """
    q0 = np.empty((len(draws), reach.scene.nq))
    tries, accepted = np.ones(len(draws), dtype=np.int64), np.zeros(len(draws), dtype=bool)
    reached = np.zeros(len(draws), dtype=bool)
    open_draws, first = np.arange(len(draws)), 0
    for count in rounds if judge else rounds[:1]:
        attempts = range(first, first + count)
        samples = [
            start.coordinates(reach, source(draws[open_draws], attempt)) for attempt in attempts
        ]
        q, fits = (np.stack(each, axis=1) for each in zip(*samples, strict=True))
        reached[open_draws] |= fits.any(axis=1)
        if judge and fits.any():
            fits[fits] = judge(np.repeat(draws[open_draws], count)[fits.reshape(-1)], q[fits])
        accepted[open_draws] = fits.any(axis=1)
        chosen = np.where(accepted[open_draws], fits.argmax(axis=1), count - 1)
        q0[open_draws] = q[np.arange(len(open_draws)), chosen]
        tries[open_draws] = first + chosen + 1
        open_draws, first = open_draws[~accepted[open_draws]], first + count
        if first >= MOST_UNREACHED and start.numbers and not reach.reaches_every_pose:
            open_draws = open_draws[reached[open_draws]]
        if not open_draws.size:
            break
    return q0, tries, accepted
