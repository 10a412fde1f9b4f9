"""Bags of the topics of nodes: arrays of marks, odometry and poses, and recordings that ended."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from bagging import NANO, check_refusal, state, write_bag

import robsim as rs
from robsim.logs import bag_journal, message_types
from robsim.logs.bag_files import Bag
from robsim.logs.bag_journal import BagJournal
from robsim.logs.command_messages import make_header
from robsim.logs.mark_arrays import list_marks, make_mark_array
from robsim.logs.message_types import make_message
from robsim.logs.scene_messages import make_pose

COMMANDS, TWISTS = "/forward_velocity_controller/commands", "/cmd_vel"


def pose_message(pose, t, frame, kind=message_types.ODOMETRY):
    """An Odometry or PoseStamped of a pose (7,) in the world."""
    header = make_header(make_message, round(t * NANO), "world")
    place = make_pose(make_message, pose)
    if kind == message_types.POSE:
        return make_message(kind, header=header, pose=place)
    zero = {name: make_message("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0) for name in "ab"}
    twist = make_message("geometry_msgs/msg/Twist", linear=zero["a"], angular=zero["b"])
    sure = np.zeros(36)
    both = {
        "pose": make_message("geometry_msgs/msg/PoseWithCovariance", pose=place, covariance=sure),
        "twist": make_message(
            "geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=sure
        ),
    }
    return make_message(kind, header=header, child_frame_id=frame, **both)


def marks_of(run, i, t):
    """The array of marks of an instant, those that are seen."""
    names, counts = [], {}
    for target in run.mark_target.values:
        counts[target] = counts.get(target, -1) + 1
        names.append(f"{target}.{counts[target]}")
    pixels = run.pixels.values[i]
    seen = np.isfinite(pixels).all(axis=1)
    ids = [name for name, there in zip(names, seen, strict=True) if there]
    return make_mark_array(make_message, round(t * NANO), ids, pixels[seen])


def played(run, experiment, start=5.0):
    """The messages of a played arm: arrays of marks, joints, and commands as arrays."""
    ros = rs.control.RosMessages(rs.Controller(experiment))
    (camera,) = ros.controller.cameras
    for i, t in enumerate(start + run.time.values):
        at = round(t * NANO)
        yield f"/{camera}/detections", message_types.NUMBERS, at, marks_of(run, i, t)
        joints = state(run.q.values[i], run.coordinate.values.tolist(), t)
        yield "/joint_states", message_types.JOINTS, at, joints
        yield COMMANDS, message_types.NUMBERS, at, ros.command(run.qd.values[i])


def test_marks_of_an_array_keep_their_names_pixels_and_time():
    """The data start with seconds and nanoseconds, which a float holds exactly."""
    pixels = np.array([[1.5, 2.25], [639.875, 0.0]])
    time = 1_790_000_000 * NANO + 123_456_789
    message = make_mark_array(make_message, time, ["a", "b"], pixels)
    assert message.data.tolist() == [1_790_000_000, 123_456_789, 1.5, 2.25, 639.875, 0.0]
    assert message.layout.data_offset == 2
    assert list(list_marks(message)) == [("a", (1.5, 2.25)), ("b", (639.875, 0.0))]
    assert message_types.header_time(message) == time
    message.data = message.data[:-1]
    with pytest.raises(rs.errors.InputError, match="an array of 2 marks has 3 numbers of pixels"):
        list(list_marks(message))


def test_a_bag_of_arrays_is_the_run(run, rhino, tmp_path):
    path = write_bag(tmp_path / "bag", played(run, rhino))
    read = rs.logs.read_bag(path, rhino)
    np.testing.assert_array_equal(read.pixels, run.pixels)
    np.testing.assert_array_equal(read.q, run.q)
    np.testing.assert_array_equal(read.qd, run.qd)
    np.testing.assert_allclose(read.time, run.time, atol=1e-9)


def test_topics_and_names_of_a_bag_are_those_of_the_connection(run, rhino, tmp_path):
    """The joints of the bag have other names, and its commands another order."""
    names = {name: f"arm_{name}" for name in run.coordinate.values}
    told = rs.control.RosConnection(
        joints="/arm/joint_states",
        marks="/eyes/CAMERA/tags",
        commands="/arm/commands",
        names=names,
        ids={"cube": ["d", "c", "b", "a"]},
        order=[names[name] for name in run.velocity.values[::-1]],
    )
    cell = rhino.with_(ros2=told)
    topics = {COMMANDS: "/arm/commands", "/camera/detections": "/eyes/camera/tags"}
    content = []
    for topic, kind, at, each in played(run, rhino):
        if topic == COMMANDS:
            each.data = each.data[::-1].copy()
        elif kind == message_types.NUMBERS:
            for dim, name in zip(each.layout.dim, "dcba", strict=True):
                dim.label = name
        else:
            each.name = [names[name] for name in each.name]
        content.append((topics.get(topic, "/arm/joint_states"), kind, at, each))
    read = rs.logs.read_bag(write_bag(tmp_path / "bag", content), cell)
    for name in ("pixels", "q", "qd"):
        np.testing.assert_array_equal(read[name], run[name])


@pytest.mark.parametrize(
    ("topic", "kind"),
    [("/odom", message_types.ODOMETRY), ("/robsim/poses/unicycle/body", message_types.POSE)],
)
def test_a_base_moves_by_its_odometry_or_its_poses(topic, kind, tmp_path):
    cell = rs.load_scenario(rs.examples.path("unicycle_docking")).with_(
        duration=1.0, ros2=rs.control.RosConnection(commands=TWISTS)
    )
    run, ros = cell.run(), rs.control.RosMessages(rs.Controller(cell))
    (camera,), content, answers = ros.controller.cameras, [], []
    for i, t in enumerate(5.0 + run.time.values):
        at = round(t * NANO)
        content.append((f"/{camera}/detections", message_types.NUMBERS, at, marks_of(run, i, t)))
        pose = rs.Pose(cell.scene.pose("unicycle.body", run.q.values[i]).matrix).q
        message = pose_message(pose, t, "base_link", kind)
        answers.append(ros.pose(message))
        content.append((topic, kind, at, message))
        twist = ros.command(run.qd.values[i], message_types.TWIST)
        content.append((TWISTS, message_types.TWIST, at, twist))
    np.testing.assert_allclose(answers, run.q, atol=1e-12)
    read = rs.logs.read_bag(write_bag(tmp_path / "bag", content), cell)
    np.testing.assert_allclose(read.q, run.q, atol=1e-12)
    np.testing.assert_array_equal(read.qd, run.qd)
    np.testing.assert_array_equal(read.pixels, run.pixels)


def test_explain_of_a_bag_names_the_fault(rhino, called, tmp_path, monkeypatch):
    """The robot of the bag has 0.8 times the gain; the scenario is the believed cell."""
    monkeypatch.chdir(tmp_path)
    patient = rhino.at("task.gain", 0.8 * rhino.task.gain).with_(duration=3.0)
    write_bag(tmp_path / "monday", played(patient.run(), patient))
    (tmp_path / "cell.toml").write_text(rhino.to_toml(), encoding="utf-8")
    status, out, err = called("explain", "monday", "cell.toml", "--no-trials")
    assert (status, err) == (0, "") and "commands are 0.8" in " ".join(out.split())
    status, _, err = called("explain", "monday")
    assert status and "it has no /robsim/experiment: give the experiment" in err


def record(path, content):
    """A journal with some messages."""
    store, journal = message_types.load_typestore(), BagJournal(path)
    for topic, kind, at, each in content:
        journal.write(topic, kind, at, store.serialize_cdr(each, kind))
    return journal


@pytest.mark.parametrize("name", ["run.mcap", "run.db3", "run"])
def test_a_journal_becomes_the_bag(name, run, rhino, tmp_path):
    journal = record(tmp_path / "new" / name, played(run, rhino))
    assert journal.part.name == f"{name}.part1" and not journal.path.exists()
    journal.complete()
    assert [each.name for each in journal.path.parent.iterdir()] == [name]
    np.testing.assert_array_equal(rs.logs.read_bag(journal.path, rhino).qd, run.qd)


def test_a_killed_recording_is_read_up_to_its_last_second(run, rhino, tmp_path):
    """It is the process that ends, without a chance to complete the bag."""
    source = write_bag(tmp_path / "source", played(run, rhino))
    script = f"""
