"""The controller of an experiment pulled by hand, and its instants one by one."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest

import robsim as rs
from robsim import examples

NAMES = [
    "visp_tutorial",
    "eye_in_hand",
    "stereo_in_hand",
    "uneven_depth",
    "smooth_start",
    "marks_come_and_go",
]


def experiment(name):
    return rs.load_scenario(examples.path(name))


def get_pixels(run, t):
    """The pixels of one step, camera by camera and target by target."""
    pairs = list(zip(run.mark_camera.values, run.mark_target.values, strict=True))
    return {
        key: run.pixels.values[t][[i for i, pair in enumerate(pairs) if pair == key]]
        for key in dict.fromkeys(pairs)
    }


@pytest.mark.parametrize("name", NAMES)
def test_its_commands_equal_those_of_the_loop_to_the_bit(name):
    made = experiment(name).with_(sensing=rs.Sensing(), actuation=rs.Actuation(), duration=0.8)
    run, controller = made.run(), rs.Controller(made)
    columns = [list(run.velocity.values).index(n) for n in controller.velocity_names]
    for t in range(int(np.isfinite(run.error_norm.values).sum())):
        command = controller.step(get_pixels(run, t), run.q.values[t], t * made.dt)
        np.testing.assert_array_equal(command.velocities, run.qd.values[t, columns])


def test_the_memory_of_a_scheme_lasts_until_a_reset():
    made = experiment("visp_tutorial").at("task.interaction", "broyden").with_(duration=0.4)
    run, controller = made.run(), rs.Controller(made)
    for _ in range(2):
        controller.reset()
        for t in range(10):
            command = controller.step(run.pixels.values[t], run.q.values[t], t * made.dt)
            np.testing.assert_array_equal(command.velocities, run.qd.values[t])


def test_a_mark_that_is_not_seen_now_is_left_out():
    """Of four points three are enough: the command still takes the camera down the error."""
    made = experiment("visp_tutorial")
    run, controller = made.run(duration=0.4), rs.Controller(made)
    controller.step(run.pixels.values[0], run.q.values[0], 0.0)
    pixels = run.pixels.values[1].copy()
    pixels[2] = np.nan
    command = controller.step(pixels, run.q.values[1], made.dt)
    hidden = command.velocities
    assert command.health.lost == ("square[2]",) and command.phase == "moving"
    assert np.isfinite(hidden).all() and not np.array_equal(hidden, run.qd.values[1])
    three = rs.features.FeatureBlock("points", marks=[0, 1, 3])
    other = rs.Controller(made.at("task.features", three))
    np.testing.assert_allclose(
        hidden, other.step(run.pixels.values[1], run.q.values[1], 0.0).velocities, atol=1e-12
    )


@pytest.mark.parametrize(
    ("pixels", "q", "t", "words"),
    [
        (np.zeros((3, 2)), None, 0.0, "pixels of"),
        (None, np.zeros(3), 0.0, "q"),
        (None, None, np.nan, "t"),
        ({"no such": np.zeros((4, 2))}, None, 0.0, "none of camera"),
        ({4: (1.0, 2.0)}, None, 0.0, "no mark 4"),
        ("text", None, 0.0, "pixels of"),
    ],
)
def test_an_unsuitable_start_is_refused(pixels, q, t, words):
    made = experiment("visp_tutorial")
    pixels = np.zeros((4, 2)) if pixels is None else pixels
    q = made.scene.home if q is None else q
    with pytest.raises(rs.errors.InputError, match=words):
        rs.Controller(made).step(pixels, q, t)


def test_a_mission_has_no_one_controller_and_no_one_run():
    mission = experiment("inspection_a")
    with pytest.raises(rs.errors.InputError, match="mission"):
        rs.Controller(mission)
    with pytest.raises(rs.errors.InputError, match="mission"):
        mission.steps()
    with pytest.raises(rs.errors.InputError, match="expected an Experiment"):
        rs.Controller(mission.scene)


def test_instants_agree_with_the_run_to_the_bit():
    made = experiment("latency_and_gain").with_(duration=1.0)
    run, instants = made.run(), list(made.steps())
    assert len(instants) == np.isfinite(run.error_norm.values).sum()
    for name in ("q", "qd", "s", "error", "pixels"):
        each = np.array([getattr(now, name) for now in instants])
        np.testing.assert_array_equal(each, run[name].values[: len(each)])
    assert instants[-1].outcome == int(run.outcome)
    assert {now.outcome for now in instants[:-1]} <= {rs.Outcome.RUNNING}
    np.testing.assert_array_equal([now.time for now in instants], run.time.values[: len(instants)])


def test_steps_are_of_one_start():
    made = experiment("visp_tutorial")
    with pytest.raises(rs.errors.InputError, match="one start"):
        made.with_(start=np.repeat(made.start[None], 2, axis=0)).steps()


@pytest.mark.full  # as another process is started
def test_an_experiment_that_has_run_goes_to_another_process_and_runs_there(tmp_path):
    """Machine code is not sent: its addresses are invalid in another process."""
    made = experiment("visp_tutorial").with_(duration=0.4)
    expected = made.run().q_end.values
    made.scene.robots[0].fk(made.scene.robots[0].home)
    (tmp_path / "made").write_bytes(pickle.dumps(made))
    code = "import pickle, sys; made = pickle.load(open(sys.argv[1], 'rb'))\n"
    code += "pickle.dump(made.run().q_end.values, open(sys.argv[2], 'wb'))"
    files = [str(tmp_path / name) for name in ("made", "end")]
    subprocess.run([sys.executable, "-c", code, *files], check=True, capture_output=True)
    end = pickle.loads((tmp_path / "end").read_bytes())
    np.testing.assert_array_equal(end, expected)
    np.testing.assert_array_equal(copy.deepcopy(made).run().q_end.values, expected)
