"""Logs with the clock of a real computer, written with the csv module: the row of each instant."""

import csv

import numpy as np
import pytest

import robsim as rs
from robsim.run.control.mark_input import Marks
from robsim.run.log import NANO
from robsim.run.log_commands import ImageTimes, compute_signals

JITTERS = (0.0, 1e-9, 1e-7, 1e-6, 1e-3, 8e-3)  # seconds; a period is 0.04 s


@pytest.fixture(scope="module")
def rhino():
    return rs.load_scenario(rs.examples.path("chapter_6_1"))


@pytest.fixture(scope="module")
def run(rhino):
    run = rhino.run()
    return run.isel(time=np.isfinite(run.q.values).all(axis=1))


def list_rows(run, parts=("q", "qd", "pixels")):
    """The columns of a log as rows {column: number}, one for each instant of a run."""
    names = {
        "q": [f"q[{name}]" for name in run.coordinate.values],
        "qd": [f"qd[{name}]" for name in run.velocity.values],
        "pixels": [
            f"pixels[{i},{axis}]" for i in range(run.sizes["mark"]) for axis in ("column", "row")
        ],
    }
    values = {part: run[part].values.reshape(run.sizes["time"], -1).tolist() for part in parts}
    return [
        {name: x for part in parts for name, x in zip(names[part], values[part][i], strict=True)}
        for i in range(run.sizes["time"])
    ]


def write_csv(path, rows, times):
    """Write rows at times to a CSV file, in the order of time; missing columns are empty."""
    fields = ["time", *dict.fromkeys(name for row in rows for name in row)]
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, fields)
        writer.writeheader()
        for i in np.argsort(times, kind="stable"):
            writer.writerow({"time": repr(float(times[i]))} | rows[i])
    return path


def execute_commands(run, times):
    """The rows of a run, with joints that execute each command exactly until the next time."""
    moves = run.qd.values[:-1] * np.diff(times)[:, None]
    moved = run.copy(deep=True)
    moved.q.values[1:] = run.q.values[0] + np.cumsum(moves, axis=0)
    return list_rows(moved)


def check_rows(log, run):
    """See that the log has the joints, commands and images of each instant of a run."""
    for name in ("q", "qd", "pixels"):
        np.testing.assert_array_equal(log[name].values, run[name].values, err_msg=name)
    assert rs.Outcome(int(log.outcome)) is rs.Outcome.CONVERGED
    assert not log.interpolated.values.any()
    assert [log.attrs[f"held_{name}"] for name in ("images", "commands")] == [0, 0]


def check_health(log):
    """See that the explanation of a log has no finding."""
    assert rs.explain(log, trials=False).causes == ()


def check_motion(log):
    """See that the joints of a log move as commanded; its images are of other joints."""
    remarks = rs.explain(log, trials=False).remarks
    assert any(each.startswith("The joints move as commanded") for each in remarks)


@pytest.mark.full
@pytest.mark.parametrize("jitter", JITTERS)
def test_a_row_that_jitters_is_the_row_of_its_instant(rhino, run, jitter, tmp_path):
    """With the last row before k dt, 22 to 94 % of the rows were one period old."""
    rng = np.random.default_rng(11)
    for _ in range(3):
        times = run.time.values + rng.uniform(-jitter, jitter, run.sizes["time"])
        log = rs.logs.read_log(write_csv(tmp_path / "log.csv", list_rows(run), times), rhino)
        check_rows(log, run)
        np.testing.assert_allclose(np.diff(log.log_time), np.diff(times), rtol=0, atol=2e-9)
        assert not log.image_age.values.any() and not log.command_age.values.any()
    check_health(log)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(3))