import os, signal, sys
from robsim.logs import bag_journal
from bagging import read_messages
from test_bags_recorded import record
bag_journal.SAVE_PERIOD = 0.0
record(bag_journal.Path("monday.mcap"), read_messages(bag_journal.Path({str(source)!r})))
os.kill(os.getpid(), signal.SIGKILL)
"""
    paths = os.pathsep.join([os.path.dirname(__file__), *sys.path])
    env = {**os.environ, "PYTHONPATH": paths}
    killed = [sys.executable, "-c", script]
    done = subprocess.run(killed, cwd=tmp_path, env=env, timeout=300, check=False)
    assert done.returncode == -signal.SIGKILL
    assert not (tmp_path / "monday.mcap").exists()
    read = rs.logs.read_bag(tmp_path / "monday.mcap.part1", rhino)
    np.testing.assert_array_equal(read.qd, run.qd)


def test_messages_are_saved_each_second(run, rhino, tmp_path, monkeypatch):
    """Another process sees the messages up to the last second."""
    clock = [10.0]
    monkeypatch.setattr(bag_journal.time, "monotonic", lambda: clock[0])
    journal, store = BagJournal(tmp_path / "run.mcap"), message_types.load_typestore()
    for number, (_, kind, at, each) in enumerate(list(played(run, rhino))[1:20:3]):
        clock[0] += 0.4
        journal.write("/joint_states", kind, at, store.serialize_cdr(each, kind))
        if number < 2:
            check_refusal(journal.part, "the bag is empty", rhino)
        else:
            with Bag(journal.part) as bag:
                assert len(list(bag.messages("/joint_states"))) == 3 * ((number + 1) // 3)
    journal.complete()


def test_recordings_overwrite_no_other(run, rhino, tmp_path):
    """A restart after a kill leaves the earlier recording; a folder is never overwritten."""
    content = list(played(run, rhino))[:3]
    first, second = (record(tmp_path / "run.mcap", content) for _ in range(2))
    assert [each.part.name for each in (first, second)] == ["run.mcap.part1", "run.mcap.part2"]
    second.complete()
    assert first.part.exists() and second.path.exists()
    first.complete()
    empty = BagJournal(tmp_path / "empty.mcap")
    empty.complete()
    assert [each.name for each in tmp_path.iterdir()] == ["run.mcap"]
    (tmp_path / "folder").mkdir()
    with pytest.raises(rs.errors.FileError, match="folder exists already; a bag needs a new"):
        BagJournal(tmp_path / "folder")
