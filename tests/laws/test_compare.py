"""The measures of a comparison, against closed forms, hand-made runs and single rows."""

import numpy as np
import pytest
import xarray as xr

import robsim as rs
from robsim.analysis import measures
from robsim.analysis.run_arrays import RecordedRuns

SQUARE = 0.25 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GOAL = rs.Pose.at(0, 0, -1)
SEEN = {"size": (640, 480), "K": ((500, 0, 319.5), (0, 500, 239.5), (0, 0, 1))}


def one(found, name="a"):
    """{measure: number} of a scheme that ran once."""
    return {key: float(found.data[key].sel(scheme=name)) for key in measures.MEASURES}


# ---- closed forms ----


def test_a_translation_under_pbvs_is_the_straight_way(free_scene):
    """Form "goal": the position decays as exp(-t) along a line, and the tolerance is left."""
    start = rs.Pose.at(0.2, -0.1, -1.4)
    task = rs.PBVS(GOAL, tolerance=1e-4)
    found = one(rs.compare(free_scene(SQUARE, **SEEN), {"a": task}, start, dt=0.01, duration=12))
    straight = np.sqrt(0.2**2 + 0.1**2 + 0.4**2)
    assert found["path_length"] == pytest.approx(straight, abs=2e-4)  # the tolerance
    assert found["path_ratio"] == pytest.approx(1.0, abs=1e-9)
    assert found["retreat"] == 0.0
    assert found["rotation"] < 1e-6
    # V = -e: at the start its length is the distance
    assert found["peak_speed"] == pytest.approx(straight, rel=1e-9)
    # integral of |e(0)|^2 exp(-2t), of a command that is held for dt: (1 - exp(-dt)) per step, so
    # the sum is |e(0)|^2 dt / (1 - exp(-2 dt)) if the pose is exact: (1 - dt)^2 per step
    ratio = (1 - 0.01) ** 2
    assert found["effort_linear"] == pytest.approx(straight**2 * 0.01 / (1 - ratio), rel=1e-5)
    assert found["travel_linear"] == pytest.approx(0.2 + 0.1 + 0.4, abs=2e-4)


@pytest.mark.parametrize(
    ("degrees", "farthest"), [(30, 1.0353), (60, 1.1547), (90, 1.4142), (120, 2.0)]
)
def test_camera_retreat_agrees_with_chaumette(free_scene, degrees, farthest):
    """Chaumette 1998: Z*/cos(theta0/2) - Z*. Periods of 4 ms are eight times the golden
    run's. Its error of first order in dt is 0.2 percent of Z at 0.5 ms and 120 degrees: at 4 ms
    up to 1.6 percent of Z."""
    start = GOAL @ rs.Pose.at(rotvec=(0, 0, np.radians(degrees)))
    tasks = {"a": rs.IBVS(GOAL), "mean": rs.IBVS(GOAL, interaction="mean")}
    found = rs.compare(free_scene(SQUARE), tasks, start, dt=4e-3, duration=15)
    assert 1 / np.cos(np.radians(degrees) / 2) == pytest.approx(farthest, abs=1e-4)
    assert one(found)["retreat"] == pytest.approx(farthest - 1, abs=0.016 * farthest)
    assert one(found, "mean")["retreat"] < 1e-9
    assert np.isnan(one(found)["path_ratio"])  # a turn on the spot has no straight way
    assert one(found, "mean")["rotation"] == pytest.approx(np.radians(degrees), abs=1e-4)
    # there and back again, to within the tolerance
    assert one(found)["path_length"] == pytest.approx(2 * one(found)["retreat"], abs=1e-3)


def test_the_retreat_at_small_periods_is_the_closed_form(free_scene):
    start = GOAL @ rs.Pose.at(rotvec=(0, 0, np.radians(120)))
    settings = {"dt": 5e-4, "duration": 2.0}  # the farthest is reached at t = 0.69
    found = rs.compare(free_scene(SQUARE), {"a": rs.IBVS(GOAL)}, start, **settings)
    assert one(found)["retreat"] == pytest.approx(1.0, abs=2e-3 * 2.0)


