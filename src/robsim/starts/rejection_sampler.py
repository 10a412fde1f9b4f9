"""Draw random starts, each again until it is accepted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.starts.start_kinematics import StartKinematics
from robsim.starts.start_samplers import Start
from robsim.statistics.random_numbers import RandomNumbers

ROUNDS = (1, 3, 12, 48, 192, 744)  # attempts at a start that are judged together

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
    """Return starts (draws, nq), the attempts that each took, and whether it is accepted.

    If no attempt is accepted, the start is the last one.

    source   random numbers of some draws at an attempt
    judge    whether starts (n, nq) of draws (n,) are accepted; None: one attempt, which need only
             be reached
    rounds   attempts that are made together
    """
    q0 = np.empty((len(draws), reach.scene.nq))
    tries, accepted = np.ones(len(draws), dtype=np.int64), np.zeros(len(draws), dtype=bool)
    left, first = np.arange(len(draws)), 0
    for count in rounds if judge else rounds[:1]:
        attempts = range(first, first + count)
        tried = [start.coordinates(reach, source(draws[left], attempt)) for attempt in attempts]
        q, fits = (np.stack(each, axis=1) for each in zip(*tried, strict=True))
        if judge and fits.any():
            fits[fits] = judge(np.repeat(draws[left], count)[fits.reshape(-1)], q[fits])
        accepted[left] = fits.any(axis=1)
        chosen = np.where(accepted[left], fits.argmax(axis=1), count - 1)
        q0[left] = q[np.arange(len(left)), chosen]
        tries[left] = first + chosen + 1
        left, first = left[~accepted[left]], first + count
        if not left.size:
            break
    return q0, tries, accepted
