"""Bags: other readers read our bags, and we read the bags of others."""

import re
import runpy
import shutil
import struct
from pathlib import Path

import mcap.reader
import numpy as np
import pytest
from bagging import NANO, change_topic, remake, write_bag
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Writer

import robsim as rs
from robsim.logs import message_types
from robsim.logs.command_messages import make_header as stamped
from robsim.logs.message_types import make_message

ROOT = Path(__file__).parents[2]
EXAMPLES = ("visp_tutorial", "chapter_6_1", "stereo_in_hand", "watching_head", "joint_lag")


def every(path, topic):
    """The messages of a topic as rosbags reads them: [(time, message)]."""
    with AnyReader([Path(path)]) as reader:
        some = [each for each in reader.connections if each.topic == topic]
        return [(t, reader.deserialize(data, c.msgtype)) for c, t, data in reader.messages(some)]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_rosbags_reads_every_value(run, rhino, storage, tmp_path):
    path = rs.logs.write_bag(run, tmp_path / "bag", storage=storage, start=1.7e9)
    assert sorted(p.suffix for p in path.iterdir()) == [
        {"mcap": ".mcap", "sqlite3": ".db3"}[storage],
        ".yaml",
    ]
    times = int(1.7e9) * NANO + np.round(run.time.values * NANO).astype(int)
    states, commands = every(path, "/joint_states"), every(path, "/joint_commands")
    assert [t for t, _ in states] == times.tolist()
    assert [m.header.stamp.sec * NANO + m.header.stamp.nanosec for _, m in states] == times.tolist()
    assert {tuple(m.name) for _, m in states} == {rhino.scene.coordinate_names}
    np.testing.assert_array_equal([m.position for _, m in states], run.q)
    np.testing.assert_array_equal([m.velocity for _, m in commands], run.qd)
    assert not any(len(m.effort) for _, m in states)
    seen = every(path, "/camera/detections")
    assert [d.id for d in seen[0][1].detections] == [f"cube.{i}" for i in range(run.sizes["mark"])]
    pixels = [
        [(d.bbox.center.position.x, d.bbox.center.position.y) for d in m.detections]
        for _, m in seen
    ]
    np.testing.assert_array_equal(pixels, run.pixels)
    lens = rhino.scene.camera().camera
    for _, info in every(path, "/camera/camera_info"):
        assert (info.width, info.height) == lens.size and info.distortion_model == "plumb_bob"
        np.testing.assert_array_equal(info.k, np.ravel(lens.K))


def test_frames_of_the_scene_are_transforms(bag, run, rhino):
    def pose(each):
        T = each.transform
        q = [getattr(T.rotation, name) for name in "xyzw"]
        at = [getattr(T.translation, name) for name in "xyz"]
        return rs.Pose.from_quaternion(at, q).matrix

    ((_, still),) = every(bag, "/tf_static")
    moving = every(bag, "/tf")
    names = {each.child_frame_id for each in (*still.transforms, *moving[0][1].transforms)}
    assert {"camera", "cube", "rhino_xr4.base"} <= names
    assert {each.header.frame_id for each in still.transforms} == {"world"}
    for i in (0, 7, 25):
        for each in (*still.transforms, *moving[i][1].transforms):
            expected = rhino.scene.pose(each.child_frame_id, run.q.values[i]).matrix
            np.testing.assert_allclose(pose(each), expected, atol=1e-15)


def joint_state(data):
    """Time, names and positions of a JointState by the rules of CDR, without any library."""
    assert data[:4] == b"\0\1\0\0"
    body, at = data[4:], 0

    def take(kind):
        nonlocal at
        size = struct.calcsize(kind)
        at += -at % size
        (value,) = struct.unpack_from("<" + kind, body, at)
        at += size
        return value

    def text():
        nonlocal at
        count = take("I")
        at += count
        return body[at - count : at - 1].decode()

    time = take("i") * NANO + take("I")
    text()
    names = [text() for _ in range(take("I"))]
    return time, names, [take("d") for _ in range(take("I"))]


