"""Stages of the partitioned law: area and angle command the motion along the optical axis."""

import math

from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage


@stage
def command_optical_axis(w, step, k="count", s="k", errors="k", numbers="2", V="6"):
    """Compute v_z and omega_z of a camera's twist V.

    The last two of the k features are the angle and the area. The numbers are the gain of the roll,
    and the speed per unit of ln(sigma*/sigma) with the square root sigma of the area.
    """
    last = k - 1
    put(w, V + 5, get(w, numbers) * get(w, errors + last - 1))
    for i in range(WIDTH):
        area, error = w[(s + last) * WIDTH + i], w[(errors + last) * WIDTH + i]
        growth = math.log((area - error) / area)
        w[(V + 2) * WIDTH + i] = 0.5 * w[(numbers + 1) * WIDTH + i] * growth


@stage
def compensate_optical_axis(
    w, step, k="count", gain="row", errors="k", L="k, 6", V="6", rates="k", out="k, 4"
):
    """Compute rates = -gain e - L_z V_z, and `out`, the matrix L without its columns of z."""
    gain = get(w, gain)
    for i in range(k):
        row = L + 6 * i
        rate = -get(w, errors + i) * gain - get(w, row + 2) * get(w, V + 2)
        put(w, rates + i, rate - get(w, row + 5) * get(w, V + 5))
        for j in range(4):
            put(w, out + 4 * i + j, get(w, row + j + j // 2))
