"""The guarantee of the field of view: true marks stay inside while beliefs are within bounds.

The bound of the curvature and the theorem are in docs/constraints.md.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from robsim.constraints import FieldOfView
from robsim.kernels.control.view_barriers import compute_border_rows
from robsim.kernels.machine.program import Blocks, Program, evaluate_stages

FOCAL, CENTRE, SIZE = 500.0, (319.5, 239.5), (640, 480)
RATE, MARGIN, DT = 4.0, 8.0, 0.02


def move_points(P, V, t):
    """Return points P (N, 3) in camera axes after a camera moved for t along a twist V (6,)."""
    half = Rotation.from_rotvec(-V[3:] * t)
    angle = np.linalg.norm(V[3:]) * t
    if angle < 1e-12:
        return P - V[:3] * t
    k = V[3:] / np.linalg.norm(V[3:])
    a, b = np.sin(angle) / angle, (1 - np.cos(angle)) / angle
    way = t * (a * V[:3] + b * np.cross(k, V[:3]) + (1 - a) * k * (k @ V[:3]))
    return half.apply(P - way)


def curvature_bound(P, V):
    """Return the bound s rho (|omega| + 2 s) of the acceleration of normalised points, (N,)."""
    x = P[:, :2] / P[:, 2:]
    rho = np.sqrt(1 + (x**2).sum(axis=1))
    w = np.linalg.norm(V[3:])
    s = np.linalg.norm(V[:3]) / P[:, 2] + w * rho
    return s * rho * (w + 2 * s)


def draw_points(rng, N):
    """Return points (N, 3) in front of the camera and in its image."""
    Z = rng.uniform(0.2, 1.5, N)
    half = np.array(SIZE) / 2 / FOCAL
    return np.c_[rng.uniform(-1, 1, (N, 2)) * half, np.ones(N)] * Z[:, None]


def test_the_path_of_a_mark_bends_by_no_more_than_the_bound():
    rng = np.random.default_rng(3)
    for _ in range(300):
        P, V = draw_points(rng, 8), rng.normal(size=6) * rng.uniform(0, 1)
        t = rng.uniform(0.005, 0.08)
        path = [move_points(P, V, share * t) for share in np.linspace(0, 1, 9)]
        if min(each[:, 2].min() for each in path) < 0.1:
            continue
        x = [each[:, :2] / each[:, 2:] for each in path]
        h = 1e-6
        near = move_points(P, V, h)
        rate = (near[:, :2] / near[:, 2:] - x[0]) / h
        away = np.linalg.norm(x[-1] - x[0] - rate * t, axis=1)
        bound = 0.5 * t**2 * np.max([curvature_bound(each, V) for each in path], axis=0)
        assert (away <= 1.001 * bound + 1e-7).all()


def rows_of(pixels, depth, one, focal):
    """Return C (m, 6) and bound (m,) of believed marks of a flying camera."""
    N, ends = len(depth), 4
    camera = np.zeros(22)
    camera[:9] = np.array([[focal, 0, CENTRE[0]], [0, focal, CENTRE[1]], [0, 0, 1]]).ravel()
    camera[17:] = -0.5, SIZE[0] - 0.5, -0.5, SIZE[1] - 0.5, np.inf
    points = (pixels - CENTRE) / focal
    settings = [one.margin, one.rate, one.noise, one.depth_error, one.focal_error]

    def add(program, pixels, points, depth, camera, J, settings):
        C, bound = program.rows(4 * ends * N, 6), program.rows(4 * ends * N)
        program.add(
            compute_border_rows,
            **{"pixels": pixels, "points": points, "depth": depth, "camera": camera, "J": J},
            **{"lens": 0, "settings": settings, "dt": program.constant(DT), "ends": ends},
            **{"past": program.rows(0, 6), "C": C, "bound": bound},
        )
        return C, bound

    arrays = pixels, points, depth, camera, np.eye(6), np.array(settings)
    C, bound = evaluate_stages(add, [np.asarray(each, float)[..., None] for each in arrays])
    return C[..., 0], bound[..., 0]


def nearest_command(wish, C, bound):
    """Return a command that satisfies C qd >= bound, by projections onto violated rows."""
    qd = wish.copy()
    for _ in range(2000):
        short = bound - C @ qd
        i = int(np.argmax(short / np.linalg.norm(C, axis=1)))
        if short[i] <= 1e-12:
            return qd
        qd += C[i] * short[i] / (C[i] @ C[i])
    return None


def test_true_marks_stay_inside_while_depth_focal_length_and_noise_are_within_their_bounds():
    """d(T) - margin >= (1 - rate T) (d - margin) - curvature, for d = distance from a side."""
    rng = np.random.default_rng(7)
    one = FieldOfView(MARGIN, RATE, noise=1.0, depth_error=0.25, focal_error=0.05)
    lows, tested, near = np.array([-0.5, -0.5]), 0, 0
    highs = np.array(SIZE) - 0.5
    for _ in range(400):
        P = draw_points(rng, 4)
        true = FOCAL * P[:, :2] / P[:, 2:] + CENTRE
        focal = FOCAL * rng.uniform(1 / 1.05, 1.05)
        inverse = 1 / P[:, 2] * rng.uniform(1 / 1.25, 1.25, 4)  # believed
        measured = true + rng.uniform(-1, 1, true.shape)
        C, bound = rows_of(measured, 1 / inverse, one, focal)
        qd = nearest_command(rng.normal(size=6) * 0.7, C, bound)
        if qd is None:
            continue
        after = move_points(P, qd, DT)
        pixels = FOCAL * after[:, :2] / after[:, 2:] + CENTRE
        s = np.linalg.norm(qd[:3]) / P[:, 2] + np.linalg.norm(qd[3:]) * 1.3
        bend = np.maximum(curvature_bound(P, qd), curvature_bound(after, qd))
        drop = 0.5 * FOCAL * DT**2 * bend + 2 * s * one.noise * DT + 0.05**2 * FOCAL * s * DT
        for before, now in ((true - lows, pixels - lows), (highs - true, highs - pixels)):
            least = (1 - RATE * DT) * (before - MARGIN) - drop[:, None]
            assert (now - MARGIN >= least - 1e-9).all()
            near += int((now - MARGIN < least + 2 * drop[:, None] + 0.5).sum())
        tested += 1
    assert tested > 200
    assert near > 20  # the bound is not idle


def image_of(P):
    """Return pixels (N, 2) of points P (N, 3)."""
    return FOCAL * P[:, :2] / P[:, 2:] + CENTRE


def distances(pixels):
    """Return distances (4 N,) from the sides, in the order of the rows."""
    left, top = (pixels + 0.5).T
    right, bottom = (np.array(SIZE) - 0.5 - pixels).T
    return np.stack([left, right, top, bottom], axis=1).ravel()


def rows_in_sequence(images, V):
    """Return C (m, 6) and bound (m,) at each of some images of points P, for a last command V."""
    program, N = Program(), len(images[0])
    camera = np.zeros(22)
    camera[:9] = np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1]]).ravel()
    camera[17:] = -0.5, SIZE[0] - 0.5, -0.5, SIZE[1] - 0.5, np.inf
    pixels, points, depth = program.rows(N, 2), program.rows(N, 2), program.rows(N)
    C, bound = program.rows(4 * N, 6), program.rows(4 * N)
    program.add(
        compute_border_rows,
        **{"pixels": pixels, "points": points, "depth": depth, "J": program.constant(np.eye(6))},
        **{"camera": program.constant(camera), "lens": 0, "dt": program.constant(DT), "ends": 1},
        **{"settings": program.constant([MARGIN, RATE, 0, 0, 0]), "C": C, "bound": bound},
        past=program.constant(V[None]),
    )
    blocks, found = Blocks(program, np.zeros(1, dtype=np.int64)), []
    for step, P in enumerate(images):
        image = (pixels, image_of(P)), (points, P[:, :2] / P[:, 2:]), (depth, P[:, 2])
        for rows, values in image:
            blocks.put(rows, values[..., None])
        for part in program.segments():
            part(blocks, step)
        found.append((blocks.get(C)[..., 0], blocks.get(bound)[..., 0]))
    return found


def test_the_bound_has_the_second_order_of_a_falling_distance():
    """Beyond C qd dt, h falls by half the fall of its rate: what remains is of the third order."""
    rng = np.random.default_rng(5)
    for _ in range(100):
        P, V = draw_points(rng, 4), rng.normal(size=6) * 0.5
        images = [move_points(P, V, t) for t in (0.0, DT)]
        if min(each[:, 2].min() for each in images) < 0.15:
            continue
        (before, first), (C, bound) = rows_in_sequence(images, V)
        d = distances(image_of(images[0])) - MARGIN
        np.testing.assert_allclose(first, -np.where(d < 0, 2 * RATE, RATE) * d, rtol=1e-9)
        d = distances(image_of(images[1])) - MARGIN
        fall = np.maximum((before - C) @ V, 0.0)
        np.testing.assert_allclose(
            bound, -np.where(d < 0, 2 * RATE, RATE) * d + 0.5 * fall, rtol=1e-9, atol=1e-9
        )
        true = distances(image_of(move_points(P, V, 2 * DT))) - MARGIN - d
        straight = true - DT * C @ V
        falls = straight < -0.05  # pixels
        assert (np.abs(straight + 0.5 * DT * fall)[falls] < 0.35 * np.abs(straight[falls])).all()
