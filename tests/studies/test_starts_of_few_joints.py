"""Starts of robots that do not reach every pose: bounds, variety, bits, speed and messages."""

import re
import time
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.starts.start_kinematics import StartKinematics
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.row_simulator import RowSimulator
from robsim.studies.study_plan import make_plan

MARKS = [[-0.06, -0.05, 0.0], [0.06, -0.05, 0.0], [0.05, 0.05, 0.0], [-0.06, 0.06, 0.0]]
FEW = {
    "rhino_xr4": "tool",
    "scara": None,
    "gantry": None,
    "planar_3r": None,
    "planar_2r": None,
    "unicycle": "camera_mount",
    "car": "camera_mount",
    "differential_drive": "camera_mount",
    "holonomic_base": "camera_mount",
}
LOOK = rs.starts.LookAt("plate", distance=(0.42, 0.78))


def experiment_with(model, link=None):
    """Return an experiment with a plate 0.6 m in front of a camera on a robot at home."""
    robot = rs.robots.load(model)
    link = link or robot.tip
    T_w_c = rs.Pose(robot.fk(robot.home, link=link))
    plate = rs.Object("plate", marks=MARKS, pose=T_w_c @ rs.Pose.at(0, 0, 0.6))
    camera = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
    eye = rs.MountedCamera("eye", camera, on=f"{robot.name}.{link}")
    return rs.Experiment(rs.Scene([robot], [plate], [eye]), rs.IBVS())


def accepted(experiment, start, draws=24):
    """Return the accepted starts (n, nq) of some draws."""
    rows = RowSimulator(make_plan(experiment, draws, 0, start), 1)
    q, _, fits = rows.starts(np.arange(draws))
    return q[fits]


@pytest.fixture(scope="module")
def chapter():
    return rs.load_scenario(rs.examples.path("chapter_6_1"))


@pytest.mark.full
@pytest.mark.parametrize(("model", "link"), FEW.items())
def test_a_robot_with_few_joints_has_starts_of_every_sampler(model, link):
    """Every draw is accepted; distances, angles and offsets are within their bounds."""
    experiment = experiment_with(model, link)
    eye, goal = experiment.scene, experiment.scene.pose("eye")
    middle = eye.pose("plate") @ np.mean(MARKS, axis=0)

    T = eye.pose("eye", accepted(experiment, LOOK))
    assert len(T.position) == 24
    distance = np.linalg.norm(T.position - middle, axis=1)
    assert distance.min() > 0.42 - 1e-6 and distance.max() < 0.78 + 1e-6
    towards = (middle - T.position) / distance[:, None]
    level = 0.02 if link == "camera_mount" else 3e-6  # a level camera does not tilt
    assert np.linalg.norm(np.cross(T.rotation[:, :, 2], towards), axis=1).max() < level
    axis = (goal.position - middle) / np.linalg.norm(goal.position - middle)
    assert (towards @ -axis > np.cos(np.pi / 4) - 1e-9).all()

    T = goal.inv() @ eye.pose("eye", accepted(experiment, rs.starts.Shell((0.05, 0.15), (0, 0.3))))
    distance, angle = (np.linalg.norm(x, axis=1) for x in (T.position, T.rotvec))
    assert len(distance) == 24 and distance.min() > 0.05 - 1e-6 and distance.max() < 0.15 + 1e-6
    assert angle.max() < 0.3 + 1e-6 and np.ptp(distance) > 0.05

    T = goal.inv() @ eye.pose("eye", accepted(experiment, rs.starts.Within(0.1)))
    assert len(T.position) == 24 and np.linalg.norm(T.position, axis=1).max() < 0.1 + 1e-6
    assert np.linalg.norm(T.rotvec, axis=1).max() < 1e-5

    box = rs.starts.About(position=[0.1, 0.1, 0.1], rpy=[0.1, 0.1, 0.5])
    T = goal.inv() @ eye.pose("eye", accepted(experiment, box))
    assert len(T.position) == 24 and np.abs(T.position).max() < 0.1 + 1e-6
    rpy = np.array([rs.Pose(each).rpy for each in T.matrix])
    assert (np.abs(rpy).max(axis=0) < np.array([0.1, 0.1, 0.5]) + 1e-6).all()


