"""Stages that determine whether a second scheme commands."""

from robsim.kernels.machine.lanes import absolute, get, put, where
from robsim.kernels.machine.stages import stage


@stage
def compare_error_bound(w, step, k="count", error="k", bound="row", out="row"):
    """Compute 1 if all |e| are below a bound, else 0."""
    bound = get(w, bound)
    below = absolute(get(w, error)) < bound
    for i in range(1, k):
        below = below & (absolute(get(w, error + i)) < bound)
    put(w, out, where(below, 1.0, 0.0))


@stage
def detect_near_border(w, step, numbers="3", out="row", images="each: pixels=N, 2; N=count"):
    """Compute 1 if a mark is near the border of its image, else 0.

    The numbers are the margin, the largest x and the largest y in pixels. The result is 0 if the
    pixels of any mark are NaN.
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
def latch_switch(w, step, latch="whole", condition="row", second="row"):
    """Compute `second`, 1 if the second scheme commands, else 0.

    It commands while the condition `condition`, and permanently after the first time if `latch`.
    """
    now = get(w, condition) > 0.0
    if latch and step > 0:
        now = now | (get(w, second) > 0.0)
    put(w, second, where(now, 1.0, 0.0))
