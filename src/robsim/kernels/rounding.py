"""Numbers in whole steps, as cameras and encoders give them."""

import numpy as np

from robsim.kernels.jit import part


@part
def whole_steps(x, step):
    """The multiple of `step` that is nearest to x; NaN stays NaN, which math.floor would not do."""
    return step * np.floor(x / step + 0.5)
