"""Bodies that drive or fly; only the topic /tf of the bag has their poses."""

import numpy as np
import pytest
from bagging import NANO, check_refusal, read_messages, transform, write_bag

import robsim as rs
from robsim.logs import message_types
from robsim.logs.message_types import make_message

PLACE = [f"body.{part}" for part in ("x", "y", "z", "theta", "qx", "qy", "qz", "qw")]
ROAMING = ("visp_tutorial", "unicycle_docking", "differential_drive", "holonomic", "car")


def experiment(name):
    return rs.load_scenario(rs.examples.path(name))


def without_joints(run, tmp_path, change=lambda each: each):
    """The bag of a run without the poses of its bodies in JointState messages."""

    def kept():
        for topic, kind, time, each in read_messages(rs.logs.write_bag(run, tmp_path / "whole")):
            if topic == "/joint_states":
                own = [i for i, name in enumerate(each.name) if name not in PLACE]
                each.name = [each.name[i] for i in own]
                each.position, each.velocity = each.position[own], np.empty(0)
                if not own:
                    continue
            if topic == "/tf":
                each.transforms = change(each.transforms)
            yield topic, kind, time, each

    return write_bag(tmp_path / "bag", kept())


@pytest.mark.parametrize("name", ROAMING)
def test_the_frames_that_we_write_have_the_poses_of_bodies(name, tmp_path):
    """Also for a car with joints for its steering and wheels."""
    run = experiment(name).run(duration=0.4)
    again = rs.logs.read_bag(without_joints(run, tmp_path))
    np.testing.assert_allclose(again.q, run.q, atol=1e-14)
    np.testing.assert_array_equal(again.qd, run.qd)
    np.testing.assert_array_equal(again.pixels, run.pixels)


def test_a_heading_goes_on_beyond_half_a_turn(tmp_path):
    run = experiment("unicycle_docking").run(duration=0.4)
    turned = run.copy(deep=True)
    turned.q.values[:, 2] = np.linspace(3.0, 3.6, len(run.time))
    again = rs.logs.read_bag(without_joints(turned, tmp_path))
    np.testing.assert_allclose(again.q, turned.q, atol=1e-14)


def chained(run, tmp_path, backwards=False):
    """A bag with a camera on a base, the base in odom, and odom in a map, which corrects."""
    rng = np.random.default_rng(1)
    mount, fixes = rs.Pose.exp(rng.normal(size=6)), rs.Pose.exp(0.1 * rng.normal(size=(50, 6)))

    def frames(t, i):
        fix = fixes[i // 5]  # published at every fifth instant, dated ahead as a localiser does
        cam = rs.Pose(run.camera_pose.values[i])
        base = fix.inv() @ cam @ mount.inv()
        if i % 5 == 0:
            yield transform("map", "odom", fix.q, t + 0.5)
        yield transform("odom", "base_link", base.q, t - 0.1 * (backwards and i == 7))

    def kept():
        still = make_message(
            message_types.FRAMES, transforms=[transform("base_link", "cam", mount.q)]
        )
        yield "/tf_static", message_types.FRAMES, 0, still
        for topic, kind, time, each in read_messages(rs.logs.write_bag(run, tmp_path / "whole")):
            if topic == "/tf":
                i = round(time / NANO / run.attrs["dt"])
                each.transforms = list(frames(time / NANO, i))
            if topic not in ("/joint_states", "/tf_static"):
                yield topic, kind, time, each

    return write_bag(tmp_path / "bag", kept())


def test_frames_are_chained_and_have_names_of_their_own(tmp_path):
    run = experiment("visp_tutorial").run(duration=0.8)
    path = chained(run, tmp_path)
    again = rs.logs.read_bag(path, frames={"world": "map", "free_camera.body": "/cam"})
    signs = np.sign((again.q.values * run.q.values)[:, 3:].sum(axis=1))[:, None]
    np.testing.assert_allclose(again.q.values[:, :3], run.q.values[:, :3], atol=1e-13)
    np.testing.assert_allclose(again.q.values[:, 3:] * signs, run.q.values[:, 3:], atol=1e-13)


def test_frames_that_are_not_there(tmp_path):
    path = chained(experiment("visp_tutorial").run(duration=0.4), tmp_path)
    check_refusal(
        path, r"no position of joint body.x; give .* frames={'free_camera.body': ..., 'world'"
    )
    check_refusal(path, "frames: cam, odom, base_link", frames={"world": "earth"})
    for frames, words in (
        ({"free_camera.bod": "cam"}, "no 'free_camera.bod' that drives or flies; did you mean"),
        ({"world": 3}, "frames: expected"),
        (3, "frames: expected"),
    ):
        with pytest.raises(rs.errors.InputError, match=words):
            rs.logs.read_bag(path, frames=frames)


def test_a_clock_of_frames_that_goes_backwards(tmp_path):
    path = chained(experiment("visp_tutorial").run(duration=0.8), tmp_path, backwards=True)
    named = {"frames": {"world": "map", "free_camera.body": "cam"}}
    check_refusal(path, "/tf: the clock goes backwards, to 0.18 s after 0.24 s", **named)
    assert rs.logs.read_bag(path, clock="log", **named).sizes["time"] == 21


ODD = {
    "no length": ([0, 0, 0, 0, 0, 0, 0], "quaternion .* must have length 1"),
    "nan": ([np.nan, 0, 0, 0, 0, 0, 1], "nan"),
    "tilted": ([0, 0, 0, np.sin(0.25), 0, 0, np.cos(0.25)], "'unicycle.body' is tilted by 28.6"),
}


@pytest.mark.parametrize("case", ODD)
def test_transforms_that_are_no_pose(case, tmp_path):
    pose, words = ODD[case]
    run = experiment("unicycle_docking").run(duration=0.4)

    def odd(transforms):
        return [transform("world", each.child_frame_id, pose) for each in transforms]

    check_refusal(without_joints(run, tmp_path, odd), f"topic /tf: .*{words}")


def test_a_circle_of_frames_leads_nowhere(tmp_path):
    run = experiment("unicycle_docking").run(duration=0.4)
    rest = [0, 0, 0, 0, 0, 0, 1]

    def round_about(transforms):
        return [transform("a", "unicycle.body", rest), transform("unicycle.body", "a", rest)]

    check_refusal(without_joints(run, tmp_path, round_about), "no position of joint body.x")