def test_signals_with_stamps_of_their_own_jitter(rhino, run, seed, tmp_path):
    """Joints, images and commands in rows of their own, each up to a fifth of a period off.

    Commands are computed 6 ms after the joints; images are 0 or 26 ms older than the joints.
    """
    rng, rows, times = np.random.default_rng(seed), [], []
    age = [0.0, 0.026, 0.0][seed]
    for part, offset in (("q", 0.0), ("pixels", -age), ("qd", 0.006)):
        rows += list_rows(run, (part,))
        times += (run.time.values + offset + rng.uniform(-8e-3, 8e-3, run.sizes["time"])).tolist()
    log = rs.logs.read_log(write_csv(tmp_path / "log.csv", rows, np.array(times)), rhino)
    check_rows(log, run)
    assert log.image_age.values.mean() == pytest.approx(age, abs=2e-3)
    assert log.command_age.values.mean() == pytest.approx(-0.006, abs=2e-3)
    if not age:
        check_health(log)


@pytest.mark.parametrize("drift", [0.99, 1.01])
def test_a_clock_that_drifts_repeats_no_row(rhino, run, drift, tmp_path):
    """A period 1 % off: in 298 periods, three rows too many or too few."""
    times = run.time.values * drift
    log = rs.logs.read_log(write_csv(tmp_path / "log.csv", list_rows(run), times), rhino)
    assert abs(log.sizes["time"] - drift * run.sizes["time"]) < 1.5
    measured = ~log.interpolated.values
    rows = np.searchsorted(times, log.log_time.values[measured] + 1e-6) - 1
    np.testing.assert_array_equal(log.q.values[measured], run.q.values[rows])
    np.testing.assert_array_equal(log.pixels.values[measured], run.pixels.values[rows])
    assert set(np.diff(rows).tolist()) <= {1, 2} and (~measured).sum() <= 3
    assert rs.Outcome(int(log.outcome)) is rs.Outcome.CONVERGED


def test_a_period_that_jitters_lets_the_clock_walk(rhino, run, tmp_path):
    """Sleeps of 40 ms +- 4 ms: after 298 periods the clock is tens of milliseconds off."""
    rng = np.random.default_rng(5)
    times = np.cumsum(0.04 + rng.normal(0.0, 4e-3, run.sizes["time"]))
    rows = execute_commands(run, times)
    log = rs.logs.read_log(write_csv(tmp_path / "log.csv", rows, times), rhino)
    assert log.attrs["interpolated_joints"] <= 15 and log.attrs["held_images"] <= 15
    assert rs.Outcome(int(log.outcome)) is rs.Outcome.CONVERGED
    check_motion(log)


def test_lost_rows_are_interpolated_and_counted(rhino, run, tmp_path):
    rng, rows = np.random.default_rng(3), list_rows(run)
    lost = 1 + np.sort(rng.choice(len(rows) - 2, 20, replace=False))
    left = np.delete(np.arange(len(rows)), lost)
    times = run.time.values + rng.uniform(-1e-3, 1e-3, len(rows))
    path = write_csv(tmp_path / "log.csv", [rows[i] for i in left], times[left])
    log = rs.logs.read_log(path, rhino)
    np.testing.assert_array_equal(np.flatnonzero(log.interpolated), lost)
    np.testing.assert_array_equal(log.q.values[left], run.q.values[left])
    for name in run.coordinate.values:
        q = run.q.sel(coordinate=name).values
        expected = np.interp(log.log_time.values[lost], log.log_time.values[left], q[left])
        np.testing.assert_allclose(log.q.sel(coordinate=name)[lost], expected, atol=1e-12)
    held = np.maximum.accumulate(
        np.where(np.isin(np.arange(len(rows)), lost), 0, np.arange(len(rows)))
    )
    np.testing.assert_array_equal(log.pixels.values, run.pixels.values[held])
    np.testing.assert_array_equal(log.qd.values, run.qd.values[held])
    counts = [log.attrs[name] for name in ("interpolated_joints", "held_images", "held_commands")]
    assert counts == [20, 20, 20]
    text = "joints are interpolated at 20, images are held at 20, commands are held at 20."
    assert f"Of 298 instants, {text}" in rs.explain(log, trials=False).remarks