def test_the_reader_of_mcap_finds_the_same_bytes(bag, run):
    with open(bag, "rb") as file:
        found = [
            (message.log_time, *joint_state(message.data))
            for _, _, message in mcap.reader.make_reader(file).iter_messages(["/joint_states"])
        ]
    assert [each[0] for each in found] == [each[1] for each in found]
    np.testing.assert_array_equal([each[3] for each in found], run.q)


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("where", ["bag", "bag.mcap", "bag.db3"])
def test_there_and_back_is_the_same_to_the_bit(name, where, tmp_path):
    run = rs.load_scenario(rs.examples.path(name)).run(duration=1.2)
    again = rs.logs.read_bag(rs.logs.write_bag(run, tmp_path / where, start=1.7e9))
    for each in set(run.data_vars) - {"path_length", "qd_actual", "outcome"}:
        mine = (
            run[each].isel(time=slice(0, again.sizes["time"]))
            if "time" in run[each].dims
            else run[each]
        )
        np.testing.assert_array_equal(mine.values, again[each].values, err_msg=each)
    assert not again.image_age.values.any() and again.attrs["commands"] == "topic /joint_commands"
    assert rs.replay(again).identical(again)


def test_hidden_marks_are_left_out_and_come_back_as_nan(run, rhino, tmp_path):
    hidden = run.copy(deep=True)
    hidden.pixels.values[3:6, 1] = np.nan
    again = rs.logs.read_bag(rs.logs.write_bag(hidden, tmp_path / "bag"))
    np.testing.assert_array_equal(again.pixels, hidden.pixels)


