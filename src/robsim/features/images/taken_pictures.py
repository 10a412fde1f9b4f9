"""The pictures of a step, which one stage takes and others read."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.kernels.machine.program import Blocks


class TakenPictures(NamedTuple):
    """Pictures of one camera that arrived at this step.

    Attributes
    ----------
    grey : ndarray of uint8, or of float32 if they are not rounded, shape (n, h, w)
        Grey values.
    runs : ndarray of int, shape (n,)
        Places of the runs of these pictures among the runs of the blocks.
    """

    grey: NDArray[Any]  # Any: two types
    runs: NDArray[np.int64]


def store_pictures(blocks: Blocks, pictures: dict[str, TakenPictures]) -> None:
    """Store the pictures of each camera for the later stages of this step."""
    blocks.made[TakenPictures] = pictures


def find_pictures(blocks: Blocks, camera: str) -> TakenPictures | None:
    """Return the pictures of a camera that arrived at this step, or None."""
    pictures: TakenPictures | None = blocks.made.get(TakenPictures, {}).get(camera)
    return pictures