@pytest.mark.parametrize("gain", [pytest.param(0.5, marks=pytest.mark.full), 2.0])
def test_time_to_converge_agrees_with_an_exponential(free_scene, gain):
    """Of a pure translation, e is 0.4 exp(-gain t) in one component: ln(e0/tol)/gain, and the
    period around that time; commands that are held contract by 1 - gain dt per period."""
    task = rs.PBVS(GOAL, gain=gain, tolerance=1e-3)
    dt = 0.001
    found = one(
        rs.compare(free_scene(SQUARE), {"a": task}, rs.Pose.at(0, 0, -1.4), dt=dt, duration=15)
    )
    assert found["time"] == pytest.approx(dt * np.ceil(np.log(1e-3 / 0.4) / np.log(1 - gain * dt)))
    # ln(1 - x) = -x - x^2/2: the sum of the second terms is gain t dt/2
    late = np.log(0.4 / 1e-3) / gain
    assert abs(found["time"] - late) < dt * (1 + 0.5 * gain * late)


def test_a_run_that_does_not_converge_has_no_time_and_reports_it(free_scene):
    start = GOAL @ rs.Pose.at(0.2, 0, 0)
    found = rs.compare(free_scene(SQUARE), {"a": rs.IBVS(GOAL)}, start, duration=1)
    assert np.isnan(one(found)["time"])
    header, _, row = str(found).splitlines()
    assert "time limit" in row and "time" not in header.split()[2:]  # no scheme has one


class Constant:
    """A law that commands the same for ever."""

    name, in_camera = "constant", False

    def __init__(self, *rates):
        self.rates = rates

    def command(self, state):
        return np.tile(self.rates, (state.error.shape[0], 1))


def test_effort_and_travel_of_a_constant_velocity_are_its_square_and_itself_times_time(free_scene):
    v, w = np.array([0.01, -0.02, 0.03]), np.array([0.0, 0.1, -0.05])
    task = rs.IBVS(GOAL, law=Constant(*v, *w))
    start = rs.Pose.at(0, 0, -1.2, rotvec=(0.1, 0, 0))
    found = one(rs.compare(free_scene(SQUARE), {"a": task}, start, dt=0.05, duration=3))
    assert found["effort_linear"] == pytest.approx(3 * v @ v, rel=1e-12)
    assert found["effort_angular"] == pytest.approx(3 * w @ w, rel=1e-12)
    assert found["travel_linear"] == pytest.approx(3 * 0.06, rel=1e-12)
    assert found["travel_angular"] == pytest.approx(3 * 0.15, rel=1e-12)
    assert found["rotation"] == pytest.approx(3 * np.linalg.norm(w), rel=1e-9)
    assert found["peak_speed"] == pytest.approx(np.linalg.norm(v), rel=1e-9)
    assert found["peak_turn_rate"] == pytest.approx(np.linalg.norm(w), rel=1e-9)


def test_joints_that_lag_are_measured_as_they_move_and_their_effort_as_it_is_commanded(free_scene):
    """v' = (u - v) / tau, from rest: v = u (1 - exp(-t/tau)), the way its integral."""
    u, tau, time = 0.02, 0.5, 2.0
    start, law = rs.Pose.at(0, 0, -1.2), Constant(0, 0, u, 0, 0, 0)
    how = {"dt": 1e-3, "duration": time, "actuation": rs.Actuation(lag=tau)}
    found = one(rs.compare(free_scene(SQUARE), {"a": rs.IBVS(GOAL, law=law)}, start, **how))
    left = np.exp(-time / tau)
    assert found["peak_speed"] == pytest.approx(u * (1 - left), rel=1e-9)
    way = u * (time - tau * (1 - left))
    assert found["path_length"] == pytest.approx(way, rel=1e-9)
    assert found["travel_linear"] == pytest.approx(way, abs=0.5e-3 * u)  # half a period of v
    assert found["effort_linear"] == pytest.approx(u * u * time, rel=1e-9)


def test_a_carried_target_is_measured_where_the_camera_stands():
    """Eye-to-hand: the target flies 0.3 m straight to its goal."""
    fly = rs.Robot(
        "fly", [rs.joints.Link("base"), rs.joints.Link("body", "base", rs.joints.Joint("floating"))]
    )
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)))
    scene = rs.Scene(fly, rs.Object("square", marks=SQUARE, on="fly.body"), eye)
    goal, start = rs.Pose.at(0, 0, 1), rs.Pose.at(0, 0, 1.3)
    found = one(rs.compare(scene, {"a": rs.PBVS(goal, tolerance=1e-5)}, start, duration=15))
    assert found["path_length"] == pytest.approx(0.3, abs=1e-4)
    assert found["path_ratio"] == pytest.approx(1.0, abs=1e-9)
    assert found["retreat"] == 0.0 and found["peak_speed"] == pytest.approx(0.3, rel=1e-9)


