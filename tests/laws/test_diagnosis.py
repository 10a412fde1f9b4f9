"""`diagnose`: against plain NumPy for a free camera, and against finite differences along runs."""

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.analysis.loop_stability import measure_motions
from robsim.analysis.resimulation import resimulate_run
from robsim.analysis.state_history import WINDOW, select_instants
from robsim.analysis.vector_fields import compute_target_pose
from robsim.servo.camera_target import make_camera_target

SQUARE = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
START = rs.Pose.at(0.1, -0.05, -0.2, rotvec=(0.1, -0.1, 0.3)).q
K = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])


def flying(pose=None, focal=1.0, more=(), motions=(), on="world"):
    """A free camera that sees a square from 1 m at home."""
    where = {} if pose is None else {"pose": pose}
    camera = rs.Camera(K * [[focal, 1, 1], [1, focal, 1], [1, 1, 1]], (640, 480))
    eye = rs.MountedCamera("eye", camera, on="free_camera.body", **where)
    square = rs.Object("square", marks=SQUARE, pose=rs.Pose.at(0, 0, 1), on=on)
    return rs.Scene([rs.robots.free_camera(), *more], [square], [eye], list(motions))


def L_of(X, scale=1.0):
    """(8, 6) of normalised points X (4, 3): Chaumette and Hutchinson 2006, eq. 11."""
    rows = []
    for x, y, Z in zip(X[:, 0] / X[:, 2], X[:, 1] / X[:, 2], scale * X[:, 2], strict=True):
        rows.append([-1 / Z, 0, x / Z, x * y, -(1 + x * x), y])
        rows.append([0, -1 / Z, y / Z, 1 + y * y, -x * y, -x])
    return np.array(rows)


