"""The linear loop from one image to the next, with late and rare images and joints that lag."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.analysis.linearisation.loop_delays import LoopDelays

Matrix = Any  # real, or complex where it is that of a mode


class LinearStep(NamedTuple):
    """A linear map: of the state and of an error in the command of an image."""

    of_state: Matrix
    of_error: Matrix

    def covariance(self, X: Matrix, W: Matrix) -> Matrix:
        """Return the covariance of what is mapped, from those of state and error."""
        A, B = self
        return A @ X @ A.conj().T + B @ W @ B.conj().T


@dataclass(frozen=True, eq=False)
class DiscreteLoop:
    """A loop whose command is seen @ motion, when the image was taken, plus now @ motion.

    The state at the arrival of an image is (motion, velocity, command of the last image, motions in
    the images that are on their way), each (n,).
    """

    seen: Matrix  # (n, n)
    now: Matrix  # (n, n)
    timing: LoopDelays

    @property
    def size(self) -> int:
        """The number of components of the state of the sampled loop."""
        return len(self.seen) * (3 + self.timing.delay)

    def steps(self, lost: bool = False) -> tuple[LinearStep, list[LinearStep]]:
        """Return the maps to the state at the next image, and to the motion in each period.

        Where the image is `lost`, the last one is used again.
        """
        n, t = len(self.seen), self.timing
        whole = np.eye(self.size + n, dtype=self.seen.dtype)
        motion, v, command, *queue, error = (whole[i : i + n] for i in range(0, len(whole), n))
        if not lost:
            command = self.seen @ (queue[0] if queue else motion) + error
        path, left = [], t.taken
        for _ in range(t.every):
            path.append(self._split(motion))
            u = command + self.now @ motion
            if queue and 0.0 <= left < t.dt:
                taken = _integrate_lag(motion, v, u, left, t.lag)[0]
            left -= t.dt
            motion, v = _integrate_lag(motion, v, u, t.dt, t.lag)
        after = [motion, v, command, *([*queue[1:], taken] if queue else [])]
        return self._split(np.concatenate(after)), path

    def _split(self, rows: Matrix) -> LinearStep:
        return LinearStep(rows[:, : self.size], rows[:, self.size :])


def _integrate_lag(
    motion: Matrix, v: Matrix, u: Matrix, seconds: float, lag: float
) -> tuple[Matrix, Matrix]:
    """Return motion and velocity some time later, under a command u: lag v' = u - v."""
    if lag == 0.0:
        return motion + seconds * u, u
    gone = -math.expm1(-seconds / lag)  # of the gap
    return motion + seconds * u - (u - v) * (lag * gone), v + (u - v) * gone
