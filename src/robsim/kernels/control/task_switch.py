"""Stages that say in which runs a second scheme takes over."""

from robsim.kernels.machine.lanes import absolute, get, put, where
from robsim.kernels.machine.stages import stage


@stage
def compare_error_bound(w, step, k="count", error="k", bound="row", out="row"):
    """Compute whether all |e| are below a bound: (k, error, bound, out)."""
    bound = get(w, bound)
    below = absolute(get(w, error)) < bound
    for i in range(1, k):
        below = below & (absolute(get(w, error + i)) < bound)
    put(w, out, where(below, 1.0, 0.0))


@stage
def detect_near_border(w, step, numbers="3", out="row", images="each: pixels=N, 2; N=count"):
    """Compute whether a mark is near the border of its image: (numbers, out, images).

    Then of each image its pixels, and how many marks. The numbers are the margin, and the largest
    x and y. A mark that is NaN is nowhere, and then none is near.
    """
    margin = get(w, numbers)
    near, known = margin < 0.0, margin > 0.0
    for image in range(images[0]):
        pixels = images[1 + 2 * image]
        for i in range(2 * images[2 + 2 * image]):
            x = get(w, pixels + i)
            near = near | (x < margin) | (get(w, numbers + 1 + i % 2) - x < margin)
            known = known & (absolute(x) >= 0.0)
    put(w, out, where(near & known, 1.0, 0.0))


@stage
def latch_switch(w, step, stays="whole", holds="row", second="row"):
    """Compute where the second scheme commands: (whether it stays so, holds, second)."""
    now = get(w, holds) > 0.0
    if stays and step > 0:
        now = now | (get(w, second) > 0.0)
    put(w, second, where(now, 1.0, 0.0))
