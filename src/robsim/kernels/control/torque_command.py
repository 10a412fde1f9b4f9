"""Stage of the gradient of an artificial potential energy of the error."""

import math

from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage


@stage
def compute_error_force(
    w, step, errors="k", k="count", stiffness="row", width="row or none", force="k"
):
    """Compute force = stiffness f(errors), with f(e) = e, or width tanh(e / width).

    The force is the gradient of the potential energy with respect to the errors.
    """
    for i in range(k):
        if width < 0:
            put(w, force + i, get(w, stiffness) * get(w, errors + i))
        else:
            for b in range(WIDTH):
                most = w[width * WIDTH + b]
                bounded = most * math.tanh(w[(errors + i) * WIDTH + b] / most)
                w[(force + i) * WIDTH + b] = w[stiffness * WIDTH + b] * bounded
