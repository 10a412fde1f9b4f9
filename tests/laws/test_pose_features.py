"""The pose of a target from its image, and the features of position-based servoing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

import robsim as rs
from robsim.base.errors import GoalError, InputError
from robsim.features.pose_error import ThetaU, Translation
from robsim.kernels.estimation.pose_fit import fit_pose
from robsim.kernels.estimation.pose_newton import pose_hessian
from robsim.kernels.features.pose_features import put_theta_u_rates
from robsim.kernels.formulas import se3
from robsim.kernels.machine.compiler import dispatchers  # noqa: F401  Numba learns of lanes
from robsim.kernels.machine.lanes import WIDTH, get
from robsim.testing import check_feature

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)
CAMERA = rs.Camera([[800, 0, 320], [0, 820, 240], [0, 0, 1]])
CLOUD = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0], [0, 0, -0.1]])
FEATURES = pytest.mark.parametrize(
    "feature", [ThetaU(), Translation(), Translation("camera")], ids=["theta_u", "goal", "camera"]
)


def close(a, b, tolerance):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def last(poses):
    return np.ascontiguousarray(np.moveaxis(np.asarray(poses)[..., :3, :], 0, -1))


def poses(seed, runs, far=1.0, turn=0.6):
    """(runs) poses of a target, `far` to twice as far in front of a camera."""
    rng = np.random.default_rng(seed)
    w = rng.uniform(-turn, turn, (runs, 3))
    T = np.array(rs.Pose.exp(np.hstack([np.zeros((runs, 3)), w])).matrix)
    T[:, :3, 3] = far * rng.uniform([-0.2, -0.2, 1.0], [0.2, 0.2, 2.0], (runs, 3))
    return rs.Pose(T)


def image(T, marks=CLOUD):
    """(N, 2, runs) normalised points."""
    X = T @ np.broadcast_to(marks, (len(T.matrix), *marks.shape))
    return np.ascontiguousarray(np.moveaxis(X[..., :2] / X[..., 2:], 0, -1))


def fitted(x, guess, marks=CLOUD):
    T = np.empty(guess.shape)
    fit_pose(np.repeat(marks[..., None], x.shape[2], axis=2), x, guess, T)
    return T


def seen_at(T, guess=None):
    """The observation of CLOUD at poses (runs) of it."""
    pixels = CAMERA.project(CLOUD, T.inv())
    depth = (T @ np.broadcast_to(CLOUD, (len(T.matrix), *CLOUD.shape)))[..., 2]
    guess = T if guess is None else guess
    return rs.features.Observation.of(pixels, depth, CAMERA, model=CLOUD, guess=guess)


# the fit


@steady
@given(seed=seeds)
def test_an_exact_guess_is_returned(seed):
    T = poses(seed, 50)
    np.testing.assert_array_equal(fitted(image(T), last(T)), last(T))


@steady
@given(seed=seeds, far=st.sampled_from([0.5, 1.0, 3.0]))
def test_an_exact_image_gives_the_pose_from_a_guess_nearby(seed, far):
    T = poses(seed, 50, far)
    off = np.random.default_rng(seed).uniform(-0.1, 0.1, (50, 6)) * [*[far] * 3, 1, 1, 1]
    found = fitted(image(T), last(rs.Pose.exp(off) @ T))
    close(found, last(T), 1e-12 * far)


@steady
@given(seed=seeds)
def test_the_fit_of_a_noisy_image_is_stationary(seed):
    """No small motion of the target lowers the sum of squares: its gradient L' e is zero."""
    T = poses(seed, 20)
    x = image(T) + np.random.default_rng(seed).normal(scale=1 / 800, size=(5, 2, 20))
    found = fitted(x, last(T))
    assert np.isfinite(found).all()
    X = np.einsum("rcb,nc->bnr", found[:, :3], CLOUD) + np.moveaxis(found[:, 3], -1, 0)[:, None]
    error = (X[..., :2] / X[..., 2:]).reshape(20, -1) - np.moveaxis(x, -1, 0).reshape(20, -1)
    seen = rs.features.Observation.of(X[..., :2] / X[..., 2:], X[..., 2], rs.Camera(np.eye(3)))
    close(np.einsum("bkc,bk->bc", rs.features.Points().interaction(seen), error), 0, 1e-10)


