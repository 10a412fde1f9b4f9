"""Depth from known motion: the filter finds it, and never goes astray."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim.base.errors import InputError
from robsim.kernels.estimation import inverse_depth_filter as kernels
from robsim.kernels.formulas import se3
from robsim.servo.laws.depth_filter import DepthFilter

K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
DT = 0.04
seeds = st.integers(0, 2**32)


def move_marks(X, V, dt):
    """Marks X (N, 3, B) in axes of a camera that moved by exp(V dt)."""
    T = np.empty((3, 4, V.shape[1]))
    se3.exp_se3(np.ascontiguousarray(-V * dt), T)
    return np.einsum("rcb,ncb->nrb", T[:, :3], X) + T[:, 3]


def sigma(depth, K):
    """The standard deviations (2,) of a normalised point."""
    return depth.noise / np.abs(np.diagonal(K)[:2])


def begin(depth, x, K):
    """State (N, 3, B) and covariance (N, 3, 3, B) at the first points x (N, 2, B)."""
    N, _, runs = x.shape
    state, P = np.empty((N, 3, runs)), np.empty((N, 3, 3, runs))
    numbers = [1 / depth.start, depth.start_sigma / depth.start, *sigma(depth, K)]
    kernels.initialise_depth_filter(
        x, np.repeat(np.array(numbers)[:, None], runs, axis=1), state, P
    )
    return state, P


def step(depth, state, P, V, dt, x, K):
    """State and covariance after a twist V (6, B), when the points x (N, 2, B) are measured."""
    new, covariance = np.empty(state.shape), np.empty(P.shape)
    kernels.predict_depth(state, P, V, dt, new, covariance)
    kernels.correct_depth(new, covariance, x, np.outer(sigma(depth, K), np.ones(x.shape[2])))
    return new, covariance


def inverse(state):
    """The 1/Z (N, B) of a state."""
    return state[:, 2]


class Servo:
    """Four marks, and a camera with a twist that decays in one second, as in servoing."""

    def __init__(self, seed, runs=50, noise=0.0):
        self.rng, self.noise = np.random.default_rng(seed), noise
        size = 4, 2, runs
        goal = [self.rng.uniform(-0.15, 0.15, size), self.rng.uniform(0.4, 0.8, (4, 1, runs))]
        self.V = np.concatenate([self.rng.uniform(-w, w, (3, runs)) for w in (0.2, 0.3)])
        self.X = move_marks(np.concatenate(goal, axis=1), self.V, -1.0)

    def image(self):
        x = self.X[:, :2] / self.X[:, 2:]
        return x + self.rng.normal(size=x.shape) * self.noise / 800

    def run(self, depth, duration=5.0, known=1.0):
        """Relative errors of depth (steps, N, B), and all states and covariances."""
        state, P = begin(depth, self.image(), K)
        found, V = [], self.V.copy()
        for _ in range(round(duration / DT)):
            self.X = move_marks(self.X, V, DT)
            state, P = step(depth, state, P, known * V, DT, self.image(), K)
            found.append((np.abs(1.0 / inverse(state) / self.X[:, 2] - 1), state, P))
            V *= np.exp(-DT)
        return [np.array(part) for part in zip(*found, strict=True)]


# it finds the depth


@pytest.mark.parametrize("factor", [0.5, 1 / 1.5, 1.5, 2.0])
def test_without_noise_the_depth_converges_from_a_wrong_start(factor):
    error, _, _ = Servo(1).run(DepthFilter(0.6 * factor))
    assert np.median(error[-1]) < 1e-4
    assert np.quantile(error[-1], 0.95) < 1e-3


@pytest.mark.parametrize("factor", [0.5, 1 / 1.5, 1.5, 2.0])
def test_a_camera_that_keeps_moving_sideways_finds_every_depth(factor):
    servo = Servo(2)
    servo.V[:] = [[0.1], [0.05], [0.0], [0.0], [0.0], [0.0]]
    error, _, _ = servo.run(DepthFilter(0.6 * factor))
    assert error[-1].max() < 1e-3


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("factor", [0.5, 1.5, 2.0])
def test_with_a_pixel_of_noise_the_depth_is_found_to_a_few_percent(seed, factor):
    error, state, P = Servo(seed, noise=1.0).run(DepthFilter(0.6 * factor))
    assert np.median(error[-1]) < 0.01
    assert np.quantile(error[-1], 0.95) < 0.05
    assert np.isfinite(state).all() and np.isfinite(P).all()


def test_the_errors_are_about_as_large_as_the_covariance_predicts():
    """Before the drift that it allows for, and that these marks have not, counts."""
    servo = Servo(3, runs=300, noise=1.0)
    _, state, P = servo.run(DepthFilter(0.6), duration=0.24)
    off = (state[-1][:, 2] - 1 / servo.X[:, 2]) / np.sqrt(P[-1][:, 2, 2])
    assert 0.85 < np.sqrt(np.mean(off**2)) < 1.15
    assert abs(off.mean()) < 0.2


# it stays sane


def test_without_motion_nothing_is_learnt():
    servo = Servo(4, noise=1.0)
    servo.V[:] = 0.0
    depth = DepthFilter(0.7)
    _, state, P = servo.run(depth, duration=40.0)
    np.testing.assert_array_equal(1.0 / inverse(state[-1]), 1 / (1 / 0.7))
    assert np.isfinite(P).all() and (P[-1][:, 2, 2] >= P[0][:, 2, 2]).all()


def test_turning_in_place_gives_no_information_on_distance():
    servo = Servo(5)
    servo.V[:3] = 0.0
    expected = 0.9 * move_marks(
        np.concatenate([servo.image(), np.ones((4, 1, 50))], 1), servo.V, 1.0
    )
    depth = DepthFilter(0.9)
    state, P = begin(depth, servo.image(), K)
    for _ in range(25):
        servo.X = move_marks(servo.X, servo.V, DT)
        state, P = step(depth, state, P, servo.V, DT, servo.image(), K)
    np.testing.assert_allclose(1.0 / inverse(state), expected[:, 2], rtol=1e-9)


@pytest.mark.full
@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    seeds,
    st.sampled_from([0.02, 0.3, 5.0, 90.0]),
    st.sampled_from([0.01, 0.5, 5.0]),
    st.sampled_from([0.01, 1.0, 30.0]),
    st.sampled_from([-1.0, 0.0, 1.0, 3.0]),
)
def test_with_any_input_it_stays_finite_and_its_covariance_positive(
    seed, start, sigma, noise, known
):
    """Wrong starts, wrong trust, wrong twists, five pixels of noise."""
    servo = Servo(seed, runs=20, noise=5.0)
    _, state, P = servo.run(DepthFilter(start, sigma, noise), known=known)
    assert np.isfinite(state).all()
    np.testing.assert_array_equal(P, np.swapaxes(P, 2, 3))
    scale = np.sqrt(np.einsum("tniib->tnib", P))
    correlation = P / scale[:, :, :, None] / scale[:, :, None]
    assert np.linalg.eigvalsh(np.moveaxis(correlation, -1, 2)).min() > 0
    Z = 1.0 / inverse(state.reshape(-1, 3, 20))
    assert Z.min() >= 0.01 * (1 - 1e-12) and Z.max() <= 100 * (1 + 1e-12)


def test_a_mark_that_would_pass_the_camera_stays_in_front_of_it():
    depth = DepthFilter(0.2)
    V = np.array([[0.0], [0.0], [10.0], [0.0], [0.0], [0.0]])
    state, P = begin(depth, np.array([[[0.1], [0.2]]]), K)
    for _ in range(20):
        state, P = step(depth, state, P, V, DT, np.array([[[0.1], [0.2]]]), K)
        assert np.isfinite(state).all() and np.isfinite(P).all()
        assert 1.0 / inverse(state) >= 0.01 * (1 - 1e-12)


def test_a_mark_that_is_not_measured_is_predicted():
    servo = Servo(6)
    depth = DepthFilter(0.6)
    _, states, Ps = servo.run(depth, duration=1.0)
    before = np.concatenate([states[-1][:, :2], np.ones((4, 1, 50))], 1) / states[-1][:, 2:]
    unseen = np.full((4, 2, 50), np.nan)
    state, P = step(depth, states[-1], Ps[-1], servo.V, DT, unseen, K)
    X = move_marks(before, servo.V, DT)
    np.testing.assert_allclose(state[:, :2], X[:, :2] / X[:, 2:], atol=1e-14)
    np.testing.assert_allclose(1.0 / inverse(state), X[:, 2], rtol=1e-14)
    assert np.isfinite(P).all()


# the formulas


@settings(derandomize=True, deadline=None, max_examples=50)
@given(seeds)
def test_the_jacobian_of_the_motion_is_of_second_order_under_central_differences(seed):
    rng = np.random.default_rng(seed)
    T = np.empty((3, 4, 1))
    se3.exp_se3(rng.uniform(-0.2, 0.2, (6, 1)), T)
    at = np.array([*rng.uniform(-0.4, 0.4, 2), rng.uniform(0.5, 3)])
    F = np.array(kernels.move_mark(*at, T, 0)[1:])

    def error(h):
        ends = [[kernels.move_mark(*(at + s * h * d), T, 0)[0] for s in (1, -1)] for d in np.eye(3)]
        differences = [(np.array(a) - np.array(b)) / (2 * h) for a, b in ends]
        return np.abs(np.array(differences).T - F).max()

    assert error(1e-2) < 1e-3
    assert 3.5 < error(1e-2) / error(5e-3) < 4.5


def test_the_covariance_follows_the_jacobian_and_grows_by_the_drift():
    rng = np.random.default_rng(7)
    state = np.array([0.1, -0.2, 1.5])
    root = rng.normal(size=(3, 3))
    P, V = root @ root.T, rng.uniform(-0.3, 0.3, (6, 1))
    new, covariance, T = np.empty((1, 3, 1)), np.empty((1, 3, 3, 1)), np.empty((3, 4, 1))
    kernels.predict_depth(state.reshape(1, 3, 1), P.reshape(1, 3, 3, 1), V, 0.5, new, covariance)
    se3.exp_se3(-0.5 * V, T)
    expected, *F = kernels.move_mark(*state, T, 0)
    F = np.array(F)
    np.testing.assert_array_equal(new.ravel(), expected)
    drift = 0.5 * np.array([1e-8, 1e-8, (1e-2 * expected[2]) ** 2])
    np.testing.assert_allclose(covariance[0, :, :, 0], F @ P @ F.T + np.diag(drift), rtol=1e-13)


def test_the_correction_agrees_with_kalman():
    rng = np.random.default_rng(8)
    root = rng.normal(size=(3, 3))
    P, R = root @ root.T, np.diag([0.3, 0.7]) ** 2
    at, x = np.array([0.1, -0.2, 1.5]), np.array([0.15, -0.1])
    gain = P[:, :2] @ np.linalg.inv(P[:2, :2] + R)
    state, covariance = at.reshape(1, 3, 1).copy(), P.reshape(1, 3, 3, 1).copy()
    kernels.correct_depth(state, covariance, x.reshape(1, 2, 1), np.array([[0.3], [0.7]]))
    np.testing.assert_allclose(state.ravel(), at + gain @ (x - at[:2]), rtol=1e-13)
    np.testing.assert_allclose(covariance[0, :, :, 0], P - gain @ P[:2], rtol=0, atol=1e-13)


def test_each_axis_has_the_noise_of_its_focal_length():
    state, P = begin(DepthFilter(0.5, 0.2, 2.0), np.zeros((1, 2, 1)), np.diag([400.0, 500.0, 1]))
    np.testing.assert_allclose(P[0, :, :, 0], np.diag([0.005, 0.004, 0.4]) ** 2, rtol=1e-14)
    np.testing.assert_array_equal(state.ravel(), [0, 0, 2])


# every run on its own


def test_a_run_does_not_depend_on_its_batch_by_a_single_bit():
    servo = Servo(9, runs=37, noise=1.0)
    depth, V = DepthFilter(0.9), servo.V
    frames = [servo.image()]
    for _ in range(5):
        servo.X = move_marks(servo.X, V, DT)
        frames.append(servo.image())

    def run(part):
        some = [np.ascontiguousarray(a[..., part]) for a in (V, *frames)]
        state, P = begin(depth, some[1], K)
        for x in some[2:]:
            state, P = step(depth, state, P, some[0], DT, x, K)
        return state, P

    whole = run(slice(None))
    for part in (slice(0, 1), slice(3, 20), slice(36, None)):
        for a, b in zip(run(part), whole, strict=True):
            np.testing.assert_array_equal(a, b[..., part])


def test_the_arguments_are_not_changed():
    servo, depth = Servo(10), DepthFilter(0.9)
    given_ = *begin(depth, servo.image(), K), servo.V, servo.image()
    before = [a.copy() for a in given_]
    step(depth, *given_[:3], DT, given_[3], K)
    for a, b in zip(given_, before, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))])
def test_it_is_a_value(again):
    depth = DepthFilter(1, noise=2)
    assert again(depth) == depth == DepthFilter(1.0, 0.5, 2.0)
    assert hash(again(depth)) == hash(depth)


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0.0,), "DepthFilter.start must be a positive number \\(m\\), got 0.0"),
        ((1000.0,), "start of the depth filter must lie between 0.01 m and 100.0 m, got 1000.0"),
        ((1e-3,), "start of the depth filter must lie between"),
        ((1.0, -0.5), "DepthFilter.start_sigma must be a positive number"),
        ((1.0, 0.5, 0.0), "DepthFilter.noise must be a positive number .px."),
        (("far",), "DepthFilter.start: expected a number"),
        ((np.nan,), "DepthFilter.start: nan"),
    ],
)
def test_an_invalid_filter_is_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        DepthFilter(*arguments)
