"""The linear loop from one image to the next, with delayed images and lagging joints."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robsim.analysis.linearisation.loop_delays import LoopDelays

Matrix = Any  # real, or complex for a single mode


class LinearStep(NamedTuple):
    """A linear map of the state, and of an error in the command that an image determines."""

    of_state: Matrix
    of_error: Matrix

    def covariance(self, X: Matrix, W: Matrix) -> Matrix:
        """Return the covariance after the map, from the covariances of state and error."""
        A, B = self
        return A @ X @ A.conj().T + B @ W @ B.conj().T


@dataclass(frozen=True, eq=False)
class DiscreteLoop:
    """A discrete loop with a command that is linear in the motion.

    The command is qd = image_part @ (motion in the image) + joint_part @ (present motion). The
    state at the arrival of an image consists of the motion, the velocity, the command of the last
    image, and the motions in the images that have not arrived yet, each (n,).
    """

    image_part: Matrix  # (n, n)
    joint_part: Matrix  # (n, n)
    timing: LoopDelays

    @property
    def size(self) -> int:
        """The number of components of the state."""
        return len(self.image_part) * (3 + self.timing.delay)

    def steps(self, lost: bool = False) -> tuple[LinearStep, list[LinearStep]]:
        """Return the map to the state at the next image, and the map to the motion in each period.

        If the image is `lost`, the previous image is used again.
        """
        n, t = len(self.image_part), self.timing
        whole = np.eye(self.size + n, dtype=self.image_part.dtype)
        motion, v, command, *queue, error = (whole[i : i + n] for i in range(0, len(whole), n))
        if not lost:
            command = self.image_part @ (queue[0] if queue else motion) + error
        path, until_image = [], t.time_until_use
        for _ in range(t.every):
            path.append(self._split(motion))
            u = command + self.joint_part @ motion
            if queue and 0.0 <= until_image < t.dt:
                imaged_motion = _integrate_lag(motion, v, u, until_image, t.lag)[0]
            until_image -= t.dt
            motion, v = _integrate_lag(motion, v, u, t.dt, t.lag)
        after = [motion, v, command, *([*queue[1:], imaged_motion] if queue else [])]
        return self._split(np.concatenate(after)), path

    def _split(self, rows: Matrix) -> LinearStep:
        return LinearStep(rows[:, : self.size], rows[:, self.size :])


def _integrate_lag(
    motion: Matrix, v: Matrix, u: Matrix, seconds: float, lag: float
) -> tuple[Matrix, Matrix]:
    """Return motion and velocity after some seconds under a constant command u: lag v' = u - v."""
    if lag == 0.0:
        return motion + seconds * u, u
    decayed = -math.expm1(-seconds / lag)  # decayed share of u - v
    return motion + seconds * u - (u - v) * (lag * decayed), v + (u - v) * decayed