def test_rotation_is_the_turn_of_the_camera_forth_and_back():
    """A camera that swings 0.15 rad out and back, by a law that follows the clock."""

    class Swing:
        name, in_camera = "swing", False

        def command(self, state):
            rate = 0.15 if state.time < 0.999 else -0.15
            return np.tile([0, 0, 0, 0, rate, 0], (state.error.shape[0], 1))

    scene = rs.load_scenario(rs.examples.path("visp_tutorial")).scene
    task = rs.IBVS(rs.Pose.at(0, 0.05, -1), law=Swing())
    found = one(rs.compare(scene, {"a": task}, rs.Pose.at(0, 0, -1), dt=0.1, duration=2))
    assert found["rotation"] == pytest.approx(0.3, rel=1e-9)
    assert found["path_length"] == pytest.approx(0.0, abs=1e-12)


# ---- hand-made runs: measures of marks and joints ----


@pytest.fixture(scope="module")
def recorded():
    """A run with a record that can be replaced, and its scene."""
    lens = rs.Camera([[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]], size=(640, 480))
    arm = rs.robots.puma560()
    plate = rs.Pose(arm.fk(arm.home)) @ rs.Pose.at(0, 0, 0.5)
    marks = np.array([[-0.05, -0.05, 0], [0.05, -0.05, 0], [0.05, 0.05, 0]])
    eye = rs.MountedCamera("eye", lens, on="puma560.flange")
    scene = rs.Scene(arm, rs.Object("plate", marks=marks, pose=plate), eye)
    start = arm.home + np.array([0.02, 0, 0.02, 0, 0, 0.1])
    return rs.simulate(scene, rs.IBVS(), start, dt=0.1, duration=0.3), scene


def replaced(run, **arrays):
    made = run.copy(deep=True)
    for name, array in arrays.items():
        made[name].values[:] = array
    return made


def test_the_margin_to_the_border_is_the_smallest_by_hand(recorded):
    run, scene = recorded
    pixels = np.full((4, 3, 2), (320.0, 240.0))
    pixels[1, 2] = 10.0, 240.0  # 10.5 from the left border
    pixels[2, 0] = 635.5, 240.0  # 4 from the right
    pixels[3, 1] = 320.0, 477.0  # 2.5 from the lower
    for last, expected in ((4, 2.5), (3, 4.0), (2, 10.5), (1, 239.5)):
        shown = pixels.copy()
        shown[last:] = np.nan
        made = replaced(run, pixels=shown)
        assert measures.border_margin(RecordedRuns(made, scene)).tolist() == [expected]
    pixels[3, 1] = -3.0, 240.0
    assert measures.border_margin(RecordedRuns(replaced(run, pixels=pixels), scene)).tolist() == [
        -2.5
    ]


def test_excursion_and_detour_by_hand(recorded):
    run, scene = recorded
    goal = np.array([[100.0, 100.0], [200.0, 100.0], [200.0, 200.0]])
    pixels = np.broadcast_to(goal, (4, 3, 2)).copy()
    pixels[0, 0] = 140.0, 100.0  # 40 px from its goal
    pixels[1, 0] = 130.0, 130.0  # 30 px beside the line
    pixels[2, 0] = 90.0, 100.0  # 10 px beyond its end
    pixels[1, 1] = 248.0, 164.0  # mark 1 stands at its goal, and is 80 px from it for a while
    made = replaced(run, pixels=pixels, pixels_goal=goal)
    assert measures.image_excursion(RecordedRuns(made, scene)).tolist() == [2.0]
    assert measures.image_detour(RecordedRuns(made, scene)).tolist() == [80.0]
    pixels[1, 1] = goal[1]
    made = replaced(run, pixels=pixels, pixels_goal=goal)
    assert measures.image_detour(RecordedRuns(made, scene)).tolist() == [30.0]
    pixels[1, 0] = 130.0, 100.0
    made = replaced(run, pixels=pixels, pixels_goal=goal)
    assert measures.image_detour(RecordedRuns(made, scene)).tolist() == [10.0]