def test_topics_joints_and_marks_of_others(content, rhino, run, tmp_path):
    """Other names for everything, a gripper besides, commands without names."""

    def other():
        for topic, kind, time, each in content:
            if topic == "/joint_states":
                names = ["gripper", *(f"arm_{name}" for name in each.name)]
                position = np.append(0.5, each.position)
                state = remake(each, name=names, position=position, velocity=np.empty(0))
                yield "/robot/state", kind, time, state
            elif topic == "/joint_commands":
                layout = make_message("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
                speeds = make_message(message_types.NUMBERS, layout=layout, data=each.velocity)
                yield "/speeds", message_types.NUMBERS, time, speeds
            elif topic == "/camera/detections":
                for one in each.detections:
                    one.id = f"tag{one.id.removeprefix('cube.')}"
                yield topic, kind, time, each

    path = write_bag(tmp_path / "other", other())
    names = {name: f"arm_{name}" for name in rhino.scene.coordinate_names}
    ids = {"cube": [f"tag{i}" for i in range(run.sizes["mark"])]}
    with pytest.warns(rs.errors.FileWarning, match=r"the scene does not have them: joint gripper"):
        found = rs.logs.read_bag(
            path, rhino, topics={"commands": "/speeds"}, names=names, marks=ids
        )
    for name in ("q", "qd", "pixels", "s"):
        np.testing.assert_array_equal(found[name], run[name])


def test_images_are_bytes_with_times(tmp_path):
    kind = message_types.COMPRESSED

    def images():
        for i in range(3):
            header = stamped(make_message, i * NANO // 4)
            data = np.arange(i, dtype=np.uint8)
            yield "/eye/image", kind, i, make_message(kind, header=header, format="jpeg", data=data)

    found = list(rs.logs.read_bag_images(write_bag(tmp_path / "bag", images()), "/eye/image"))
    assert [each.time for each in found] == [0.0, 0.25, 0.5]
    assert [each.data for each in found] == [b"", b"\0", b"\0\1"]
    with pytest.raises(rs.errors.FileError, match="no topic /eye; did you mean '/eye/image"):
        list(rs.logs.read_bag_images(tmp_path / "bag", "/eye"))


def test_other_intrinsics_are_found_out(content, tmp_path):
    zoomed = change_topic(
        content, "/camera/camera_info", lambda i, t, m: (t, remake(m, k=1.1 * m.k))
    )
    found = rs.explain(rs.logs.read_bag(write_bag(tmp_path / "bag", zoomed)), trials=False)
    assert [each.about for each in found.causes] == ["intrinsics"]


def test_nan_marks_are_not_seen(content, tmp_path):
    def lost(i, time, each):
        if i == 4:
            each.detections[0].bbox.center.position.x = np.nan
        return time, each

    again = rs.logs.read_bag(
        write_bag(tmp_path / "bag", change_topic(content, "/camera/detections", lost))
    )
    assert np.argwhere(np.isnan(again.pixels.values[:, :, 0])).tolist() == [[4, 0]]


def test_a_bag_is_written_whole_or_not_at_all(run, tmp_path, monkeypatch):
    with pytest.raises(rs.errors.FileError, match="exists already"):
        rs.logs.write_bag(run, rs.logs.write_bag(run, tmp_path / "bag"))
    before = rs.logs.write_bag(run, tmp_path / "run.mcap").read_bytes()
    monkeypatch.setattr(Writer, "write", lambda *_: (_ for _ in ()).throw(OSError(28, "disk full")))
    for name in ("new", "run.mcap"):
        with pytest.raises(rs.errors.FileError, match="cannot write"):
            rs.logs.write_bag(run, tmp_path / name)
    assert (tmp_path / "run.mcap").read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bag", "run.mcap"]


def test_runs_that_no_bag_can_be_of(run, rhino, tmp_path):
    for what, words in (
        (rhino.run(record="summary"), "only the end of this run was recorded"),
        (rhino.run(start=np.stack([rhino.scene.home] * 2)), "a bag stores a single run, got 2"),
    ):
        with pytest.raises(rs.errors.InputError, match=words):
            rs.logs.write_bag(what, tmp_path / "bag")
    for how, words in (({"storage": "bag"}, "no storage 'bag'"), ({"start": -1.0}, "start: ")):
        with pytest.raises(rs.errors.InputError, match=words):
            rs.logs.write_bag(run, tmp_path / "bag", **how)


def test_parts_of_a_bag_are_read_in_their_order(content, run, tmp_path):
    """Split by size, as the recorder does: bag_0.mcap ... bag_10.mcap."""
    (tmp_path / "bag").mkdir()
    for part in range(11):
        some = [each for each in content if each[2] * 11 // (NANO + 1) == part]
        folder = write_bag(tmp_path / f"part{part}", some)
        shutil.move(folder / f"{folder.name}.mcap", tmp_path / "bag" / f"bag_{part}.mcap")
    np.testing.assert_array_equal(rs.logs.read_bag(tmp_path / "bag").q, run.q)


def test_the_guide_runs_with_bags(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "logs.md").read_text(encoding="utf-8")
    names = {"np": np}
    for block in re.findall(r"```py\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "logs.md", "exec"), names)
    assert "(1.99 periods)" in str(rs.explain(names["run"], trials=False))


def test_the_example_finds_gain_delay_and_lag(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(ROOT / "examples" / "bag_there_and_back.py"), run_name="__main__")
    out, err = capsys.readouterr()
    assert err == "" and "with a lag of 0.1 +- " in out and "are 0.804" in out
    assert "to the bit with its own experiment: True, lag 0.1 s" in out


def test_a_bag_has_torques_as_efforts(tmp_path):
    made = rs.load_scenario(rs.examples.path("torque_planar")).with_(duration=0.2)
    run = made.run()
    path = rs.logs.write_bag(run, tmp_path / "bag")
    messages = [message for _, message in every(path, "/joint_commands")]
    np.testing.assert_array_equal([each.effort for each in messages], run.qd)
    assert not any(len(each.velocity) for each in messages)
    log = rs.logs.read_bag(path, made)
    np.testing.assert_array_equal(log.qd.values, run.qd.values)
    assert log.qd.attrs["units"] == "N m"
