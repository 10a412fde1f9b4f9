"""The pictures of a step, which one stage takes and others read."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import replace_unchecked
from robsim.features.feature import Observation
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


def select_pictures(seen: Observation, taken: TakenPictures, time: float) -> Observation:
    """Return the observation of the runs whose picture arrived at a time, with these pictures."""
    some = seen if len(taken.runs) == seen.pixels_last.shape[-1] else seen.of_runs(taken.runs)
    return replace_unchecked(some, pictures=make_read_only(taken.grey.view()), time=time)


def put_results(blocks: Blocks, row: int, values: Array, taken: TakenPictures) -> None:
    """Write values (..., n) of the runs whose picture arrived to rows; others keep theirs."""
    if len(taken.runs) < blocks.runs:
        every = blocks.get(row)
        every[..., taken.runs] = values
        values = every
    blocks.put(row, values)