def test_the_margin_to_the_limits_is_a_share_of_the_range(recorded):
    run, scene = recorded
    low, high = scene.limits.T
    q = np.tile(0.5 * (low + high), (4, 1))
    q[2, 3] = low[3] + 0.07 * (high - low)[3]
    q[3, 1] = high[1] - 0.2 * (high - low)[1]
    found = measures.limit_margin(RecordedRuns(replaced(run, q=q), scene))
    np.testing.assert_allclose(found, [0.07], rtol=1e-12)
    q[3] = np.nan
    np.testing.assert_allclose(
        measures.limit_margin(RecordedRuns(replaced(run, q=q), scene)), [0.07]
    )


def test_without_border_limits_or_goal_image_these_measures_are_undefined(free_scene):
    given = rs.IBVS(rs.GoalFeatures(SQUARE[:, :2].ravel()))
    found = one(rs.compare(free_scene(SQUARE), {"a": given}, GOAL @ rs.Pose.at(0.1, 0, 0)))
    for key in ("border_margin", "limit_margin", "image_excursion", "image_detour", "pixel_error"):
        assert np.isnan(found[key])
    assert found["retreat"] == pytest.approx(0.0, abs=1e-4)  # a converged run ends at the goal


# ---- batches ----


@pytest.fixture(scope="module")
def batch():
    scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    starts = scenario.start + 0.15 * np.random.default_rng(0).standard_normal((7, 7))
    tasks = {"image": scenario.task, "pose": rs.PBVS()}
    return scenario.scene, tasks, starts, rs.compare(scenario.scene, tasks, starts, duration=15)


def test_a_row_of_a_batch_has_the_bits_of_the_run_alone(batch):
    scene, tasks, starts, found = batch
    for row in (0, 3, 6):
        alone = rs.compare(scene, tasks, starts[row], duration=15)
        for key in found.data.data_vars:
            np.testing.assert_array_equal(found.data[key].values[:, row], alone.data[key].values)


def test_a_batch_is_measured_in_blocks_of_any_size(batch, monkeypatch):
    scene, tasks, starts, found = batch
    monkeypatch.setattr("robsim.analysis.run_arrays.BLOCK", 1000)  # of 376 moments: two runs
    again = rs.compare(scene, tasks, starts, duration=15)
    xr.testing.assert_identical(again.data, found.data)


def test_of_a_batch_the_table_has_shares_and_medians(batch):
    *_, found = batch
    arrived = found.data.outcome.values == rs.Outcome.CONVERGED
    assert 0 < arrived.sum() < arrived.size  # some do not
    began = found.data.began.values
    np.testing.assert_array_equal(found.converged(), arrived.sum(axis=1) / began.sum(axis=1))
    np.testing.assert_array_equal(found.began(), began.sum(axis=1))
    times = found.data.time.values
    assert (np.isfinite(times) == arrived).all()
    for share in (0.05, 0.5, 0.95):
        expected = [np.quantile(t[a], share) for t, a in zip(times, arrived, strict=True)]
        np.testing.assert_array_equal(found.quantile(share).time, expected)
    lines = str(found).splitlines()
    assert lines[-2] == (
        "converged: share of the starts that began; the rest: medians of the runs that converged, "
        "of 7"
    )
    assert lines[-1] == "note: 1 of 7 starts could not begin and are not counted: 1 out of image"
    assert f"{np.median(times[0][arrived[0]]):.3g}" in lines[2].split()
    assert lines[2].split()[1:3] == [f"{arrived[0].sum() / 6:.4g}", "6"]


def test_a_summary_has_the_measures_of_all_instants_and_keeps_the_ends(batch, monkeypatch):
    """In parts of two runs, and with the noise of the numbers that the runs have."""
    scene, tasks, starts, _ = batch
    monkeypatch.setattr("robsim.analysis.run_arrays.BLOCK", 200)  # of 76 moments: two runs
    options = {"duration": 3, "sensing": rs.Sensing(noise=0.1), "first_run": 5}
    shares = []
    found = rs.compare(scene, tasks, starts, record="summary", progress=shares.append, **options)
    xr.testing.assert_identical(found.data, rs.compare(scene, tasks, starts, **options).data)
    assert shares == sorted(shares) and shares[-1] <= 1
    for name, task in tasks.items():
        expected = rs.simulate(scene, task, starts, record="summary", **options)
        assert found.runs[name].identical(expected)
    alone = rs.compare(scene, tasks, starts[0], record="summary", **options)
    expected = rs.simulate(scene, tasks["pose"], starts[0], record="summary", **options)
    assert alone.runs["pose"].identical(expected)
    assert float(alone.data.rotation[0]) == float(found.data.rotation[0, 0])