def by_hand(run, scene, scale, gain):
    """The diagnosis of each instant; the camera is fixed to the floating body."""
    rows = []
    for q, qd in zip(run.q.values, run.qd.values, strict=True):
        X = (scene.pose("eye", q).inv() @ scene.pose("square", q)) @ SQUARE
        s = (X[:, :2] / X[:, 2:]).ravel()
        e = s - (SQUARE[:, :2] / 1.0).ravel()
        L, used = L_of(X), L_of(X, scale)
        sigma, true = (np.linalg.svd(A, compute_uv=False) for A in (used, L))
        M = np.linalg.pinv(used) @ L
        product = L @ np.linalg.pinv(used)
        pixels = s.reshape(4, 2) * 500 + (320, 240)
        room = np.minimum(pixels + 0.5, (639.5, 479.5) - pixels).min(axis=1)
        rows.append(
            {
                "lyapunov": 0.5 * e @ e,
                "lyapunov_rate": e @ L @ qd,
                "rank_interaction": np.linalg.matrix_rank(used),
                "condition_interaction": sigma[0] / sigma[-1],
                "smallest_interaction": sigma[-1],
                "rank_task_jacobian": 6,
                "condition_task_jacobian": sigma[0] / sigma[-1],
                "smallest_task_jacobian": sigma[-1],
                "stability": np.linalg.eigvalsh((product + product.T) / 2).min(),
                "stability_motion": np.linalg.eigvalsh((M + M.T) / 2).min(),
                "contraction": np.abs(np.linalg.eigvals(np.eye(6) - gain * 0.04 * M)).max(),
                "border_margin": room.min(),
                "border_mark": room.argmin(),
                "marks_in_image": 4,
                "limit_margin": np.nan,
                "limit_coordinate": -1,
                "singularity": true[-1] / true[0],
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@pytest.mark.parametrize("scale", [1.0, 1.7])
def test_numbers_agree_with_numpy(scale):
    scene = flying()
    run = rs.simulate(scene, rs.IBVS(gain=2.0, depth_scale=scale), START, duration=2)
    found = rs.diagnose(run)
    expected = by_hand(run, scene, scale, 2.0)
    assert set(expected) == set(found.data_vars) and found.sizes["time"] == 51
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-6, atol=1e-12, err_msg=name)
        assert found[name].attrs["units"] and found[name].attrs["long_name"]


def test_a_mean_interaction_matrix_agrees_with_the_law():
    scene = flying()
    run = rs.simulate(scene, rs.IBVS(interaction="mean"), START, duration=1)
    found = rs.diagnose(run)
    X = (scene.pose("eye", START).inv() @ scene.pose("square", START)) @ SQUARE
    used = 0.5 * (L_of(X) + L_of(np.add(SQUARE, (0, 0, 1))))
    M = np.linalg.pinv(used) @ L_of(X)
    least = np.linalg.eigvalsh((M + M.T) / 2).min()
    assert float(found.stability_motion[0]) == pytest.approx(least, rel=1e-9)
    assert float(found.lyapunov[0]) == pytest.approx(float(run.lyapunov[0]), rel=1e-12)


BELT = {
    "more": [rs.robots.conveyor()],
    "motions": [rs.Motion("conveyor", [0.05])],
    "on": "conveyor.belt",
}
TWO = [
    rs.features.FeatureBlock("points", weight=2.0),
    rs.features.FeatureBlock("log_depth", marks=[0]),
]
WRONG = flying(pose=rs.Pose.at(0.02, 0, 0.01, rotvec=(0.1, 0, 0.2)), focal=1.2)
ALONG = {
    "exact": ({}, {}, {}),
    "belief": ({}, {"belief": WRONG, "depth": "goal"}, {}),
    "mean": ({}, {"interaction": "mean", "depth_scale": 2.0}, {}),
    "late": ({}, {}, {"sensing": rs.Sensing(latency=0.04, noise=0.1)}),
    "lag": ({}, {}, {"actuation": rs.Actuation(lag=0.5)}),
    "moving": (BELT, {}, {}),
    "camera law": ({}, {"law": "camera"}, {}),
    "weighted": ({}, {"features": TWO}, {}),
}


@pytest.mark.parametrize("name", ALONG)
def test_the_rate_of_v_is_its_difference_quotient_along_the_run(name):
    """To first order in the period: a quarter of the period, a quarter of the difference."""
    scene, task, settings = ALONG[name]
    scene = flying(**scene)
    q0 = scene.coordinates({"free_camera": START})
    apart = []
    for dt in (0.008, 0.002):
        run = rs.simulate(scene, rs.IBVS(**task), q0, dt=dt, duration=0.4, **settings)
        found = rs.diagnose(run)
        V, rate = found.lyapunov.values, found.lyapunov_rate.values
        apart.append(np.abs(np.diff(V) / dt - rate[:-1]).max() / np.abs(rate).max())
    assert apart[1] < 0.01 and apart[1] < apart[0] / 3


def test_v_of_a_wrong_belief_agrees_with_the_truth():
    """With a goal that was shown, both are zero in the end; on the way they differ."""
    run = rs.simulate(flying(), rs.IBVS(belief=WRONG), START, duration=20)
    found = rs.diagnose(run)
    assert float(found.lyapunov[-1]) < 1e-9
    assert abs(float(found.lyapunov[0]) / float(run.lyapunov[0]) - 1) > 0.2


def test_a_goal_that_the_true_camera_cannot_see_leaves_the_true_values_unknown():
    believed = flying(focal=0.25)
    goal = rs.GoalPose(rs.Pose.at(0, 0, 0.15))
    run = rs.simulate(flying(), rs.IBVS(goal=goal, belief=believed), START, duration=0.4)
    found = rs.diagnose(run)
    assert np.isnan(found.lyapunov).all() and np.isfinite(found.condition_task_jacobian).all()


def test_limits_and_singularity_of_an_arm():
    scenario = rs.load_scenario(examples.path("eye_in_hand"))
    run = scenario.run(duration=1.0)
    found = rs.diagnose(run)
    low, high = scenario.scene.limits.T
    share = np.minimum(run.q - low, high - run.q) / (high - low)
    np.testing.assert_allclose(found.limit_margin, share.min("coordinate"), rtol=1e-12)
    np.testing.assert_array_equal(found.limit_coordinate, share.argmin("coordinate"))
    assert found.coordinate.values.tolist() == list(scenario.scene.coordinate_names)


def test_an_equilibrium_of_v_has_no_rate_and_rank_six_of_eight():
    run = rs.load_scenario(examples.path("local_minimum")).run()
    found = rs.diagnose(run).isel(time=-1)
    assert float(found.rank_interaction) == 6 and float(found.lyapunov) > 1e-6
    assert abs(float(found.lyapunov_rate)) < 1e-12
    assert float(found.stability) < 1e-9  # k > 6: never above zero


def test_a_camera_law_that_stalls_is_distinguished_from_a_joint_law():
    """There V' is zero at the end although the error could still be made smaller."""
    run = rs.load_scenario(examples.path("camera_law_stalls")).run()
    found = rs.diagnose(run)
    assert float(found.lyapunov[-1]) > 2 * float(found.lyapunov[0])
    assert found.lyapunov_rate.max() > 0


@pytest.mark.parametrize("record", [1, 3, "all", "summary"])
def test_a_recorded_run_is_diagnosed(record):
    sensing = rs.Sensing(noise=0.1)
    settings = {"duration": 0.4, "sensing": sensing}
    whole = rs.diagnose(rs.simulate(flying(), rs.IBVS(), START, **settings))
    run = rs.simulate(flying(), rs.IBVS(), START, record=record, **settings)
    found = rs.diagnose(run)
    every = record if isinstance(record, int) else 1
    assert found.identical(whole.isel(time=slice(0, None, every)))


def test_a_run_of_a_batch_is_diagnosed_with_its_own_noise():
    sensing, starts = rs.Sensing(noise=0.5, dropped=0.3), np.stack([START] * 3)
    runs = rs.simulate(flying(), rs.IBVS(), starts, duration=0.4, sensing=sensing)
    one, two = (rs.diagnose(runs.isel(run=i)) for i in (1, 2))
    assert not np.array_equal(one.lyapunov, two.lyapunov)
    with pytest.raises(rs.errors.InputError, match="expected one run, got 3"):
        rs.diagnose(runs)


@pytest.mark.parametrize(
    "task",
    [
        rs.Priorities([rs.IBVS(), rs.PBVS()]),
        rs.Switch(rs.PBVS(), rs.IBVS(), rs.tasks.ErrorBelow(0.1)),
        rs.Partitioned(),
    ],
)
def test_a_diagnosis_of_several_tasks_and_other_laws_has_the_meaningful_parts(task):
    run = rs.simulate(flying(), task, START, duration=1)
    found = rs.diagnose(run)
    for name in ("lyapunov", "lyapunov_rate", "rank_task_jacobian", "border_margin", "singularity"):
        assert np.isfinite(found[name]).all(), name
    assert np.isnan(found.stability_motion).all() and np.isnan(found.contraction).all()
    np.testing.assert_allclose(found.lyapunov, run.lyapunov, rtol=1e-9)


def test_a_run_that_is_not_repeated_is_reported():
    run = rs.simulate(flying(), rs.IBVS(), START, duration=1)
    with pytest.raises(rs.errors.InputError, match="is not reproduced: q_end"):
        rs.diagnose(run.assign(q_end=run.q_end + 1e-15))
    with pytest.raises(rs.errors.InputError, match="expected a run"):
        rs.diagnose(3)


def test_the_pose_of_the_target_agrees_with_the_scene():
    scene = flying()
    pose = scene.pose("eye", START).inv() @ scene.pose("square", START)
    found = compute_target_pose(make_camera_target(scene, None, None), START[:, None])[0]
    np.testing.assert_allclose(found.matrix, pose.matrix, atol=1e-15)


def test_the_contraction_has_the_adaptive_gain_of_each_instant():
    """With an exact model the error contracts by 1 - gain dt, and the gain grows from 0.57 to 3."""
    experiment = rs.load_scenario(rs.examples.path("holonomic"))
    contraction = rs.diagnose(experiment.run()).contraction.values
    gains = (1.0 - contraction) / experiment.dt
    np.testing.assert_allclose(gains[[0, -1]], [0.57273, 2.99982], atol=1e-5)
    assert (np.diff(gains) > -1e-12).all()


def test_the_states_of_all_instants_are_those_of_each_step():
    case = rs.load_scenario(examples.path("adaptive_gain")).with_(duration=12.0)  # several windows
    again, loop = resimulate_run(case.run()), case.loop()
    steps = [
        (loop.sequence.snapshot(chunk), loop.sequence.decision(chunk))
        for _, chunk in loop.instants(np.arange(1))
    ]
    assert again.history.length == len(steps) > WINDOW
    for t in (0, WINDOW - 1, WINDOW, len(steps) - 1):
        state, decision = again.state(t), select_instants(again.history.decision, np.array([t]))
        seen, alone = state.projections.popitem()[1], steps[t][0].projections.popitem()[1]
        inputs, expected = decision.basis.state, steps[t][1].basis.state
        for ours, theirs in (
            (state.q, steps[t][0].q),
            (state.command.error, steps[t][0].command.error),
            (seen.pixels, alone.pixels),
            (inputs.gain, expected.gain),
            (inputs.task_jacobian_last, expected.task_jacobian_last),
        ):
            assert ours.shape == theirs.shape
            assert ours.tobytes() == theirs.tobytes()


def test_measures_of_motions_depend_on_the_rank_of_each_instant():
    rng = np.random.default_rng(3)
    P, L = rng.normal(size=(4, 3, 5)), rng.normal(size=(4, 5, 3))
    P[2] = np.outer(P[2, :, 0], P[2, 0])  # rank 1
    least, radius = measure_motions(P, L, np.full(4, 0.1))
    for t in range(4):
        U, sigma, _ = np.linalg.svd(P[t])
        U = U[:, : int((sigma > 1e-9 * sigma[0]).sum())]
        M = U.T @ P[t] @ L[t] @ U
        assert least[t] == pytest.approx(np.linalg.eigvalsh((M + M.T) / 2).min(), rel=1e-12)
        eigenvalues = np.linalg.eigvals(np.eye(len(M)) - 0.1 * M)
        assert radius[t] == pytest.approx(np.abs(eigenvalues).max(), rel=1e-12)