def test_a_fit_does_not_depend_on_the_other_runs():
    T = poses(5, 60)
    rng = np.random.default_rng(5)
    x, off = image(T) + rng.normal(scale=2e-3, size=(5, 2, 60)), rng.normal(size=(60, 6)) * 0.2
    guess = last(rs.Pose.exp(off) @ T)
    together = fitted(x, guess)
    for b in range(60):
        alone = fitted(x[..., b : b + 1].copy(), guess[..., b : b + 1].copy())
        np.testing.assert_array_equal(alone[..., 0], together[..., b])


def test_a_fit_that_gets_nowhere_is_nan_and_leaves_the_others_alone():
    T = poses(6, 4)
    x, guess = image(T), last(T)
    guess[2, 3, 1] = -1.0  # behind the camera
    x[0, 0, 2] = np.nan  # a mark that is not seen
    found = fitted(x, guess)
    assert np.isnan(found[..., 1:3]).all()
    np.testing.assert_array_equal(found[..., [0, 3]], last(T)[..., [0, 3]])


def squares(T, x, marks):
    """(runs,) sum of squared distances in the image."""
    X = np.einsum("rcb,nc->nrb", T[:, :3], marks) + T[:, 3]
    return ((X[:, :2] / X[:, 2:] - x) ** 2).sum((0, 1))


def test_the_image_of_no_pose_gives_a_pose_that_is_no_worse_than_the_guess():
    x, guess = np.random.default_rng(7).uniform(-1, 1, (5, 2, 200)), last(poses(7, 200))
    found = fitted(x, guess)
    assert (squares(found, x, CLOUD) < squares(guess, x, CLOUD)).all()


@pytest.mark.parametrize("count", [3, 4])
@pytest.mark.parametrize("pixels", [0.3, 1.0, 3.0])
def test_a_small_plate_seen_from_in_front_has_a_pose_whatever_the_noise(count, pixels):
    """Noise hides its tilt: near a flat minimum of the squares, an update alone goes to and fro."""
    plate = np.array([[-0.05, -0.06, 0], [0.06, -0.05, 0], [0.05, 0.04, 0], [-0.06, 0.06, 0]])
    marks, T = plate[:count], rs.Pose(np.tile(rs.Pose.at(0, 0, 0.5).matrix, (1000, 1, 1)))
    rng = np.random.default_rng(8)
    x = image(T, marks) + rng.normal(scale=pixels / 500, size=(count, 2, 1000))
    found = fitted(x, last(T), marks)
    assert (squares(found, x, marks) <= squares(last(T), x, marks)).all()
    again = squares(fitted(x, found, marks), x, marks)  # 30 more updates
    arrived = squares(found, x, marks) - again < 1e-6 * (pixels / 500) ** 2
    assert arrived.mean() > {3: 0.93, 4: 0.99}[count]


@steady
@given(seed=seeds)
def test_newtons_matrix_is_of_the_second_derivatives(seed):
    """By central differences of the gradient along six small motions, far from the minimum."""
    T = poses(seed, 1)
    x = image(T) + np.random.default_rng(seed).normal(scale=0.1, size=(5, 2, 1))
    h, twists = 1e-5, np.eye(6)
    wanted = np.stack(
        [
            (gradient(rs.Pose.exp(h * u) @ T, x) - gradient(rs.Pose.exp(-h * u) @ T, x)) / (2 * h)
            for u in twists
        ]
    )
    wanted = 0.5 * (wanted + wanted.T)  # the remainder is half a commutator, of no second order
    close(second_derivatives(T, x), wanted, 1e-7 * np.abs(wanted).max())


def gradient(T, x):
    """-L' e (6,) of half the squares, for small motions of the target, in camera axes."""
    e, L = error_and_interaction(T, x)
    return -L.T @ e