def test_ctrl_c_keeps_the_ends_that_were_reached(batch, monkeypatch):
    scene, tasks, starts, _ = batch
    monkeypatch.setattr("robsim.analysis.run_arrays.BLOCK", 200)
    shares = []

    def stop(share):
        shares.append(share)
        if share > 0.75:
            raise KeyboardInterrupt

    with pytest.raises(rs.errors.Interrupted) as stopped:
        rs.compare(scene, tasks, starts, record="summary", progress=stop, duration=3)
    found = stopped.value.run
    assert found.names == ("image", "pose") and found.data.sizes["run"] == 7
    assert (found.data.outcome[0] != rs.Outcome.RUNNING).all()
    left = found.data.outcome.values[1] == rs.Outcome.RUNNING
    assert 0 < left.sum() < 7 and np.isnan(found.data.rotation.values[1, -1])


def test_starts_that_cannot_begin_are_no_failures(free_scene):
    """Two see nothing, one stands behind, one is at the goal, one loses a mark on its way."""
    aside, behind = GOAL @ rs.Pose.at(3, 0, 0), GOAL @ rs.Pose.at(0, 0, 2)
    near, turned = GOAL @ rs.Pose.at(0.05, 0, 0), GOAL @ rs.Pose.at(rotvec=(0, 0, 3.1))
    starts = np.stack([pose.q for pose in (aside, aside, behind, GOAL, near, turned)])
    scene, tasks = free_scene(SQUARE, **SEEN), {"a": rs.IBVS(GOAL), "b": rs.PBVS(GOAL)}
    found = rs.compare(scene, tasks, starts, duration=15)
    ends = found.data.outcome.values[0]
    lost = rs.Outcome.OUT_OF_IMAGE, rs.Outcome.BEHIND_CAMERA
    assert [rs.Outcome(end) in lost for end in ends[:3]] == [True] * 3
    np.testing.assert_array_equal(found.data.began, [[False] * 3 + [True] * 3] * 2)
    np.testing.assert_array_equal(found.began(), [3, 3])
    assert (found.data.outcome.values[:, 3:5] == rs.Outcome.CONVERGED).all()
    arrived = found.data.outcome.values[:, 3:] == rs.Outcome.CONVERGED
    np.testing.assert_array_equal(found.converged(), arrived.mean(axis=1))
    why = "2 out of image, 1 behind camera"
    note = f"note: 3 of 6 starts could not begin and are not counted: {why}"
    assert str(found).splitlines()[-1] == note
    assert found.csv().splitlines()[0].startswith("scheme,converged (1),began (1),time (s)")
    assert found.csv().splitlines()[1].split(",")[2] == "3"


def test_where_no_start_can_begin_there_is_no_share(free_scene):
    aside = np.stack([(GOAL @ rs.Pose.at(3, 0, 0)).q] * 2)
    found = rs.compare(free_scene(SQUARE, **SEEN), {"a": rs.IBVS(GOAL)}, aside, duration=1)
    assert np.isnan(found.converged()).all() and str(found).splitlines()[2].split() == [
        "a",
        "-",
        "0",
    ]


def test_a_start_that_cannot_begin_under_one_scheme_alone_is_reported_for_it(free_scene):
    starts = np.stack([(GOAL @ rs.Pose.at(x, 0, 0)).q for x in (0.0, 0.8)])
    small, large = free_scene(SQUARE, **SEEN), free_scene(0.3 * SQUARE)
    scenes = {"a": small, "b": large}
    found = rs.compare({n: rs.Experiment(s, rs.IBVS(GOAL), starts) for n, s in scenes.items()})
    assert found.began().values.tolist() == [1, 2]
    why = "note: under a 1 of 2 starts could not begin and are not counted: 1 out of image"
    assert why in str(found).splitlines() and "under b" not in str(found)


def test_all_schemes_have_the_noise_of_the_same_seed_and_run(batch):
    scene, tasks, starts, _ = batch
    same = {"a": tasks["image"], "b": tasks["image"]}
    settings = {"sensing": rs.Sensing(noise=0.5), "seed": 3, "duration": 1}
    found = rs.compare(scene, same, starts[:3], **settings)
    np.testing.assert_array_equal(found.runs["a"].q, found.runs["b"].q)
    expected = rs.simulate(scene, tasks["image"], starts[:3], **settings)
    assert found.runs["a"].identical(expected)


