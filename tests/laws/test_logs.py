"""Logs as runs: the last value until each period, the controller's own commands, and why."""

import numpy as np
import pytest

import robsim as rs
from robsim.page.export import load_recording
from robsim.run.log import NANO, Log, Stream
from robsim.run.run_from_log import make_run_from_log

DRIVE_FAULTS = ("drive factor", "command delay", "drive lag", "swapped drives")
ENDS = ("outcome", "end_time", "q_end", "pixels_end", "pixel_error", "goal_pose", "q0")


def experiment(name, **changes):
    return rs.load_scenario(rs.examples.path(name)).with_(**changes)


@pytest.fixture(scope="module")
def rhino():
    return experiment("chapter_6_1")


@pytest.fixture(scope="module")
def rows(rhino):
    return rs.logs.to_table(rhino.run(duration=1.0))


def same(run, other, names):
    for name in names:
        mine = run[name].values
        if "time" in run[name].dims:
            mine = mine[: other.sizes["time"]]
        np.testing.assert_array_equal(mine, other[name].values, err_msg=name)


@pytest.mark.parametrize(
    "name",
    ["visp_tutorial", "chapter_6_1", "stereo_in_hand", "watching_head", "joint_lag", "mobile_arm"],
)
def test_a_table_is_the_run_again_to_the_bit(name, tmp_path):
    made = experiment(name, duration=1.2)
    run = made.run()
    rs.logs.to_table(run).to_csv(tmp_path / "log.csv", index=False)
    again = rs.logs.read_log(tmp_path / "log.csv", made)
    assert set(run.data_vars) - set(again.data_vars) == set()
    same(run, again, ["time", "q", "qd", "pixels", "s", "error", "camera_pose", "camera_velocity"])
    same(run, again, ("q_end", "pixels_end", "pixel_error", "goal_pose", "q0"))
    assert not again.image_age.values.any()
    np.testing.assert_allclose(again.path_length, run.path_length, rtol=1e-9)


def test_rows_are_their_table(rhino, rows):
    again = rs.logs.read_log(rows.to_dict("records"), rhino)
    assert again.attrs["recorded"] == "rows"
    assert again.drop_attrs(deep=False).identical(
        rs.logs.read_log(rows, rhino).drop_attrs(deep=False)
    )


def test_it_ends_as_the_run_did(rhino):
    run = rhino.run()
    again = rs.logs.read_log(rs.logs.to_table(run), rhino)
    same(run, again, ENDS)
    assert again.attrs["hold"] == 0 and again.attrs["recorded"] == "table"


def test_a_log_that_goes_on_reports_since_when_its_error_is_small(rhino):
    """Held for a second at its goal; in one period the marks are off."""
    run = rhino.run(hold=True, duration=13.0)
    log, small = (
        rs.logs.to_table(run),
        (np.abs(run.error.values) < run.attrs["tolerance"]).all(axis=1),
    )
    first = int(np.argmax(small))
    log.loc[first + 4, "pixels[0,column]"] += 5.0
    again = rs.logs.read_log(log, rhino)
    assert again.attrs["converged_at"] == pytest.approx((first + 5) * rhino.dt, abs=1e-12)
    figure = rs.plot.joints(again)
    text = f"converged after {(first + 5) * rhino.dt:.3g} s; the log ends at 13 s"
    assert small[first:].all() and figure.get_suptitle() == text
    short = rs.logs.read_log(log[: first - 1], rhino)
    assert "converged_at" not in short.attrs
    assert rs.plot.joints(short).get_suptitle().startswith("not converged; the log ends at ")


def test_a_recorded_run_is_saved_opened_and_drawn(rhino, rows, tmp_path):
    run = rs.logs.read_log(rows, rhino)
    assert rs.open_run(rs.save_run(run, tmp_path / "log.nc")).identical(run)
    assert len(rs.plot.run(run, rhino.scene).axes) == 5
    page = load_recording(rs.export_html(run, tmp_path / "log.html"))
    assert "Simulated from the same start" in str(page.header)


