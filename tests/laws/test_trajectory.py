"""Trajectories: closed forms, derivatives, limits, and spherical interpolation."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.trajectory import Blends, Path, Quintic, Straight, Trapezoid

TRIES = settings(max_examples=30, deadline=None, derandomize=True)
SEEDS = st.integers(0, 2**32 - 1)
FINE = 4001  # instants


def instants(move, count=FINE):
    return np.linspace(0.0, move.duration, count)


def any_points(rng, count, axes):
    return rng.uniform(-2, 2, (count, axes)) * rng.choice([1e-3, 1, 1], (count, 1))


def any_pose(rng):
    return rs.Pose.at(*rng.uniform(-1, 1, 3), rotvec=rng.uniform(-1, 1, 3) * rng.uniform(0, 1.8))


# rest to rest


def test_the_quintic_is_the_polynomial_of_its_six_boundary_conditions():
    start, end, T = 0.3, -1.9, 1.7
    powers = np.arange(6)

    def row(t, order):
        factor = np.prod([powers - i for i in range(order)], axis=0) if order else np.ones(6)
        return factor * np.where(powers >= order, float(t) ** np.maximum(powers - order, 0), 0.0)

    A = [row(t, order) for t in (0.0, T) for order in range(3)]
    c = np.linalg.solve(A, [start, 0, 0, end, 0, 0])
    move = Quintic([start], [end], T)
    for t in np.linspace(0, T, 23)[1:-1]:
        found = move.at(t), move.velocity(t), move.acceleration(t)
        np.testing.assert_allclose(np.ravel(found), [row(t, k) @ c for k in range(3)], atol=2e-13)


def test_the_quintic_has_the_peaks_of_its_closed_form():
    way, T = np.array([2.0, -0.5, 0.0]), 3.0
    move = Quintic([0, 0, 1.0], way + np.array([0, 0, 1.0]), T)
    np.testing.assert_allclose(move.velocity(T / 2), 15 / 8 * way / T, rtol=1e-15)
    peak = T * (3 - np.sqrt(3)) / 6
    np.testing.assert_allclose(move.acceleration(peak), 10 / np.sqrt(3) * way / T**2, rtol=1e-14)
    t = instants(move)
    assert np.abs(move.velocity(t)).max() <= 15 / 8 * 2.0 / T * (1 + 1e-15)
    assert np.abs(move.acceleration(t)).max() <= 10 / np.sqrt(3) * 2.0 / T**2 * (1 + 1e-15)


@TRIES
@given(SEEDS)
def test_a_trapezoid_is_the_shortest_under_its_limits(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    start, end = any_points(rng, 2, n)
    v, a = rng.uniform(0.2, 3, (2, n))
    move = Trapezoid(start, end, speed=v, acceleration=a)
    d = np.abs(end - start)
    each = np.where(d >= v**2 / a, d / v + v / a, 2 * np.sqrt(d / a))
    assert move.duration == pytest.approx(each.max(), rel=1e-14)
    t = instants(move)
    speeds, accelerations = np.abs(move.velocity(t)), np.abs(move.acceleration(t))
    assert (speeds <= v * (1 + 1e-13)).all() and (accelerations <= a * (1 + 1e-13)).all()
    slowest = each.argmax()
    assert accelerations[:, slowest].max() == pytest.approx(a[slowest], rel=1e-12)
    if d[slowest] >= v[slowest] ** 2 / a[slowest]:
        assert speeds[:, slowest].max() == pytest.approx(v[slowest], rel=1e-12)
    moving = (speeds[1:-1] > 0).all(axis=0)
    assert (moving == (d > 0)).all()  # all start and stop together


def test_a_triangle_has_the_time_of_its_formula():
    move = Trapezoid([0.0], [0.08], speed=1.0, acceleration=2.0)
    assert move.duration == pytest.approx(2 * np.sqrt(0.08 / 2.0), rel=1e-15)
    assert move.velocity(move.duration / 2)[0] == pytest.approx(np.sqrt(0.08 * 2.0), rel=1e-14)


def test_a_motion_of_zero_length_takes_no_time():
    move = Trapezoid([1.0, 2.0], [1.0, 2.0], speed=1.0, acceleration=1.0)
    assert move.duration == 0.0
    for t in (-1.0, 0.0, 1.0):
        assert (move.at(t) == [1.0, 2.0]).all()
        assert not move.velocity(t).any() and not move.acceleration(t).any()


@pytest.mark.parametrize(
    "move",
    [
        Quintic([0.1, 1.0], [1.3, 1.0], 0.7),
        Trapezoid([0.1, 1.0], [1.3, -2.0], speed=1.0, acceleration=[2.0, 3.0]),
        Blends([[0.1, 1.0], [1.3, 0.7], [1.3, -1.1]], speed=1.0, acceleration=3.0),
    ],
)
def test_it_rests_at_its_ends_before_and_after(move):
    first, last = move.at([-1.0, 0.0]), move.at([move.duration, move.duration + 1.0, np.inf])
    assert (first == [0.1, 1.0]).all() and (last == last[0]).all() and np.ptp(last[:, 0]) == 0
    ends = [-1.0, 0.0, move.duration, 9.0]
    assert not move.velocity(ends).any()
    assert move.at(np.zeros((2, 3))).shape == (2, 3, 2) == move.velocity(np.zeros((2, 3))).shape
    assert move.at(0.2).shape == (2,) == move.acceleration(0.2).shape


@TRIES
@given(SEEDS)
def test_velocities_and_accelerations_are_derivatives_to_second_order(seed):
    rng = np.random.default_rng(seed)
    points = any_points(rng, 4, 2)
    limits = {"speed": rng.uniform(0.5, 2, 2), "acceleration": rng.uniform(0.5, 2, 2)}
    quintic = Quintic(points[0], points[1], rng.uniform(0.5, 3))
    for move in (quintic, Trapezoid(*points[:2], **limits), Blends(points, **limits)):
        t = rng.uniform(0.01, 0.99, 50) * move.duration

        def apart(of, derivative, h, t=t):
            return np.abs((of(t + h) - of(t - h)) / (2 * h) - derivative(t)).max(axis=1)

        scale = 1 + np.abs(move.acceleration(t)).max()
        for of, derivative in ((move.at, move.velocity), (move.velocity, move.acceleration)):
            off = apart(of, derivative, 1e-5 * move.duration)
            if move is quintic:  # smooth: the error falls by four if the step is halved
                coarse, fine = (apart(of, derivative, h * move.duration) for h in (2e-3, 1e-3))
                assert (fine <= 0.26 * coarse + 1e-9 * scale).all()
                assert off.max() < 1e-6 * scale
            else:  # exact within a parabola or a line, but not over a corner of the velocity
                assert np.quantile(off, 0.8) < 1e-6 * scale


def test_several_motions_at_once_are_each_as_alone():
    rng = np.random.default_rng(3)
    start, end, times = rng.normal(size=(5, 3)), rng.normal(size=3), rng.uniform(0, 3, (4, 5))
    limits = {"speed": [1.0, 2.0, 0.5], "acceleration": 1.5}
    both = Trapezoid(start, end, **limits), Quintic(start, end, 2.0)
    for b in range(5):
        alone = Trapezoid(start[b], end, **limits), Quintic(start[b], end, 2.0)
        assert both[0].duration[b] == alone[0].duration
        for many, one in zip(both, alone, strict=True):
            for name in ("at", "velocity", "acceleration"):
                found = getattr(many, name)(times)[:, b]
                np.testing.assert_array_equal(found, getattr(one, name)(times[:, b]))


# via points


@TRIES
@given(SEEDS, st.booleans())
def test_blends_obey_limits_and_pass_near_their_points(seed, tight):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    points = any_points(rng, int(rng.integers(2, 8)), n)
    v, a = rng.uniform(0.2, 3, (2, n))
    corner = rng.uniform(1e-3, 1e-2, n) if tight else None
    way = Blends(points, speed=v, acceleration=a, corner=corner)
    t = instants(way, 20_001)
    speed, acceleration = way.velocity(t), way.acceleration(t)
    assert (np.abs(speed) <= v * (1 + 1e-9)).all()
    assert (np.abs(acceleration) <= a * (1 + 1e-9)).all()  # two blends at once would exceed it
    jump = np.abs(np.diff(speed, axis=0)).max(axis=0)
    assert (jump <= a * (t[1] - t[0]) * (1 + 1e-6) + 1e-12).all()  # no jump of the velocity
    assert (way.at(0.0) == points[0]).all() and (way.at(way.duration) == points[-1]).all()
    np.testing.assert_allclose(np.abs(way.at(way.times) - points), way.misses, atol=1e-12)
    if tight:
        assert (way.misses <= corner * (1 + 1e-9)).all()
    assert way.duration >= Trapezoid(points[0], points[-1], speed=v, acceleration=a).duration - 1e-9


def test_two_points_are_a_trapezoid():
    limits = {"speed": 1.0, "acceleration": 2.0}
    for end in (3.0, 0.1):
        way, move = Blends([[0.0], [end]], **limits), Trapezoid([0.0], [end], **limits)
        assert way.duration == pytest.approx(move.duration, rel=1e-9)
        t = instants(move, 301)
        np.testing.assert_allclose(way.at(t), move.at(t), atol=1e-8)


def test_on_a_line_a_point_in_between_is_passed_at_full_speed():
    way = Blends([[0, 0], [1, 2], [2, 4]], speed=[1, 2], acceleration=4.0)
    assert way.misses.max() == 0.0
    np.testing.assert_allclose(way.velocity(way.times[1]), [1, 2], rtol=1e-15)


# straight ways


def slerp(a, b, s):
    """Of unit quaternions, by the formula of Shoemake."""
    b = b if a @ b >= 0 else -b
    angle = 2 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b))
    weight = np.sinc((1 - s) * angle / np.pi) * (1 - s), np.sinc(s * angle / np.pi) * s
    return (weight[0] * a + weight[1] * b) / np.sinc(angle / np.pi)


@TRIES
@given(SEEDS, st.sampled_from([None, 0.0, 1e-12, 1e-7, 1e-3, 3.1, np.pi - 1e-7]))
def test_the_orientation_is_interpolated_on_the_sphere(seed, angle):
    rng = np.random.default_rng(seed)
    A, B = any_pose(rng), any_pose(rng)
    if angle is not None:
        axis = rng.normal(size=3)
        B = A @ rs.Pose.at(0.1, 0.2, 0.3, rotvec=angle * axis / np.linalg.norm(axis))
    move = Straight(A, B, duration=1.0)
    for t in (0.0, 0.1, 0.5, 0.77, 1.0):
        s = float(Quintic([0.0], [1.0], 1.0).at(t)[0])
        T = rs.Pose(move.at(t))
        wanted = slerp(A.quaternion, B.quaternion, s)
        sign = np.sign(wanted @ T.quaternion)
        np.testing.assert_allclose(sign * T.quaternion, wanted, atol=1e-13 if s < 1 else 1e-15)
        np.testing.assert_allclose(T.position, (1 - s) * A.position + s * B.position, atol=1e-15)


def test_the_orientation_agrees_with_others():
    """SciPy 1.17 (Slerp) and mpmath with 40 digits agree on these numbers."""
    turns = (0.3, -1.2, 0.7), (-1.1, 0.4, 2.0)
    move = Straight(*(rs.Pose.at(rotvec=turn) for turn in turns), duration=1.0)
    wanted = [
        [0.072835265690858833, -0.49692034079801383, 0.40465196236814772, 0.76421331336514608],
        [-0.17696661795518629, -0.2337338985500432, 0.66207164761121536, 0.68971908356045356],
        [-0.39075891493144177, 0.077013271109449603, 0.78477142549693166, 0.47487918063244098],
    ]
    np.testing.assert_allclose(rs.Pose(move.at([0.25, 0.5, 0.75])).quaternion, wanted, atol=3e-16)


def test_small_turns_keep_their_relative_precision():
    for angle in 10.0 ** np.arange(-15, 1):
        move = Straight(rs.Pose.at(), rs.Pose.at(rotvec=(0, 0, angle)), duration=1.0)
        assert rs.Pose(move.at(0.5)).rotvec[2] == pytest.approx(angle / 2, rel=1e-14)


@TRIES
@given(SEEDS)
def test_twists_are_derivatives_of_the_pose(seed):
    rng = np.random.default_rng(seed)
    A, B = any_pose(rng), any_pose(rng)
    limits = {"speed": 0.5, "acceleration": 1.0, "turn": 1.0, "turn_acceleration": 2.0}
    smooth, limited = Straight(A, B, duration=2.0), Straight(A, B, **limits)
    for move, most in ((smooth, 1e-8), (limited, 1e-7)):
        t = rng.uniform(0.05, 0.95, 20) * move.duration
        h = 1e-6
        before, after, V = move.at(t - h), move.at(t + h), move.twist(t)
        v = (after[:, :3, 3] - before[:, :3, 3]) / (2 * h)
        turned = after[:, :3, :3] @ np.swapaxes(before[:, :3, :3], 1, 2)
        step = np.tile(np.eye(4), (20, 1, 1))
        step[:, :3, :3] = turned
        off = np.abs(np.hstack([v, rs.Pose(step).rotvec / (2 * h)]) - V).max(axis=1)
        assert np.quantile(off, 0.8) < most
    V = limited.twist(instants(limited))
    speeds, turns = np.linalg.norm(V[:, :3], axis=1), np.linalg.norm(V[:, 3:], axis=1)
    assert speeds.max() <= 0.5 * (1 + 1e-12) and turns.max() <= 1.0 * (1 + 1e-12)
    axis = V[:, 3:] / np.maximum(turns, 1e-300)[:, None]
    assert np.abs(axis[1:-1] - axis[1]).max() < 1e-12  # the axis does not change


def test_a_straight_way_ends_exactly_at_its_ends():
    rng = np.random.default_rng(5)
    A, B = any_pose(rng), any_pose(rng)
    move = Straight(A, B, speed=1.0, acceleration=1.0)
    assert (move.at([-1.0, 0.0])[:, :3, 3] == A.position).all()
    assert (move.at([move.duration, 99.0]) == B.matrix).all()
    assert not move.twist([-1.0, 0.0, move.duration, 99.0]).any()


def test_several_straight_ways_at_once_are_each_as_alone():
    rng = np.random.default_rng(6)
    starts = rs.Pose(np.stack([any_pose(rng).matrix for _ in range(4)]))
    end = any_pose(rng)
    limits = {"speed": 0.5, "acceleration": 1.0, "turn": 1.0, "turn_acceleration": 2.0}
    times = rng.uniform(0, 2, (3, 4))
    for told in ({"duration": 1.5}, limits):
        many = Straight(starts, end, **told)
        for b in range(4):
            one = Straight(starts[b], end, **told)
            np.testing.assert_array_equal(many.at(times)[:, b], one.at(times[:, b]))
            np.testing.assert_array_equal(many.twist(times)[:, b], one.twist(times[:, b]))
            assert np.broadcast_to(many.duration, 4)[b] == one.duration


def test_a_path_is_its_parts_one_after_the_other():
    rng = np.random.default_rng(7)
    poses = [any_pose(rng) for _ in range(4)]
    parts = [Straight(*pair, 1.0 + i) for i, pair in enumerate(pairwise(poses))]
    path = Path(parts)
    assert path.duration == 6.0 and path.start == poses[0] and path.end == poses[-1]
    t = np.array([[-1.0, 0.2, 1.0], [2.5, 4.0, 99.0]])
    wanted = [parts[0].at(0), parts[0].at(0.2), poses[1]]
    wanted += [parts[1].at(1.5), parts[2].at(1.0), poses[3]]
    stacked = np.stack([np.asarray(T) for T in wanted]).reshape(2, 3, 4, 4)
    np.testing.assert_array_equal(path.at(t), stacked)
    np.testing.assert_array_equal(path.twist(2.5), parts[1].twist(1.5))
    assert not path.twist([1.0, 3.0, 6.0]).any()


# values


@pytest.mark.parametrize(
    "made",
    [
        lambda: Quintic([0.0], [1.0], 2.0),
        lambda: Trapezoid([0.0, 1.0], [1.0, 0.0], speed=1.0, acceleration=[1.0, 2.0]),
        lambda: Blends([[0.0], [1.0], [0.5]], speed=1.0, acceleration=1.0, corner=0.1),
        lambda: Straight(rs.Pose.at(0, 0, 1), np.eye(4), 2.0),
        lambda: Path([Straight(rs.Pose.at(0, 0, 1), np.eye(4), speed=1, acceleration=1)]),
    ],
)
def test_trajectories_are_values(made):
    import copy
    import pickle

    one, other = made(), made()
    assert one == other and hash(one) == hash(other) and len({one, other}) == 1
    for again in (copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
        assert again == one and np.array_equal(again.at(0.3), one.at(0.3))
    with pytest.raises(AttributeError):
        one.start = 0
    assert type(one).__name__ in repr(one)


# refusals

GOOD = {"speed": 1.0, "acceleration": 1.0}


@pytest.mark.parametrize(
    "made,message",
    [
        (lambda: Quintic([0.0], [1.0], -1.0), "Quintic.duration must be a positive number"),
        (lambda: Quintic([0.0], [1.0], None), "Quintic.duration: expected a number, got None"),
        (lambda: Quintic([0.0], [1.0, 2.0], 1.0), "start and end: 1 axes and 2 axes"),
        (lambda: Quintic([np.nan], [1.0], 1.0), "start: nan at index"),
        (lambda: Quintic(1.0, 2.0, 1.0), r"start: expected shape \(..., n\)"),
        (lambda: Quintic(np.zeros((2, 1)), np.zeros((3, 1)), 1.0), "batches of unequal shapes"),
        (lambda: Quintic([0.0], [1.0], 1.0).at(np.nan), "every time must be a number, got nan"),
        (lambda: Quintic([0.0], [1.0], 1.0).at("soon"), "expected numbers, got 'soon'"),
        (lambda: Trapezoid([0.0], [1.0], speed=0.0, acceleration=1.0), "speed must be a positive"),
        (lambda: Trapezoid([0.0], [1.0], speed=1.0, acceleration=[1, 2]), "2 numbers for 1 axes"),
        (lambda: Trapezoid([0.0], [1.0], speed=1.0, acceleration=None), "acceleration: expected"),
        (lambda: Trapezoid([0.0], [1.0], speed=np.inf, acceleration=1.0), "speed: inf"),
        (lambda: Blends([[0.0]], **GOOD), r"expected shape \(m, n\) with m > 1"),
        (lambda: Blends([0.0, 1.0], **GOOD), r"points: expected shape"),
        (lambda: Blends([[0.0], [1.0], [1.0]], **GOOD), "number 1 and 2 are the same"),
        (lambda: Blends([[0.0], [1.0]], corner=-1.0, **GOOD), "corner must be a positive number"),
        (lambda: Blends([[0.0], [1.0]], corner=[1.0, 2.0], **GOOD), "corner: 2 numbers for 1 axes"),
        (lambda: Blends([[0.0], [np.inf]], **GOOD), "points: inf at index"),
        (lambda: Straight(np.eye(3), np.eye(4), 1.0), "start: pose: expected shape"),
        (lambda: Straight(np.eye(4), 2 * np.eye(4), 1.0), "end: not a rotation"),
        (lambda: Straight(np.eye(4), np.eye(4)), "give either duration, or speed"),
        (lambda: Straight(np.eye(4), np.eye(4), 1.0, speed=1.0, acceleration=1.0), "give either"),
        (lambda: Straight(np.eye(4), np.eye(4), speed=1.0), "speed and acceleration: give both"),
        (lambda: Straight(np.eye(4), np.eye(4), turn=1.0), "turn and turn_acceleration: give both"),
        (lambda: Straight(np.eye(4), np.eye(4), 0.0), "duration must be a positive number"),
        (
            lambda: Straight(np.eye(4), rs.Pose.at(1), turn=1.0, turn_acceleration=1.0),
            "duration of this motion is undefined: give speed and acceleration as well",
        ),
        (
            lambda: Straight(np.eye(4), rs.Pose.at(rotvec=(1, 0, 0)), **GOOD),
            "duration of this motion is undefined: give turn and turn_acceleration as well",
        ),
        (lambda: Path([]), "path: expected a list of Straight"),
        (lambda: Path(Straight(np.eye(4), np.eye(4), 1.0)), "path: expected a list of Straight"),
        (
            lambda: Path([Straight(np.eye(4), rs.Pose.at(1), 1.0)] * 2),
            "part 1 does not start where part 0 ends; they are 1 apart",
        ),
        (
            lambda: Path([Straight(np.stack([np.eye(4)] * 2), rs.Pose.at(1), 1.0)]),
            "part 0 is several motions at once",
        ),
    ],
)
def test_bad_input_is_one_clear_error(made, message):
    with pytest.raises(rs.errors.InputError, match=message):
        made()
