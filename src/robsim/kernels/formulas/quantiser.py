"""Quantisation: rounding of numbers to multiples of a step, as in encoders and pixel grids."""

from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import absolute, floor, where

EXACT_STEPS = 2.0**52  # steps: a larger number is a multiple of the step within its rounding


@part
def round_to_step(value, step):
    """Return the nearest multiple of a step, or the value itself if the step is zero."""
    count = value / step  # infinite or NaN if the step is zero
    return where(absolute(count) < EXACT_STEPS, step * floor(count + 0.5), value)