def test_ages_are_known_to_the_nanosecond_also_of_times_since_1970(rhino, rows):
    """As float64 the times themselves are known to 256 ns."""
    run, since = rs.logs.read_log(rows, rhino), 1_700_000_000_000_000_007
    times = since + np.round(run.time.values * NANO).astype(np.int64)
    images = Stream("images", times[::2] - 9, run.pixels.values[::2])
    (sight,) = rs.Controller(rhino).sights
    log = Log("log", Stream("joints", times - 9, run.q.values), {sight.key: images})
    ages = make_run_from_log(log, rhino).image_age.values
    np.testing.assert_array_equal(ages[:, 0], [0.0, 0.04] * 13)


def test_a_mark_that_is_not_seen_is_nan_and_held_for_the_controller(rhino, rows):
    log = rows.copy()
    log.loc[5:8, ["pixels[2,column]", "pixels[2,row]"]] = np.nan
    run = rs.logs.read_log(log, rhino)
    np.testing.assert_array_equal(
        np.isnan(run.pixels.values[:, 2, 0]), (log.index > 4) & (log.index < 9)
    )
    controller = rs.Controller(rhino)
    for t in range(12):
        qd = controller.step(run.pixels.values[t], run.q.values[t], t * rhino.dt).velocities
        assert np.isfinite(qd).all()
    with pytest.warns(rs.errors.ReplayWarning, match="differ from the controller.s"):
        again = rs.replay(run)
    np.testing.assert_array_equal(again.qd.values[11], qd)
    assert [each.about for each in rs.explain(run, trials=False).causes][-1] == "unseen marks"


def test_marks_that_are_seen_in_turn_begin_where_each_was_last(rhino, rows):
    log = rows.copy()
    pairs = [[f"pixels[{mark},column]", f"pixels[{mark},row]"] for mark in range(4)]
    for row in range(6):
        for mark in set(range(4)) - {row % 4}:
            log.loc[row, pairs[mark]] = np.nan
    run = rs.logs.read_log(log, rhino)
    assert run.attrs["recorded_from"] == str(round(3 * 0.04 * 1e9))
    begin = [rows.loc[mark, pairs[mark]] for mark in range(4)]
    np.testing.assert_array_equal(run.pixels[0], begin)
    assert np.isnan(run.pixels.values[1:3, :, 0]).sum(axis=1).tolist() == [3, 3]
    assert np.isfinite(run.s).all()


def test_replay_commands_the_same_to_the_bit(rhino, rows):
    """Any other command would be a ReplayWarning, which is an error here."""
    run = rs.logs.read_log(rows, rhino)
    assert rs.replay(run).identical(run)
    found = rs.explain(run)
    assert found.causes == () and "the commands of this controller" in found.remarks[0]


def test_a_robot_with_another_gain_and_late_images_is_found_out(rhino):
    """Gain times 0.8, images two periods late: the factor and the delay of the commands."""
    real = rhino.at("task.gain", 0.8 * rhino.task.gain).with_(sensing=rs.Sensing(latency=0.08))
    found = rs.explain(rs.logs.read_log(rs.logs.to_table(real.run()), rhino), trials=False)
    (commands,) = found.causes
    assert commands.about == "late commands"
    assert commands.evidence["delay_s"] == pytest.approx(0.08, abs=0.001)
    assert commands.evidence["factor"] == pytest.approx(0.8, abs=0.01)
    assert "0.803" in str(found) and "(1.99 periods)" in str(found)


def test_joints_that_follow_late_are_found_out(rhino):
    real = rhino.with_(actuation=rs.Actuation(lag=0.12))
    found = rs.explain(rs.logs.read_log(rs.logs.to_table(real.run()), rhino), trials=False)
    (motion,) = found.causes
    assert motion.about == "drive lag" and "with a lag of 0.12 +- " in motion.sentence
    assert motion.evidence["lag_s"] == pytest.approx(0.12, abs=1e-9)


