"""Numbers in whole steps, as encoders and pixel grids have them."""

import numpy as np

from robsim.kernels.jit import part

WHOLE = 2.0**52  # steps: a number that has more of them is whole to its own rounding


@part
def in_steps(value, step):
    """The whole multiple of a step that is nearest; the value itself where the step is zero."""
    count = value / step  # infinite or NaN where the step is zero
    return step * np.floor(count + 0.5) if abs(count) < WHOLE else value
