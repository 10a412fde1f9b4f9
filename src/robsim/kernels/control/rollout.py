"""Stages that assess the predicted motion of candidates, and select the command of one of them."""

import math

from robsim.kernels.images.lens_distortion import BORDER
from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import get, put, sqrt, where
from robsim.kernels.machine.stages import stage

SLACK = 1e-9  # pixels and coordinates, by which rounding may enlarge a distance


@part
def _smaller(a, b):
    """Return the smaller number; NaN in `a` counts as the smallest."""
    return where(a >= b, b, where(a < b, a, -math.inf))


@part
def _distance_from_border(w, pixel, camera):
    """Return the distance of a pixel from the nearest border of the image, in pixels."""
    b = camera + BORDER
    u, v = get(w, pixel), get(w, pixel + 1)
    across = _smaller(get(w, b + 1) - u, u - get(w, b))
    return _smaller(_smaller(get(w, b + 3) - v, v - get(w, b + 2)), across)


@stage
def count_feasible_instants(
    w,
    step,
    q="nq",
    nq="count",
    low="nq",
    high="nq",
    margin="row",
    started="row",
    room="2",
    feasible="row",
    count="row",
    images="each: pixels=N, 2; N=count; camera=22",
):
    """Count the instants until a mark comes near the border, or a joint leaves its limits.

    A mark must keep `margin` pixels from the border. If it is nearer at the first instant, this
    distance, or 0 outside the image, replaces the margin. A joint that starts beyond its limit must
    not move farther. `started` and `count` are 0 before the first instant.
    """
    border, joint = 0.0 * get(w, margin) + math.inf, 0.0 * get(w, margin) + math.inf
    for image in range(images[0]):
        pixels, camera = images[1 + 3 * image], images[3 + 3 * image]
        for n in range(images[2 + 3 * image]):
            border = _smaller(_distance_from_border(w, pixels + 2 * n, camera), border)
    for i in range(nq):
        x = get(w, q + i)
        joint = _smaller(_smaller(x - get(w, low + i), get(w, high + i) - x), joint)
    first = get(w, started) == 0.0
    least = where(border < get(w, margin), border, get(w, margin)) - SLACK
    put(w, room, where(first, where(least > 0.0, least, 0.0), get(w, room)))
    least = where(joint < 0.0, joint, 0.0) - SLACK
    put(w, room + 1, where(first, least, get(w, room + 1)))
    inside = (border >= get(w, room)) & (joint >= get(w, room + 1))
    inside = (first | (get(w, feasible) > 0.0)) & inside
    put(w, feasible, where(inside, 1.0, 0.0))
    put(w, count, get(w, count) + get(w, feasible))
    put(w, started, 1.0)


@stage
def measure_mark_distance(
    w, step, out="row", targets="each: T=3, 4; marks=N, 3; N=count; goal=N, 3"
):
    """Compute the root mean square distance of marks from their goal, in camera axes.

    T is the pose of a target in its camera, and `goal` are the marks at the goal in camera axes.
    """
    total, count = 0.0 * get(w, out), 0
    for target in range(targets[0]):
        at = 1 + 4 * target
        T, marks, goal = targets[at], targets[at + 1], targets[at + 3]
        count += targets[at + 2]
        for n in range(targets[at + 2]):
            m = marks + 3 * n
            for i in range(3):
                row = T + 4 * i
                x = get(w, row) * get(w, m) + get(w, row + 1) * get(w, m + 1)
                x = x + get(w, row + 2) * get(w, m + 2) + get(w, row + 3)
                x = x - get(w, goal + 3 * n + i)
                total = total + x * x
    put(w, out, sqrt(total / count))


@stage
def select_command(w, step, n="count", choice="row", qd="n", commands="each: n"):
    """Copy the command of the candidate with the number `choice`."""
    for j in range(n):
        x = get(w, commands[1] + j)
        for i in range(1, commands[0]):
            x = where(get(w, choice) == float(i), get(w, commands[1 + i] + j), x)
        put(w, qd + j, x)
