"""Golden closed loops of the literature, and the same loops computed independently (loops.json).

The oracle is a plain NumPy loop with another integrator and pseudo-inverse (generate_loops.py).
"""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

ORACLE = Path(__file__).parents[1] / "oracles" / "loops.json"
CASES = {case["name"]: case for case in json.loads(ORACLE.read_text())["cases"]}
PAIRS = [(name, run["law"]) for name, case in CASES.items() for run in case["runs"]]


def run_case(free_scene, name, interaction, law="joint", duration=60.0):
    case = CASES[name]
    task = rs.IBVS(
        goal=rs.Pose(case["goal_T_w_c"]), interaction=interaction, gain=case["gain"], law=law
    )
    start = rs.Pose(case["start_T_w_c"])
    return rs.simulate(free_scene(case["points"]), task, start, dt=case["dt"], duration=duration)


def outcome(run):
    return rs.Outcome(int(run.outcome))


def last(variable):
    return variable.dropna("time", how="all")[-1]


@pytest.mark.parametrize(("name", "interaction"), PAIRS)
def test_the_whole_path_agrees_with_an_independent_loop(free_scene, name, interaction):
    run = run_case(free_scene, name, interaction)
    expected = next(r for r in CASES[name]["runs"] if r["law"] == interaction)
    compared = 0
    for sample in expected["samples"]:
        i = sample["step"]
        if np.isfinite(run.error_norm[i]):
            np.testing.assert_allclose(run.camera_pose[i], sample["T_w_c"], rtol=0, atol=1e-10)
            np.testing.assert_allclose(run.error[i], sample["error"], rtol=0, atol=1e-10)
            compared += 1
    assert compared >= 3


@pytest.mark.parametrize("degrees", [30, 60, 90, 120])
def test_camera_retreat_under_l_current(free_scene, degrees):
    """Chaumette 1998: the largest depth on the way is Z* / cos(theta0 / 2)."""
    run = run_case(free_scene, f"retreat_{degrees}_deg", "current")
    farthest = -run.camera_pose.values[:, 2, 3]
    assert np.nanmax(farthest) == pytest.approx(1 / np.cos(np.radians(degrees) / 2), rel=2e-3)
    assert outcome(run) == rs.Outcome.CONVERGED


@pytest.mark.parametrize(
    ("degrees", "nearest"), [(30, 0.9655), (60, 0.8596), (90, 0.6736), (120, 0.3877)]
)
def test_camera_advance_under_l_desired(free_scene, degrees, nearest):
    """The smallest depth is Z* cos(theta_m) with theta_m + sin(theta_m) = theta0."""
    run = run_case(free_scene, f"retreat_{degrees}_deg", "desired")
    assert np.nanmin(-run.camera_pose.values[:, 2, 3]) == pytest.approx(nearest, rel=2e-3)
    assert outcome(run) == rs.Outcome.CONVERGED


@pytest.mark.parametrize("degrees", [30, 60, 90, 120])
def test_pure_rotation_under_l_mean(free_scene, degrees):
    """Depth stays, and sin(theta / 2) decays as exp(-gain t)."""
    run = run_case(free_scene, f"retreat_{degrees}_deg", "mean")
    depth = -run.camera_pose.values[:, 2, 3]
    assert np.nanmax(np.abs(depth - 1)) < 1e-9
    theta = np.radians(degrees)
    for t in (0.5, 1.0, 2.0):
        T = run.camera_pose.sel(time=t, method="nearest").values
        half = np.sin(np.arctan2(T[1, 0], T[0, 0]) / 2)
        assert half == pytest.approx(np.sin(theta / 2) * np.exp(-t), rel=2e-3)


def test_half_a_turn_under_l_current_goes_away_for_ever(free_scene):
    """At exactly 180 degrees the depth grows without bound at t = ln 2 / gain."""
    square = 0.25 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    task = rs.IBVS(goal=rs.Pose.at(0, 0, -1), gain=1.0)
    start = rs.Pose.at(0, 0, -1, rotvec=(0, 0, np.pi))
    run = rs.simulate(free_scene(square), task, start, dt=5e-4, duration=5)
    assert outcome(run) == rs.Outcome.DIVERGED
    assert float(run.end_time) == pytest.approx(np.log(2), abs=0.01)


@pytest.mark.parametrize("law", ["joint", "camera"])
@pytest.mark.parametrize(
    ("name", "norm", "place", "turn"),
    [
        ("trap_four_points", 0.00231, (0.1336, 0.2517, -0.9603), (0.0412, -0.3486, 1.3667)),
        ("trap_tilted_square", 0.02755, (-0.68896, 0, -0.76256), (0, 0.72494, 0)),
    ],
)
def test_local_minima_trap_l_current(free_scene, name, norm, place, turn, law):
    """Chapter, section 5.4: for k > 6 the null space of L L^+ permits minima (planar points)."""
    run = run_case(free_scene, name, "current", law)
    T = rs.Pose(last(run.camera_pose).values)
    assert outcome(run) == rs.Outcome.LOCAL_MINIMUM
    assert float(last(run.error_norm)) == pytest.approx(norm, rel=3e-3)
    np.testing.assert_allclose(T.position, place, atol=2e-4)
    np.testing.assert_allclose(T.rotvec, turn, atol=3e-4)


@pytest.mark.parametrize("name", ["trap_four_points", "trap_tilted_square"])
@pytest.mark.parametrize("interaction", ["desired", "mean"])
def test_l_desired_and_mean_escape_the_minima(free_scene, name, interaction):
    assert outcome(run_case(free_scene, name, interaction)) == rs.Outcome.CONVERGED


def test_about_half_of_the_starts_around_the_planar_points_are_trapped(free_scene):
    """Look-at starts with |x|, |y| < 0.5, z in [-1.3, -0.6], any roll: about 46 percent."""
    case, rng = CASES["trap_four_points"], np.random.default_rng(7)
    starts = np.array([_looking_at_the_origin(rng).q for _ in range(400)])
    task = rs.IBVS(goal=rs.Pose(case["goal_T_w_c"]), gain=1.0)
    scene = free_scene(case["points"])
    run = rs.simulate(scene, task, starts, dt=0.02, duration=60, record="summary")
    trapped = float((run.outcome == rs.Outcome.LOCAL_MINIMUM).mean())
    assert trapped == pytest.approx(0.46, abs=0.08)  # three standard deviations of 400 starts


def _looking_at_the_origin(rng):
    place = np.array([*rng.uniform(-0.5, 0.5, 2), rng.uniform(-1.3, -0.6)])
    z = -place / np.linalg.norm(place)
    x = np.cross([0, 1, 0], z)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(z, x), z]), place
    return rs.Pose(T) @ rs.Pose.at(rpy=(0, 0, rng.uniform(-np.pi, np.pi)))


@pytest.mark.parametrize("law", ["joint", "camera"])
def test_visps_tutorial(free_scene, law):
    """||e|| = 0.0230 at t = 5.96 s, and it converges (ViSP's tutorial on image-based servoing)."""
    run = run_case(free_scene, "visp_tutorial", "current", law)
    assert float(run.error_norm.sel(time=5.96, method="nearest")) == pytest.approx(0.0230, abs=5e-5)
    assert outcome(run) == rs.Outcome.CONVERGED