def test_the_rhino_of_the_chapter_looks_from_drawn_distances(chapter):
    """The five joints keep the optical axis and the drawn distance; roll and direction vary."""
    look = rs.starts.LookAt("cube", distance=(0.15, 0.4))
    reach = StartKinematics(chapter.loop().controller)
    draws = RandomNumbers(3, "start", np.arange(300))
    q, fits = look.coordinates(reach, draws)
    assert fits.mean() > 0.95
    T, drawn = chapter.scene.pose("camera", q[fits]), look.poses(reach, draws.uniform(7))[fits]
    offset, wanted = T.position - reach.middle("cube"), drawn[:, :3, 3] - reach.middle("cube")
    distance = np.linalg.norm(offset, axis=1)
    np.testing.assert_allclose(distance, np.linalg.norm(wanted, axis=1), rtol=1e-6)
    np.testing.assert_allclose(-offset / distance[:, None], T.rotation[:, :, 2], atol=1e-6)
    assert np.std(q[fits], axis=0).min() > 0.05
    assert len(accepted(chapter, look)) == 24


def test_a_pan_tilt_head_looks_from_where_it_is():
    """Two joints whose axes cross at the camera change no distance, and still look aside."""
    experiment = experiment_with("pan_tilt")
    look = rs.starts.LookAt("plate", distance=(0.5, 0.7), aside=0.05)
    q = accepted(experiment, look)
    assert len(q) == 24 and 0.02 < np.abs(q).max() < 0.2


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
@pytest.mark.parametrize("model", ["rhino_xr4", "planar_3r", "unicycle"])
def test_a_start_has_the_same_bits_in_every_batch(model):
    experiment = experiment_with(model, FEW[model])
    reach = StartKinematics(experiment.loop().controller)
    for sampler in (LOOK, rs.starts.Within(0.1, 0.2), rs.starts.About([0.1] * 3, [0.1] * 3)):
        for attempt in (0, 1):
            q, fits = sampler.coordinates(reach, RandomNumbers(1, "s", np.arange(40), attempt))
            for some in (np.array([17]), np.array([30, 2, 9])):
                again = sampler.coordinates(reach, RandomNumbers(1, "s", some, attempt))
                np.testing.assert_array_equal(again[0], q[some])
                np.testing.assert_array_equal(again[1], fits[some])


def test_an_arm_on_another_robot_looks_from_drawn_distances():
    """The base of the arm is where the vehicle carries it at home; before, it was the origin."""
    vehicle = replace(rs.robots.load("holonomic_base"), home=[0.5, 0.2, 0.4])
    arm = rs.robots.load("puma560").at(rs.Pose.at(0.1, 0, 0.3), on="holonomic_base.body")
    tip = f"puma560.{arm.tip}"
    place = rs.Scene([vehicle, arm]).pose(tip) @ rs.Pose.at(0, 0, 0.5)
    plate = rs.Object("plate", marks=MARKS, pose=place)
    camera = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
    scene = rs.Scene([vehicle, arm], [plate], [rs.MountedCamera("eye", camera, on=tip)])
    q = accepted(rs.Experiment(scene, rs.IBVS(joints="puma560")), LOOK)
    distance = np.linalg.norm(
        scene.pose("eye", q).position - place @ np.mean(MARKS, axis=0), axis=1
    )
    assert len(q) == 24 and distance.min() > 0.42 - 1e-6 and distance.max() < 0.78 + 1e-6


def test_arms_with_six_motions_keep_their_draws():
    """The bits of inverse kinematics: the same coordinates as a solution of the sampled poses."""
    for model in ("puma560", "panda"):
        reach = StartKinematics(experiment_with(model).loop().controller)
        draws = RandomNumbers(1, "start", np.arange(20))
        assert reach.reaches_every_pose
        q, fits = LOOK.coordinates(reach, draws)
        expected = reach.coordinates(LOOK.poses(reach, draws.uniform(7)))
        np.testing.assert_array_equal(q, expected[0])
        np.testing.assert_array_equal(fits, expected[1])


def test_a_start_takes_milliseconds(chapter):
    reach = StartKinematics(chapter.loop().controller)
    look = rs.starts.LookAt("cube", distance=(0.15, 0.4))
    look.coordinates(reach, RandomNumbers(0, "start", np.arange(2)))
    began = time.process_time()
    look.coordinates(reach, RandomNumbers(0, "start", np.arange(200)))
    assert time.process_time() - began < 200 * 3e-3