# ---- the table and its data ----


def test_every_measure_has_a_unit_and_a_meaning(batch):
    *_, found = batch
    assert found.data.title == "RobSim comparison" and found.data.outcome.dims == ("scheme", "run")
    for key in measures.MEASURES:
        told = found.data[key].attrs
        assert told["units"] and len(told["long_name"]) > 10
        assert found.data[key].dims == ("scheme", "run")


def test_the_table_is_aligned_and_its_csv_is_exact(free_scene):
    tasks = {"a": rs.IBVS(GOAL), "longer name": rs.PBVS(GOAL)}
    start = GOAL @ rs.Pose.at(0.1, 0, -0.2)
    found = rs.compare(free_scene(SQUARE, **SEEN), tasks, start, duration=15)
    lines = str(found).splitlines()
    names, units = lines[0].split(), lines[1].split()
    assert names[:3] == ["scheme", "outcome", "time"] and units[:2] == ["s", "px"]
    assert len({len(line) for line in lines[2:4]}) == 1 and "limits" not in names
    for line, name in zip(lines[2:], tasks, strict=True):
        assert line.startswith(name)
        assert float(line.removeprefix(name).split()[1]) == pytest.approx(
            one(found, name)["time"], rel=5e-3
        )
    header, *rows = [line.split(",") for line in found.csv().splitlines()]
    assert header[:3] == ["scheme", "outcome", "time (s)"] and len(rows) == 2
    for row in rows:
        values = one(found, row[0])
        read = [float(text or "nan") for text in row[2:]]
        np.testing.assert_array_equal(read, list(values.values()))


def test_schemes_may_have_scenes_starts_and_settings_of_their_own(free_scene):
    start = GOAL @ rs.Pose.at(0.1, 0, 0)
    first = rs.Experiment(free_scene(SQUARE), rs.IBVS(GOAL), start, duration=1.0)
    second = rs.Experiment(free_scene(2 * SQUARE), rs.IBVS(GOAL), GOAL, duration=2.0)
    assert rs.compare({"a": first}).notes == ()
    found = rs.compare({"a": first, "b": second})
    assert found.notes == (
        "note: another scene than a: b",
        "note: another start than a: b",
        "note: other run settings than a: b",
    )
    assert str(found).endswith("\n".join(found.notes))


# ---- errors ----


def test_runs_that_cannot_be_compared_are_reported_by_name(free_scene):
    scene, bad = free_scene(SQUARE, **SEEN), rs.IBVS(rs.Pose.at(0, 0, 1))
    cases = {
        "expected tasks by name, as in {'mine': IBVS\\(\\)}, got {}": {},
        "got \\[IBVS": [rs.IBVS()],
        "expected a text as the name of a scheme, got 3": {3: rs.IBVS(GOAL)},
        "expected a text as the name of a scheme, got ''": {"": rs.IBVS(GOAL)},
        "scheme 'b': task: expected a task such as IBVS\\(...\\), got 'mean'": {
            "a": rs.IBVS(GOAL), "b": "mean"},
        "scheme 'b': task: expected a task .* got <class": {"b": rs.IBVS},
        "scheme 'b': the shown goal puts mark 0 of 'dots' behind": {"a": rs.IBVS(GOAL), "b": bad},
    }  # fmt: skip
    for message, tasks in cases.items():
        with pytest.raises(rs.errors.InputError, match=message):
            rs.compare(scene, tasks, GOAL)
    with pytest.raises(rs.errors.GoalError, match="scheme 'b'"):
        rs.compare(scene, {"a": rs.IBVS(GOAL), "b": bad}, GOAL)
    task = {"a": rs.IBVS(GOAL)}
    for message, more in {
        "no setting 'gain'; .*settings: sensing, actuation, safety, endings, dt, duration": {
            "gain": 3
        },
        "no setting 'druation'; did you mean 'duration'": {"druation": 3},
        "scheme 'a': dt \\(seconds\\) must be a positive number": {"dt": -1},
        "progress: expected a function of the share done, got 3": {"progress": 3},
        "0.05 s, must be a multiple": {"sensing": rs.Sensing(period=0.05)},
    }.items():
        with pytest.raises(rs.errors.InputError, match=message):
            rs.compare(scene, task, GOAL, **more)
    with pytest.raises(rs.errors.InputError, match=r"^q0: expected shape"):
        rs.compare(scene, task, [1.0])
    with pytest.raises(rs.errors.InputError, match="expected a Scene, got 3"):
        rs.compare(3, task)
    one = rs.Experiment(scene, rs.IBVS(GOAL), GOAL)
    with pytest.raises(rs.errors.InputError, match="expected experiments by name"):
        rs.compare({})
    with pytest.raises(rs.errors.InputError, match="scheme 'a': expected an Experiment, got IBVS"):
        rs.compare({"a": rs.IBVS()})
    with pytest.raises(rs.errors.InputError, match="experiments have their own tasks"):
        rs.compare({"a": one}, duration=2.0)
    with pytest.raises(rs.errors.InputError, match="the same number of starts"):
        rs.compare({"a": one, "b": one.with_(start=np.stack([GOAL.q, GOAL.q]))})
    mission = one.with_(task=rs.Mission([rs.Phase("there", rs.IBVS(GOAL))]))
    with pytest.raises(rs.errors.InputError, match="scheme 'a': a mission has no single error"):
        rs.compare({"a": mission})


