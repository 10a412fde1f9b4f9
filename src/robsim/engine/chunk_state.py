"""The state of a chunk of runs at one control instant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.formulas.projection_arrays import Projection
from robsim.servo.camera_target import PairKey
from robsim.servo.command import Command


class ChunkState(NamedTuple):
    """The true state of a chunk, its projections and its commands; the run is the last axis."""

    q: Array  # (nq, B)
    qd: Array  # (nv, B) commanded
    rates: Array  # (nv, B) velocities of the joints, if they differ from qd; else no rows
    projections: dict[PairKey, Projection]  # of every camera and its target
    pixels: Array  # (N, 2, B) image coordinates of all marks, without noise
    command: Command
    outcome: NDArray[np.int8]