def test_a_study_and_viewpoints_of_the_rhino_run(chapter):
    look = rs.starts.LookAt("cube", distance=(0.15, 0.4))
    study = rs.study(chapter.with_(duration=0.2), 20, start=look, seed=1)
    assert study.table["began"].all()
    assert rs.calibration.sample_viewpoints(chapter, 5, look).shape == (5, 5)


FAILURES = {
    "of 200 samples, 0 are within reach of the 2 joints that move 'eye' (the distance of the "
    "nearest poses is 0.6 m, not 1 to 2 m); try another distance": (
        "pan_tilt",
        rs.starts.LookAt("plate", distance=(1, 2)),
    ),
    "0 are within reach of the 5 joints that move 'eye' (the distance of": (
        "rhino_xr4",
        rs.starts.LookAt("plate", distance=(5, 6)),
    ),
    "0 are within reach of the 3 coordinates that move 'eye' (the roll of the nearest poses is 0 "
    "degrees, not 57.3 to 68.8 degrees)": (
        "holonomic_base",
        rs.starts.LookAt("plate", distance=(0.5, 1), roll=(1, 1.2)),
    ),
    "of 200 samples, 0 see their target; try low and high around coordinates": (
        "planar_2r",
        rs.samplers.Uniform(0, 0.1),
    ),
    "of 200 samples, 0 are within the joint limits; try low and high": (
        "planar_2r",
        rs.samplers.Uniform(-100, -99),
    ),
}


@pytest.mark.parametrize("reason", FAILURES)
@pytest.mark.few(1)
def test_a_message_names_the_bound_that_the_joints_violate(reason):
    model, start = FAILURES[reason]
    experiment = experiment_with(model, FEW.get(model))
    with pytest.raises(rs.errors.InputError, match=re.escape(reason)):
        rs.study(experiment, 4, start=start)


@pytest.mark.full
def test_samples_for_a_message_may_outnumber_the_given_values():
    start = rs.starts.Shell((5, 6), about=rs.Pose.at(50, 0, 0))
    vary = {"task.gain": rs.samplers.TabulatedValues([1.0, 2.0, 3.0])}
    with pytest.raises(rs.errors.InputError, match="200 samples, 200 are within reach"):
        rs.study(experiment_with("free_camera"), 3, start=start, vary=vary)


def test_a_study_with_one_start_only_is_refused():
    with pytest.raises(rs.errors.InputError, match="the 2 joints that move 'eye' leave one start"):
        rs.study(experiment_with("pan_tilt"), 4, start=LOOK)


def test_coordinates_outside_the_limits_are_sampled_again():
    """Half of the coordinates are beyond the limit of half a turn; no run begins there."""
    experiment = experiment_with("planar_2r").with_(duration=0.2)
    home = experiment.scene.home
    start = rs.starts.Anywhere(low=home - 0.05, high=[home[0] + 0.05, 4.0])
    study = rs.study(experiment, 6, start=start, seed=2)
    assert study.table["began"].all() and (study.table["start_tries"] > 1).any()


BLIND = {
    "chapter_6_1": [1.5, -1.6, 1.6, 0.0, -1.5],
    "unicycle_docking": [0.0, 0.0, 1.6],
    "local_minimum": [0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0],
}


@pytest.mark.parametrize(("name", "q"), BLIND.items())
def test_check_offers_a_start_that_sees_the_target(name, q, tmp_path):
    from click.testing import CliRunner

    from robsim.cli.commands import cli

    experiment = rs.load_scenario(rs.examples.path(name)).with_(start=q)
    file = tmp_path / "blind.toml"
    file.write_text(experiment.text, encoding="utf-8")
    result = CliRunner().invoke(cli, ["check", str(file)])
    text = str(result.output) + str(result.exception or "")
    assert result.exit_code and "does not see marks" in text
    _, offer = text.split("; a start that sees it:\n\n")
    table = offer[: offer.index("]\n", 8) + 1] if "]\n" in offer[8:] else offer
    old = experiment.text.split("\n[start]\n")[1].partition("\n\n")[0]
    new = experiment.text.replace(old, table.removeprefix("[start]\n"))
    file.write_text(new, encoding="utf-8")
    assert CliRunner().invoke(cli, ["check", str(file)]).exit_code == 0
