"""Stages that say in which runs a second scheme takes over."""

from robsim.kernels.machine.lanes import absolute, get, put, where
from robsim.kernels.machine.stage import stage


@stage
def error_below(p, w, step):
    """Compute whether all |e| are below a bound: (k, error, bound, out)."""
    bound = get(w, p[2])
    below = absolute(get(w, p[1])) < bound
    for i in range(1, p[0]):
        below = below & (absolute(get(w, p[1] + i)) < bound)
    put(w, p[3], where(below, 1.0, 0.0))


@stage
def near_border(p, w, step):
    """Compute whether a mark is near the border of its image: (numbers, out, images).

    Then of each image its pixels, and how many marks. The numbers are the margin, and the largest
    x and y. A mark that is NaN is nowhere, and then none is near.
    """
    margin = get(w, p[0])
    near, known = margin < 0.0, margin > 0.0
    for image in range(p[2]):
        pixels = p[3 + 2 * image]
        for i in range(2 * p[4 + 2 * image]):
            x = get(w, pixels + i)
            near = near | (x < margin) | (get(w, p[0] + 1 + i % 2) - x < margin)
            known = known & (absolute(x) >= 0.0)
    put(w, p[1], where(near & known, 1.0, 0.0))


@stage
def thrown(p, w, step):
    """Compute where the second scheme commands: (whether it stays so, holds, second)."""
    now = get(w, p[1]) > 0.0
    if p[0] and step > 0:
        now = now | (get(w, p[2]) > 0.0)
    put(w, p[2], where(now, 1.0, 0.0))
