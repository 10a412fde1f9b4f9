"""sdot = L (J_c - J_o) qdot: how joints move features, against central differences."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

P = rs.features.FeatureBlock
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
RAILS = [[-0.05, -0.06, 0], [-0.05, -0.06, 0.08], [0.06, 0.05, 0], [0.06, 0.05, 0.1]]
ANGLES = np.arange(7) * 2 * np.pi / 7
CIRCLE = 0.06 * np.stack([np.cos(ANGLES), 0.8 * np.sin(ANGLES), 0 * ANGLES], axis=1)
FEATURES = [
    *("points", "pixels", "polar", "spherical", "log_depth", "points_3d", "segments", "lines"),
    *("vanishing_point", "region_moments", "point_moments", "decoupled_moments", "ellipse"),
    *("sphere", "theta_u", "translation"),
]
STEPS = (4e-3, 2e-3, 1e-3)
SINGLE = ["free", "free_target", "eye_in_hand", "eye_to_hand", "face_to_face", "head"]
SINGLE += ["holonomic", "unicycle", "mobile_arm"]


def with_marks(scene, marks):
    return scene.replacing(replace(scene.object(), marks=marks))


def marks_for(feature, scene):
    special = {"vanishing_point": RAILS, "ellipse": CIRCLE}
    return with_marks(scene, special[feature]) if feature in special else scene


def after(scene, q, velocity, seconds):
    """q (runs, nq) after the velocities (nv,) of all robots were held."""
    parts, iq, iv = [], 0, 0
    for robot in scene.robots:
        each = robot.integrate(q[:, iq : iq + robot.nq], velocity[iv : iv + robot.nv], seconds)
        parts.append(each)
        iq, iv = iq + robot.nq, iv + robot.nv
    return np.concatenate(parts, axis=1)


def differences(scene, task, q, decide, step):
    """ds/dv (k, n, runs) by central differences along each commanded velocity."""
    columns = []
    for i in task.columns(scene):
        unit = np.eye(scene.nv)[i]
        ahead, behind = (
            decide(scene, task, after(scene, q, sign * unit, step)).command.s for sign in (1, -1)
        )
        columns.append((ahead - behind) / (2 * step))
    return np.stack(columns, axis=1)


def check(scene, task, q, decide):
    """The difference shrinks with the square of the step, and is small at last."""
    task_jacobian = decide(scene, task, q).command.task_jacobian
    errors = [np.abs(differences(scene, task, q, decide, h) - task_jacobian).max() for h in STEPS]
    scale = np.abs(task_jacobian).max()
    assert scale > 1e-3
    assert errors[-1] < 1e-3 * scale
    if errors[-1] > 1e-9 * scale:
        assert errors[0] / errors[-1] == pytest.approx(16, rel=0.05)


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", SINGLE)
@pytest.mark.parametrize("feature", FEATURES)
def test_reach_is_the_derivative_of_the_features(arrange, around, decide, feature, name):
    if (name, feature) == ("head", "translation"):
        return  # the camera turns about its centre, which stays
    scene = marks_for(feature, arrange(name))
    check(scene, rs.IBVS(features=feature), around(scene, 2, spread=0.02, seed=6), decide)


@quiet
@pytest.mark.parametrize("joints", ["worker", "watcher", ["worker.shoulder", "watcher.flange"]])
@pytest.mark.parametrize("feature", ["points", "theta_u", "polar", "points_3d"])
def test_reach_of_one_of_two_arms(arrange, around, decide, feature, joints):
    """The columns are picked from the Jacobian of both arms together."""
    scene = arrange("face_to_face")
    q = around(scene, 2, spread=0.02, seed=6)
    task, both = rs.IBVS(features=feature, joints=joints), rs.IBVS(features=feature)
    check(scene, task, q, decide)
    some, every = task.columns(scene), both.columns(scene)
    whole = decide(scene, both, q).command.task_jacobian[:, np.searchsorted(every, some)]
    np.testing.assert_allclose(decide(scene, task, q).command.task_jacobian, whole, atol=1e-13)


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", ["stereo_in_hand", "stereo_apart", "stereo_beside"])
@pytest.mark.parametrize("feature", [*FEATURES, "stereo_points"])
def test_reach_of_two_cameras(arrange, around, decide, feature, name):
    scene = marks_for(feature, arrange(name))
    eyes = tuple(eye.name for eye in scene.cameras)
    parts = [P(feature, camera=eye) for eye in eyes]
    if feature == "stereo_points":
        parts = [P(feature, camera=eyes), P("points", camera=eyes[1])]
    check(scene, rs.IBVS(features=parts), around(scene, 2, spread=0.02, seed=6), decide)


@pytest.mark.parametrize("first", ["left", "right"])
def test_cameras_on_one_hand_are_moved_by_one_twist(arrange, around, decide, first):
    """L of both for the twist of the first, through the adjoint: L J is the same either way."""
    scene = arrange("stereo_in_hand")
    names = [first, "right" if first == "left" else "left"]
    task = rs.IBVS(features=[P("points", camera=name) for name in names])
    q = around(scene, 3)
    state = decide(scene, task, q).basis.state
    apart = [decide(scene, rs.IBVS(camera=name), q).command.task_jacobian for name in names]
    np.testing.assert_allclose(state.task_jacobian_last, np.concatenate(apart), atol=1e-12)
    product = np.einsum("kcb,cnb->knb", state.interaction_last, state.jacobian_last)
    np.testing.assert_allclose(product, state.task_jacobian_last, atol=1e-12)


@pytest.mark.parametrize("joints", [None, "worker", "watcher"])
@pytest.mark.parametrize("task", [rs.IBVS, rs.PBVS, rs.Hybrid])
def test_either_of_two_arms_alone_and_both_converge(arrange, around, task, joints):
    """Nobody flips a sign for the one that carries the target."""
    scene = arrange("face_to_face")
    q0 = around(scene, 6, spread=0.08, seed=8)
    run = rs.simulate(scene, task(joints=joints), q0, duration=30, record="summary")
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    still = {"worker": slice(6, 12), "watcher": slice(0, 6)}
    if joints:
        np.testing.assert_array_equal(run.q_end[:, still[joints]], q0[:, still[joints]])
    else:
        assert (np.abs(run.q_end - q0).max("coordinate") > 1e-2).all()