def test_signals_that_keep_no_step_are_the_last_before_an_instant(rhino, run, tmp_path):
    """Joints at 250 Hz, images at 17 Hz and commands at 31 Hz, against a search by hand."""
    rows, times, end = [], [], 8.0
    for part, rate in (("q", 250.0), ("pixels", 17.0), ("qd", 31.0)):
        clock = np.arange(0.0, end, 1.0 / rate)
        nearest = np.minimum(np.rint(clock / 0.04).astype(int), run.sizes["time"] - 1)
        every = list_rows(run, (part,))
        rows += [every[i] for i in nearest]
        times += clock.tolist()
    path = write_csv(tmp_path / "log.csv", rows, np.array(times))
    log = rs.logs.read_log(path, rhino)
    begin = int(log.attrs["recorded_from"]) / 1e9
    for i, now in enumerate(begin + log.log_time.values):
        for name, rate in (("pixels", 17.0), ("qd", 31.0)):
            last = np.floor(now * rate + 1e-6) / rate
            source = min(round(last / 0.04), run.sizes["time"] - 1)
            np.testing.assert_array_equal(log[name].values[i], run[name].values[source])
        assert log.image_age.values[i, 0] == pytest.approx(now % (1 / 17), abs=2e-9)


def test_motion_is_compared_on_the_clock_of_the_log(rhino, run, tmp_path):
    """Calls up to 30 % early or late, between which each command is executed exactly."""
    rng, commands = np.random.default_rng(8), run.qd.values
    times = run.time.values + rng.uniform(-0.012, 0.012, len(commands))
    rows = execute_commands(run, times)
    log = rs.logs.read_log(write_csv(tmp_path / "log.csv", rows, times), rhino)
    check_motion(log)
    motion = np.diff(log.q, axis=0) / np.diff(log.log_time)[:, None]
    np.testing.assert_allclose(motion, commands[:-1], rtol=0, atol=1e-6)


def test_commands_that_begin_late_have_no_age_before(rhino, run, tmp_path):
    rows = list_rows(run)
    for row in rows[:5]:
        row |= {name: "" for name in row if name.startswith("qd[")}
    log = rs.logs.read_log(write_csv(tmp_path / "log.csv", rows, run.time.values), rhino)
    assert np.isnan(log.command_age.values[:5]).all() and not log.command_age.values[5:].any()
    assert log.attrs["held_commands"] == 5 and not log.qd.values[:5].any()
    assert rs.open_run(rs.save_run(log, tmp_path / "log.nc")).identical(log)


@pytest.mark.parametrize("name", ["stereo_in_hand", "marks_that_lie", "view_without_depth"])
def test_the_signals_of_a_log_are_those_of_decide_at_each_instant(name):
    experiment = rs.load_scenario(rs.examples.path(name))
    run = experiment.run(duration=20 * experiment.dt, hold=True)
    q, pixels = run.q.values, run.pixels.values.copy()
    pixels[5:9, 0] = np.nan  # a mark is hidden
    instants = np.rint(np.arange(len(q)) * experiment.dt * NANO).astype(np.int64)
    taken = instants - round(0.4 * experiment.dt * NANO)
    taken[12:15], pixels[12:15] = taken[11], pixels[11]  # an image is held
    clock = ImageTimes(instants, np.repeat(taken[:, None], pixels.shape[1], axis=1))
    found = compute_signals(experiment, q, pixels, clock)
    alone, last = rs.Controller(experiment), -np.inf
    for i, joints in enumerate(q):
        t, seen = i * experiment.dt, pixels[i]
        last = t - clock.ages[i, 0] if i not in (12, 13, 14) else last
        images = {}
        for sight in alone.sights:
            count = len(sight.target.marks)
            images[sight.key], seen = Marks(seen[:count], last), seen[count:]
        command, *_, weights = alone.decide(images, joints, t)
        for row, expected in zip(found[:3], command, strict=False):
            np.testing.assert_array_equal(row[i], expected[:, 0])
        np.testing.assert_array_equal(found.weights[i], [] if weights is None else weights[:, 0])
    assert np.ptp(found.qd, axis=0).any()
