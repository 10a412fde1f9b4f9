"""Stages of a law that aligns a triangle of marks a, b, c with a goal triangle.

A point has three rows and a twist (v, omega) six rows. v is the velocity of the world origin.
"""

from robsim.kernels.machine.kernel import part
from robsim.kernels.machine.lanes import get, put, sqrt
from robsim.kernels.machine.stages import stage


@part
def _load_point(w, row):
    """Return the point in three rows."""
    return get(w, row), get(w, row + 1), get(w, row + 2)


@part
def _cross_product(a, b):
    """Return the cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@part
def _unit_difference(a, b):
    """Return the unit vector of a - b."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    size = sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size


@part
def _triangle_normal(w, abc):
    """Return the normal P_ab x P_ac of the triangle; its length is the sine of the angle at a."""
    a = _load_point(w, abc)
    return _cross_product(
        _unit_difference(_load_point(w, abc + 3), a), _unit_difference(_load_point(w, abc + 6), a)
    )


@part
def _edge_axes(w, abc):
    """Return unit vectors along ab, across ab in the plane of the triangle, and normal to it."""
    ab, normal = (
        _unit_difference(_load_point(w, abc + 3), _load_point(w, abc)),
        _triangle_normal(w, abc),
    )
    size = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    normal = normal[0] / size, normal[1] / size, normal[2] / size
    return ab, _cross_product(normal, ab), normal


@stage
def transform_triangle(w, step, T="3, 4", points="3, 3", out="3, 3"):
    """Compute three points in the world from points in a frame at T."""
    for i in range(0, 9, 3):
        x, y, z = _load_point(w, points + i)
        for r in range(3):
            rotated = get(w, T + 4 * r) * x + get(w, T + 4 * r + 1) * y + get(w, T + 4 * r + 2) * z
            put(w, out + i + r, rotated + get(w, T + 4 * r + 3))


@stage
def compute_alignment_rotation(
    w, step, now="3, 3", goal="3, 3", gain="row", completed="whole", twist="6"
):
    """Compute omega of the twist that rotates a triangle towards its goal.

    If `completed`, omega aligns all axes of the triangles, else their normals only.
    """
    gain, omega = get(w, gain), twist + 3
    if completed:
        a, b = _edge_axes(w, now), _edge_axes(w, goal)
        one, two, three = (
            _cross_product(a[0], b[0]),
            _cross_product(a[1], b[1]),
            _cross_product(a[2], b[2]),
        )
        for r in range(3):
            put(w, omega + r, 0.5 * gain * (one[r] + two[r] + three[r]))
    else:
        turn = _cross_product(_triangle_normal(w, now), _triangle_normal(w, goal))
        for r in range(3):
            put(w, omega + r, gain * turn[r])


@stage
def compute_alignment_velocity(
    w, step, now="3, 3", goal="3, 3", gain="row", sign="whole", twist="6"
):
    """Compute v of the twist that moves mark a to its goal, gain (a* - a) + sign omega x a."""
    a, goal, gain, sign = _load_point(w, now), _load_point(w, goal), get(w, gain), 1.0 * sign
    lever = _cross_product(_load_point(w, twist + 3), a)
    for r in range(3):
        put(w, twist + r, gain * (goal[r] - a[r]) + sign * lever[r])


@stage
def shift_twist_reference(w, step, T="3, 4", twist="6"):
    """Replace v of a twist by the velocity v + omega x t of a frame at T."""
    at = get(w, T + 3), get(w, T + 7), get(w, T + 11)
    lever = _cross_product(_load_point(w, twist + 3), at)
    for r in range(3):
        put(w, twist + r, get(w, twist + r) + lever[r])
