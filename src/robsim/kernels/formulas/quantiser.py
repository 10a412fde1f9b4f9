"""Rounding of numbers to whole steps, as in encoders and pixel grids."""

from robsim.kernels.machine.jit import part
from robsim.kernels.machine.lanes import absolute, floor, where

EXACT_STEPS = 2.0**52  # steps: a number that has more of them is whole to its own rounding


@part
def round_to_step(value, step):
    """Return the nearest whole multiple of a step, or the value itself if the step is zero."""
    count = value / step  # infinite or NaN where the step is zero
    return where(absolute(count) < EXACT_STEPS, step * floor(count + 0.5), value)
