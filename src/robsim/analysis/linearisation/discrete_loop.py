"""The linear loop from one image to the next, with delayed images, and the joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robsim.analysis.linearisation.linear_plant import LagPlant, LinearPlant, Matrix
from robsim.analysis.linearisation.loop_delays import LoopDelays


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
    """A discrete loop with a command (n,) that is linear in the motion (k,).

    The command is qd = image_part @ (motion in the image) + joint_part @ (present motion). The
    state at the arrival of an image consists of the state of the plant, the command of the last
    image, and the motions in the images that have not arrived yet. The plant of joints with a lag
    has the motion and the velocity, each (n,).
    """

    image_part: Matrix  # (n, k)
    joint_part: Matrix  # (n, k)
    timing: LoopDelays
    drives: LinearPlant | None = None  # None: joints with a lag

    @property
    def plant(self) -> LinearPlant:
        """The joints under a held command."""
        return self.drives or LagPlant(len(self.image_part), self.timing.lag)

    @property
    def size(self) -> int:
        """The number of components of the state."""
        n, k = self.image_part.shape
        return int(self.plant.size + n + self.timing.delay * k)

    def steps(self, lost: bool = False) -> tuple[LinearStep, list[LinearStep]]:
        """Return the map to the state at the next image, and the map to the motion in each period.

        If the image is `lost`, the previous image is used again.
        """
        t, plant = self.timing, self.plant
        n, k = self.image_part.shape
        whole = np.eye(self.size + n, dtype=self.image_part.dtype)
        sizes = [plant.size, n, *[k] * t.delay]
        state, command, *queue, error = np.split(whole, np.cumsum(sizes))
        if not lost:
            command = self.image_part @ (queue[0] if queue else plant.motion(state)) + error
        path, until_image = [], t.time_until_use
        for _ in range(t.every):
            motion = plant.motion(state)
            path.append(self._split(motion))
            u = command + self.joint_part @ motion
            if queue and 0.0 <= until_image < t.dt:
                imaged_motion = plant.motion(plant.advance(state, u, until_image))
            until_image -= t.dt
            state = plant.advance(state, u, t.dt)
        after = [state, command, *([*queue[1:], imaged_motion] if queue else [])]
        return self._split(np.concatenate(after)), path

    def _split(self, rows: Matrix) -> LinearStep:
        return LinearStep(rows[:, : self.size], rows[:, self.size :])
