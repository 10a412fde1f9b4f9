"""The observation of pictures by features, for the runs whose picture arrived."""

from __future__ import annotations

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import replace_unchecked
from robsim.features.feature import Observation
from robsim.features.images.taken_pictures import TakenPictures
from robsim.kernels.machine.program import Blocks


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
