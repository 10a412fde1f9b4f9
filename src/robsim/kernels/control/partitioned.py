"""Stages of the partitioned law, in which area and angle drive the optical axis."""

import math

from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stage import stage


@stage
def along_axis(p, w, step):
    """Compute v_z and omega_z of a camera: (k, s, error, numbers, V).

    The last of k features is the area, the one before the angle; the numbers are the gain of the
    roll and the speed per unit of ln(sigma*/sigma), with sigma the square root of the area.
    """
    last, numbers, V = p[0] - 1, p[3], p[4]
    put(w, V + 5, get(w, numbers) * get(w, p[2] + last - 1))
    for i in range(WIDTH):
        area, error = w[(p[1] + last) * WIDTH + i], w[(p[2] + last) * WIDTH + i]
        growth = math.log((area - error) / area)
        w[(V + 2) * WIDTH + i] = 0.5 * w[(numbers + 1) * WIDTH + i] * growth


@stage
def across_axis(p, w, step):
    """Compute -gain e - L_z V_z, and L without its columns z: (k, gain, error, L, V, rate, out)."""
    gain, V = get(w, p[1]), p[4]
    for i in range(p[0]):
        row = p[3] + 6 * i
        rate = -get(w, p[2] + i) * gain - get(w, row + 2) * get(w, V + 2)
        put(w, p[5] + i, rate - get(w, row + 5) * get(w, V + 5))
        for j in range(4):
            put(w, p[6] + 4 * i + j, get(w, row + j + j // 2))
