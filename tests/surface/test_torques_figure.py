"""The figures of the torques of drives: curves, limits and saturation against the run."""

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex

import robsim as rs
from robsim import plot
from robsim.plot import palette

matplotlib.use("agg")
LIMITS = [2, 9, 5, 23, 1.2, 2, 1.0]  # N m; some are below the torques of the motion


def make_case(**drive):
    case = rs.load_scenario(rs.examples.path("eye_in_hand"))
    drive = rs.drives.VelocityLoop(bandwidth=60, gravity=False, **drive)
    return case.with_(actuation=rs.Actuation(drive=drive), duration=0.6)


@pytest.fixture(scope="module")
def run():
    return make_case(torque_limit=LIMITS).run()


def list_spans(time, flags):
    """Start and end of the periods before instants with a flag, one after another."""
    spans = []
    for t in np.flatnonzero(flags):
        joined = spans and spans[-1][1] == time[t - 1]
        spans[-1:] = [(spans[-1][0], time[t])] if joined else [*spans[-1:], (time[t - 1], time[t])]
    return spans


def test_each_joint_has_its_torque_its_limit_and_shaded_saturation(run):
    figure = plot.torques(run)
    assert len(figure.axes) == 9 and figure.get_suptitle() == "time limit after 0.6 s"
    time = run.time.values
    for i, axes in enumerate(figure.axes[:7]):
        curve, *limits = axes.get_lines()
        np.testing.assert_array_equal(curve.get_ydata(), run.torque.values[:, i])
        assert axes.get_ylabel() == f"link{i + 1} (N m)"
        shaded = [patch.get_extents().intervalx for patch in axes.patches]
        spans = [patch.get_x() + np.array([0, patch.get_width()]) for patch in axes.patches]
        expected = list_spans(time, run.saturation.values[:, i] > 0)
        assert len(shaded) == len(expected)
        np.testing.assert_allclose(spans, expected, atol=1e-12) if expected else None
        levels = {float(np.ravel(line.get_ydata())[0]) for line in limits}
        assert levels <= {LIMITS[i], -LIMITS[i]}
        low, high = axes.get_ylim()
        assert low < run.torque.values[:, i].min() and high > run.torque.values[:, i].max()
        title = axes.get_title(loc="right")
        share = run.saturation.values[1:, i].mean()
        assert title.startswith(f"at most {LIMITS[i]:g} N m")
        assert (f"limited for {100 * share:.0f} %" in title) == (share > 0)
    assert any(len(axes.patches) for axes in figure.axes)


def test_slides_of_joints_without_limits_and_of_sliding_joints():
    box = rs.shapes.Inertia(2.0, tensor=0.1 * np.eye(3))
    slide = rs.joints.Joint("prismatic")
    arm = rs.Robot(
        "lift", [rs.joints.Link("base"), rs.joints.Link("car", "base", slide, inertia=box)]
    )
    case = rs.simulate(
        rs.Scene(arm),
        rs.FollowJoints(by={"car": 0.1}, duration=0.2),
        dt=0.02,
        actuation=rs.Actuation(drive=rs.drives.VelocityLoop()),
    )
    (axes,) = plot.torques(case).axes
    assert axes.get_ylabel() == "car (N)" and axes.get_title(loc="right") == ""
    assert axes.get_lines()[0].get_ydata()[0] == pytest.approx(2.0 * 9.81, rel=1e-3)


def test_a_run_without_a_drive_is_refused():
    run = make_case().with_(actuation=rs.Actuation(), duration=0.1).run()
    with pytest.raises(rs.errors.InputError, match=r"this run has no drive; simulate it with"):
        plot.torques(run)


def test_the_diagnosis_has_torques_and_the_lag_of_the_velocities(run):
    found = rs.diagnose(run)
    for name in ("torque", "saturation", "torque_limit"):
        np.testing.assert_array_equal(found[name].values, run[name].values)
    lag = found["velocity_error"].values
    np.testing.assert_array_equal(lag[1:], run.qd.values[:-1] - run.qd_actual.values[1:])
    assert (lag[0] == 0).all()
    figure = plot.diagnosis(found)
    share, away = figure.axes[4:6]
    assert share.get_ylabel() == "torque (% of the limit)"
    for i in range(7):
        wanted = 100 * run.torque.values[:, i] / LIMITS[i]
        curves = [line.get_ydata() for line in share.get_lines()]
        assert any(len(y) == len(wanted) and np.allclose(y, wanted) for y in curves)
        color = palette.cycle_color(i)
        broad = [x for x in share.get_lines() if x.get_linewidth() > 4 and x.get_color() == color]
        spans = [(x.get_xdata()[0], x.get_xdata()[-1]) for x in broad if to_hex(x.get_color())]
        assert spans == list_spans(run.time.values, run.saturation.values[:, i] > 0)
        np.testing.assert_array_equal(away.get_lines()[i].get_ydata(), lag[:, i])
    plain = make_case().with_(actuation=rs.Actuation(), duration=0.1).run()
    assert len(plot.diagnosis(rs.diagnose(plain)).axes) <= 5


def test_the_diagnosis_of_torques_without_limits_is_in_newton_metres():
    case = make_case()
    bare = {f"robots.panda.links.link{i}.effort": None for i in range(1, 8)}
    found = rs.diagnose(case.at(bare).with_(duration=0.1).run())
    assert plot.diagnosis(found).axes[4].get_ylabel() == "torque (N m)"