def test_the_motion_of_joints_that_lag_is_measured_not_their_command(free_scene):
    """Straight along one axis: travel and speed belong to the coordinates themselves."""
    scene, start = free_scene(SQUARE), GOAL @ rs.Pose.at(0, 0, -0.3)
    for actuation in (rs.Actuation(velocity=0.05), rs.Actuation(lag=0.1, acceleration=1.0)):
        options = {"duration": 2.0, "dt": 0.01, "actuation": actuation}
        found = rs.compare(scene, {"a": rs.PBVS(GOAL)}, start, **options)
        run, data = found.runs["a"], found.data.isel(scheme=0)
        way = np.abs(np.diff(run.q.values[:, 2])).sum()
        assert float(data.travel_linear) == pytest.approx(way, rel=5e-3)
        assert float(data.travel_linear) == pytest.approx(float(data.path_length), rel=5e-3)
        speeds = np.linalg.norm(run.camera_velocity.values[:, :3], axis=1)
        assert float(data.peak_speed) == pytest.approx(speeds.max(), rel=1e-12)
        assert float(data.effort_linear) == pytest.approx(
            (run.qd.values[:-1, :3] ** 2).sum() * 0.01
        )


def test_the_refusal_of_one_scheme_is_reported_before_another_runs(free_scene):
    scene, reports = free_scene(SQUARE), []
    rare = {"sensing": rs.Sensing(period=0.05), "dt": 0.04}
    good = rs.Experiment(scene, rs.IBVS(GOAL), GOAL)
    with pytest.raises(rs.errors.InputError, match="scheme 'b': sensing: the period of the camera"):
        rs.compare({"a": good, "b": good.with_(**rare)}, progress=reports.append)
    assert not reports


@pytest.mark.parametrize("share", [-0.1, 1.1, np.nan, "half", [0.1, 0.9], None])
def test_a_quantile_that_is_no_share_is_refused(free_scene, share):
    for start in (GOAL, np.stack([GOAL.q] * 2)):
        found = rs.compare(free_scene(SQUARE), {"a": rs.IBVS(GOAL)}, start, duration=0.1)
        with pytest.raises(rs.errors.InputError, match="share of a quantile"):
            found.quantile(share)


def test_ctrl_c_gives_the_comparison_of_the_simulated_part(free_scene):
    shares = []

    def stop(share):
        shares.append(share)
        if share > 0.34:  # in the second scheme of three
            raise KeyboardInterrupt

    tasks = {"a": rs.IBVS(GOAL), "b": rs.IBVS(GOAL, gain=1e-3), "c": rs.IBVS(GOAL)}
    start = GOAL @ rs.Pose.at(0.1, 0, 0)
    settings = {"duration": 3000, "dt": 1e-3, "record": 1000}
    with pytest.raises(rs.errors.Interrupted, match="stopped by the user") as stopped:
        rs.compare(free_scene(SQUARE), tasks, start, progress=stop, **settings)
    found = stopped.value.run
    assert found.names == ("a", "b")
    assert int(found.data.outcome[0]) == rs.Outcome.CONVERGED
    assert int(found.data.outcome[1]) == rs.Outcome.RUNNING and "running" in str(found)