def second_derivatives(T, x):
    """H (6, 6), from its lower half in the kernel."""
    e, L = error_and_interaction(T, x)
    X = (T @ np.broadcast_to(CLOUD, (1, *CLOUD.shape)))[0]
    image = (X[:, :2] / X[:, 2:]).ravel(), 1 / X[:, 2], e, np.ones(len(X))  # weights
    rows = np.concatenate([*image, L.ravel()])
    block = np.repeat(rows[:, None], WIDTH, axis=1).ravel()
    block = np.concatenate([block, np.zeros((12 * len(X) + 36) * WIDTH)])
    pose_hessian(block, *(n * len(X) for n in (1, 0, 2, 3, 5, 6, 18)))
    lower = block.reshape(-1, WIDTH)[30 * len(X) :, 0].reshape(6, 6)
    return np.tril(lower) + np.tril(lower, -1).T


def error_and_interaction(T, x):
    points = image(T)
    seen = replace(seen_at(T), points_last=points)
    return (points - x)[..., 0].ravel(), rs.features.Points().interaction(seen)[0]


# theta u and translation


@FEATURES
@steady
@given(seed=seeds)
@pytest.mark.few(1)
def test_the_interaction_matrix_is_the_derivative(feature, seed):
    assert check_feature(feature, seed=seed, runs=50, bits=True) == []


@FEATURES
def test_the_derivative_is_right_without_a_goal_and_for_three_marks(feature):
    class Still:
        def __getattr__(self, name):
            if name == "towards":
                raise AttributeError
            return getattr(feature, name)

    assert check_feature(Still(), seed=1, runs=20) == []
    assert check_feature(feature, marks=CLOUD[[0, 1, 4]], seed=2, runs=20, bits=True) == []


def jacobian(w):
    """Right Jacobian of exp on SO(3): the sum of (-[w]x)^k / (k + 1)!."""
    A = np.cross(w, np.eye(3))  # rows w x e_i: the transpose of [w]x, which is -[w]x
    total, term = np.zeros((3, 3)), np.eye(3)
    for k in range(60):
        total, term = total + term, term @ A / (k + 2)
    return total


@njit
def put_rates(block):
    put_theta_u_rates(block, 3, get(block, 0), get(block, 1), get(block, 2))


def rates_of_theta_u(w):
    """L (3, 6) of a rotation vector."""
    block = np.zeros((3 + 18) * WIDTH)
    block[: 3 * WIDTH] = np.repeat(w, WIDTH)
    put_rates(block)
    return block.reshape(-1, WIDTH)[3:, 0].reshape(3, 6)


@steady
@given(seed=seeds, power=st.floats(-12, np.log10(np.pi)))
def test_l_of_theta_u_is_the_inverse_of_the_jacobian_of_exp_at_every_angle(seed, power):
    w = np.random.default_rng(seed).normal(size=3)
    w *= 10**power / np.linalg.norm(w)
    L = rates_of_theta_u(w)
    close(L[:, 3:] @ jacobian(w), np.eye(3), 4e-15)
    assert not L[:, :3].any()


@pytest.mark.parametrize("angle", [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 3.0, np.pi - 1e-6])
def test_theta_u_goes_with_the_turn_of_the_camera(angle):
    """log(R exp(h w)) - log(R) = h L w, for turns on this side of pi."""
    rng = np.random.default_rng(11)
    u = rng.normal(size=3)
    u /= np.linalg.norm(u)
    along = rng.normal(size=3)
    along *= -np.sign(along @ u) / np.linalg.norm(along)
    h = 1e-4
    start = rs.Pose.at(0, 0, 2, rotvec=angle * u)  # T_o_c, and c* stands at o

    def s(step):
        T = (start @ rs.Pose.exp([0, 0, 0, *(step * along)])).inv()
        seen = rs.features.Observation.of(np.ones((3, 2)), np.ones(3), CAMERA, pose=T)
        return ThetaU().measure(seen)[0], ThetaU().interaction(seen)[0, :, 3:]

    (s0, L0), (s1, L1), (s2, _) = s(0), s(h), s(2 * h)
    close(s0, angle * u, 3e-15 if angle < 3 else 1e-9)
    close((s2 - s0) / (2 * h), L1 @ along, 1e-8)  # central about h
    close((s1 - s0) / h, (L0 + L1) @ along / 2, 1e-8)


