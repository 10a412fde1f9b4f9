"""With an exact L J the joint law descends: d||e||^2/dt = -2 gain e' A A^+ e <= 0, A = L J."""

import numpy as np
import pytest

import robsim as rs

P = rs.features.FeatureBlock
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
FEATURES = [
    *("points", "pixels", "polar", "spherical", "log_depth", "points_3d", "segments", "lines"),
    *("region_moments", "point_moments", "decoupled_moments", "sphere", "theta_u", "translation"),
]
TASKS = {
    **{name: rs.IBVS(features=name) for name in FEATURES},
    "pbvs": rs.PBVS(),
    "pbvs of the camera": rs.PBVS(form="camera"),
    "hybrid": rs.Hybrid(),
    "stacked": rs.IBVS(features=[P("points"), P("theta_u"), P("log_depth", marks=[1])]),
    "two numbers": rs.IBVS(features=[P("points", marks=[0], components=[0]), "theta_u"]),
}


def descends(run):
    norm = run.error_norm.values
    return (np.diff(norm, axis=1) <= 1e-9 * norm[:, :-1]).all()


@pytest.mark.covering(1)
@quiet
@pytest.mark.parametrize("name", ["eye_in_hand", "eye_to_hand", "face_to_face", "mobile_arm"])
@pytest.mark.parametrize("task", TASKS)
def test_the_error_never_grows_on_any_arm(arrange, around, task, name):
    scene = arrange(name)
    q0 = around(scene, 8, spread=0.06, seed=1)
    run = rs.simulate(scene, TASKS[task], q0, dt=5e-3, duration=0.3, hold=True)
    assert descends(run)
    assert (run.error_norm[:, -1] < 0.98 * run.error_norm[:, 0]).all()


@quiet
@pytest.mark.parametrize("law", ["joint", "camera", rs.laws.CameraLaw(0.01)])
@pytest.mark.parametrize("task", ["points", "pixels", "polar", "spherical", "points_3d", "pbvs"])
def test_the_error_never_grows_with_six_free_motions_and_any_law(arrange, around, task, law):
    what = {"law": law}
    made = rs.PBVS(**what) if task == "pbvs" else rs.IBVS(features=task, **what)
    for name in ("free", "free_target"):
        scene = arrange(name)
        q0 = around(scene, 10, spread=0.25, seed=2)
        run = rs.simulate(scene, made, q0, dt=5e-3, duration=0.5, hold=True)
        assert descends(run)
        assert (run.error_norm[:, -1] < 0.9 * run.error_norm[:, 0]).all()


@quiet
@pytest.mark.parametrize("name", ["head", "holonomic", "unicycle"])
@pytest.mark.parametrize("task", ["points", "pixels", "spherical", "points_3d", "hybrid"])
def test_the_error_never_grows_where_it_cannot_vanish(arrange, around, task, name):
    """Fewer joints than features: the error sinks to the least that they reach."""
    scene = arrange(name)
    q0 = around(scene, 8, spread=0.05, seed=3)
    assert descends(rs.simulate(scene, TASKS[task], q0, dt=5e-3, duration=0.5, hold=True))


@pytest.mark.parametrize("name", ["stereo_in_hand", "stereo_beside"])
def test_the_error_of_two_cameras_never_grows(arrange, around, name):
    scene = arrange(name)
    both = [rs.features.FeatureBlock("points", camera=eye) for eye in ("left", "right")]
    for features in (both, [P("stereo_points", camera=("left", "right"))]):
        q0 = around(scene, 8, spread=0.06, seed=1)
        run = rs.simulate(scene, rs.IBVS(features=features), q0, dt=5e-3, duration=0.3, hold=True)
        assert descends(run)


@quiet
@pytest.mark.parametrize("name", ["eye_in_hand", "face_to_face", "head", "unicycle"])
@pytest.mark.parametrize("task", TASKS)
def test_the_rate_of_the_norm_agrees_with_theory(arrange, around, decide, task, name):
    """e' L J qd = -gain ||A A^+ e||^2 with A A^+ the projector onto the reachable errors."""
    scene = arrange(name)
    if name == "unicycle" and task == "two numbers":
        return
    made = TASKS[task]
    command = decide(scene, made, around(scene, 6, seed=5)).command
    for b in range(6):
        A, e, qd = command.task_jacobian[..., b], command.error[:, b], command.qd[:, b]
        reached = A @ np.linalg.pinv(A, rcond=1e-6) @ e
        np.testing.assert_allclose(e @ A @ qd, -reached @ reached, rtol=1e-9, atol=1e-14)