@pytest.mark.full
@pytest.mark.parametrize(
    ("changes", "about", "number", "value"),
    [
        ({}, None, "", 0.0),
        ({"gain": 0.9}, "drive factor", "factor", 0.9),
        ({"late": 3}, "command delay", "delay_s", 0.12),
        ({"lag": 0.4}, "drive lag", "lag_s", 0.4),
    ],
)
def test_a_clock_that_trembles_does_not_hide_how_joints_follow(
    rhino, changes, about, number, value
):
    """Rows up to 20 % of a period early or late; the joints execute their commands exactly."""
    rng, dt = np.random.default_rng(6), rhino.dt
    run = rhino.run(duration=6.0)
    log = rs.logs.to_table(run)
    told = log[[f"qd[{name}]" for name in rhino.scene.velocity_names]].to_numpy()
    log["time"] += rng.uniform(-0.2, 0.2, len(log)) * dt * (log.index > 0)
    late, steps = changes.get("late", 0), np.diff(log["time"])
    rates, now = np.zeros_like(told), np.zeros(told.shape[1])
    for i, step in enumerate(steps[late:], start=late):
        left = np.exp(-step / changes["lag"]) if "lag" in changes else 0.0
        goal = changes.get("gain", 1.0) * told[i - late]
        now = goal + left * (now - goal)
        rates[i + 1] = now * step
    joints = [f"q[{name}]" for name in rhino.scene.coordinate_names]
    log[joints] = run.q.values[0] + np.cumsum(rates, axis=0)
    explained = rs.explain(rs.logs.read_log(log, rhino), trials=False)
    motion = [each for each in explained.causes if each.about in DRIVE_FAULTS]
    assert [each.about for each in motion] == [about] * bool(changes)
    for each in motion:
        assert each.evidence[number] == pytest.approx(value, rel=0.02)


def test_a_target_elsewhere_is_found_out_in_the_images(rhino):
    moved = rhino.scene.believe(place=rs.Pose.at(0.005))
    run = rs.logs.read_log(rs.logs.to_table(rhino.run(duration=1.0)), rhino.with_(scene=moved))
    found = rs.explain(run, trials=False)
    (target,) = found.causes
    assert "target pose" in target.about and "'cube'" in target.sentence
    assert target.evidence["x_m"] == pytest.approx(-0.005, abs=1e-5)


def test_it_is_measured_beside_its_simulation(rhino):
    real = rhino.with_(sensing=rs.Sensing(latency=0.08))
    run = rs.logs.read_log(rs.logs.to_table(real.run()), rhino)
    both = rs.compare({"real": run, "simulated": rhino}).data
    alone = rs.compare({"simulated": real}).data
    for name in ("image_detour", "path_ratio", "rotation", "effort_angular", "limit_margin"):
        assert float(both[name][0]) == pytest.approx(float(alone[name][0]), rel=1e-9)
    assert float(both["image_detour"][1]) != float(both["image_detour"][0])


def test_units_and_names_of_other_programs(rhino, rows):
    log = rows.rename(columns={"q[shoulder]": "joint_1"})
    for name in [name for name in log if name.startswith("q[")] + ["joint_1"]:
        log[name] = np.degrees(log[name])
    log["time"] *= 1000
    run = rs.logs.read_log(
        log, rhino, columns={"q[shoulder]": "joint_1"}, units={"q": "deg", "time": "ms"}
    )
    np.testing.assert_allclose(run.q, rs.logs.read_log(rows, rhino).q, rtol=1e-15)


def test_without_commands_velocities_are_differences(rhino, rows):
    log = rows[[name for name in rows if not name.startswith("qd")]]
    run = rs.logs.read_log(log, rhino)
    expected = np.diff(log[[f"q[{name}]" for name in run.coordinate.values]], axis=0) / rhino.dt
    np.testing.assert_array_equal(run.qd[:-1], expected)
    assert "Commands were not recorded" in str(rs.explain(run, trials=False))


def test_a_task_without_a_camera_is_read_from_its_joints():
    arm = rs.robots.puma560()
    task = rs.FollowJoints(arm.home + 0.1, duration=1.0)
    made = rs.Experiment(rs.Scene(arm), task, duration=1.0)
    run = made.run()
    again = rs.logs.read_log(rs.logs.to_table(run), made)
    same(run, again, ["q", "qd", "s", "frame_pose"])
    assert again.sizes["mark"] == 0