@steady
@given(seed=seeds)
def test_the_features_are_the_logarithm_of_the_pose_from_the_goal(seed):
    T, goal = poses(seed, 20), poses(seed + 1, 1)
    seen, at_goal = seen_at(T), seen_at(goal)
    T_goal_c = goal @ T.inv()
    w = ThetaU().towards(at_goal).measure(seen)
    close(rs.Pose.exp(np.hstack([np.zeros((20, 3)), w])).rotation, T_goal_c.rotation, 1e-14)
    close(Translation().towards(at_goal).measure(seen), T_goal_c.position, 1e-14)
    close(Translation("camera").towards(at_goal).measure(seen), T.position, 1e-14)


@steady
@given(seed=seeds)
def test_at_the_goal_the_features_are_zero_or_the_target_where_it_must_be(seed):
    goal = poses(seed, 1)
    seen = seen_at(goal)
    for feature in (ThetaU(), Translation()):
        close(feature.towards(seen).measure(seen), 0, 1e-15)
    close(Translation("camera").towards(seen).measure(seen), goal.position, 0)


def test_without_a_goal_they_are_measured_from_the_target():
    T_o_c = rs.Pose.at(0.1, -0.2, -1.5, rotvec=(0.2, 0.1, -0.4))
    seen = seen_at(rs.Pose(T_o_c.inv().matrix[None]))
    close(ThetaU().measure(seen), [[0.2, 0.1, -0.4]], 1e-14)
    close(Translation().measure(seen), [[0.1, -0.2, -1.5]], 1e-14)


def test_a_goal_may_be_given_as_a_pose():
    goal, T = poses(3, 1), poses(4, 5)
    seen = seen_at(T)
    for feature in (ThetaU, Translation):
        given, shown = feature(T_goal_o=goal[0]), feature().towards(seen_at(goal))
        np.testing.assert_array_equal(given.measure(seen), shown.measure(seen))
        assert given == shown and hash(given) == hash(shown)


def test_a_goal_that_no_pose_fits_is_an_error():
    seen = seen_at(poses(3, 1))
    vars(seen)["pose_last"] = np.full((3, 4, 1), np.nan)
    with pytest.raises(GoalError, match="no pose of the target fits the image at the goal"):
        ThetaU().towards(seen)


def test_wrong_parameters_are_named():
    with pytest.raises(InputError, match=r"did you mean 'camera'\? forms: goal, camera"):
        Translation("camara")
    with pytest.raises(InputError, match="T_goal_o: expected one pose, got a batch"):
        ThetaU(T_goal_o=poses(1, 2))


# decoupled motions of the loop


def test_with_both_features_the_camera_flies_straight_to_the_goal():
    """v = -R' t and omega = -theta u solve L V = -e: Chaumette and Hutchinson's second scheme."""
    T, goal = poses(8, 20), poses(9, 1)
    seen, at_goal = seen_at(T), seen_at(goal)
    pair = ThetaU().towards(at_goal), Translation().towards(at_goal)
    L = np.concatenate([f.interaction(seen) for f in pair], axis=1)
    e = np.concatenate([f.measure(seen) for f in pair], axis=1)
    V = -np.linalg.solve(L, e[..., None])[..., 0]
    R = (goal @ T.inv()).rotation
    close(V[:, :3], -np.einsum("bji,bj->bi", R, e[:, 3:]), 1e-14)
    close(V[:, 3:], -e[:, :3], 1e-14)


# rigid motions of the kernels


@steady
@given(seed=seeds)
def test_compose_and_inverse_agree_with_matrices(seed):
    A, B = poses(seed, 9), poses(seed + 1, 9)
    out = np.empty((3, 4, 9))
    se3.compose(last(A), last(B), out)
    close(out, last(A @ B), 1e-15 * 8)
    se3.inverse_pose(last(A), out)
    close(out, last(A.inv()), 1e-15 * 4)
