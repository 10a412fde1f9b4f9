"""Bags that do not fit, are damaged or lack something: one line each, or the run."""

import numpy as np
import pytest
from bagging import change_topic, check_refusal, later, read_messages, remake, write_bag

import robsim as rs

CHANGES = {
    "backwards": (
        "/camera/detections", lambda i, t, m: (t, later(m, -0.1 if i == 9 else 0)),
        r"topic /camera/detections: the clock goes backwards, to 0.26 s after 0.32 s",
    ),
    "nan joint": (
        "/joint_states", lambda i, t, m: (t, remake(m, position=m.position * [1, np.nan][i == 3])),
        r"position of joint shoulder is nan, at 0.12 s",
    ),
    "names": (
        "/joint_states", lambda i, t, m: (t, remake(m, name=m.name[:3])),
        r"3 names but 5 values of position, at 0 s",
    ),
    "joint twice": (
        "/joint_states", lambda i, t, m: (t, remake(m, name=[*m.name[:4], m.name[0]])),
        r"joint shoulder occurs twice, at 0 s",
    ),
    "other joints": (
        "/joint_states", lambda i, t, m: (t, remake(m, name=[f"{n}_joint" for n in m.name])),
        r"no position of joint shoulder; .*did you mean 'shoulder_joint'",
    ),
    "tag twice": (
        "/camera/detections",
        lambda i, t, m: (t, remake(m, detections=[*m.detections, *m.detections[2:3]])),
        r"mark 'cube.2' occurs twice, at 0 s",
    ),
    "never seen": (
        "/camera/detections", lambda i, t, m: (t, remake(m, detections=m.detections[1:])),
        r"mark 0 was never seen",
    ),
    "size": (
        "/camera/camera_info", lambda i, t, m: (t, remake(m, width=m.width // (1 + (i > 4)))),
        r"camera 'camera' changes its width, at 0.2 s",
    ),
    "other size": (
        "/camera/camera_info", lambda i, t, m: (t, remake(m, width=17)),
        r"images of 17 x \d+ pixels, and \d+ x \d+ in the experiment",
    ),
    "silence": (
        "/joint_states", lambda i, t, m: (t, later(m, 1000 * (i > 9))),
        r"nothing between 0.36 s and 1000.4 s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CHANGES)
def test_an_unsuitable_message_is_reported_in_a_line(case, content, tmp_path):
    topic, change, words = CHANGES[case]
    check_refusal(write_bag(tmp_path / "bag", change_topic(content, topic, change)), words)


def test_the_clock_of_the_recorder_serves_where_headers_go_backwards(content, run, tmp_path):
    topic, change, _ = CHANGES["backwards"]
    path = write_bag(tmp_path / "bag", change_topic(content, topic, change))
    np.testing.assert_array_equal(rs.logs.read_bag(path, clock="log").pixels, run.pixels)


def test_messages_without_stamps_have_the_times_of_the_recorder(content, run, tmp_path):
    def unstamped():
        for topic, kind, time, each in content:
            empty = hasattr(each, "header")
            yield topic, kind, time, later(each, -1e6) if empty else each

    again = rs.logs.read_bag(write_bag(tmp_path / "bag", unstamped()))
    np.testing.assert_array_equal(again.q, run.q)


def test_no_topic_serves_two_cameras(tmp_path):
    stereo = rs.load_scenario(rs.examples.path("stereo_in_hand")).run(duration=0.4)
    path = rs.logs.write_bag(stereo, tmp_path / "both")
    gone = "/right/detections"
    every = list(read_messages(path))
    assert gone in {topic for topic, *_ in every}
    some = [each for each in every if each[0] != gone]
    check_refusal(
        write_bag(tmp_path / "one", some), f"no topic {gone}.*topics={{'marks.right': ...}}"
    )


def test_topics_and_types_that_are_wrong(bag, content, rhino, tmp_path):
    check_refusal(
        bag,
        r"no topic /joint_state; did you mean '/joint_states",
        topics={"joints": "/joint_state"},
    )
    check_refusal(
        bag,
        r"topic /tf has the type tf2_msgs/msg/TFMessage; expected sensor_msgs",
        topics={"joints": "/tf"},
    )
    with pytest.raises(rs.errors.InputError, match="topics: no 'joint'; did you mean 'joints'"):
        rs.logs.read_bag(bag, topics={"joint": "/tf"})
    with pytest.raises(rs.errors.InputError, match="no clock 'wall'"):
        rs.logs.read_bag(bag, clock="wall")
    with pytest.raises(rs.errors.InputError, match="'cube' has 4 marks; expected as many ids"):
        rs.logs.read_bag(bag, marks={"cube": ["1"]})
    with pytest.raises(rs.errors.InputError, match="marks: no target 'cub'; did you mean 'cube'"):
        rs.logs.read_bag(bag, marks={"cub": ["1"]})
    with pytest.raises(rs.errors.InputError, match="names: no joint 'elbow'"):
        rs.logs.read_bag(bag, names={"elbow": "a"})
    with pytest.raises(rs.errors.InputError, match="two joints have the same name in the bag"):
        rs.logs.read_bag(bag, names={"shoulder": "a", "wrist": "a"})
    none = write_bag(
        tmp_path / "none", (each for each in content if each[0] != "/robsim/experiment")
    )
    check_refusal(none, "it has no /robsim/experiment: give the experiment")
    assert rs.logs.read_bag(none, rhino).sizes["time"] == 26
    still = write_bag(tmp_path / "still", (each for each in content if each[0] != "/joint_states"))
    check_refusal(still, r"no topic /joint_states \(sensor_msgs.*topics={'joints': ...}")


def test_files_that_are_none(bag, tmp_path):
    check_refusal(tmp_path / "gone.mcap", "no file")
    check_refusal(tmp_path, r"no .mcap or .db3 file in this folder")
    (tmp_path / "x.txt").write_text("text")
    check_refusal(tmp_path / "x.txt", "expected a folder, or a .mcap or .db3 file")
    check_refusal(write_bag(tmp_path / "empty", ()), "the bag is empty")
    whole = bag.read_bytes()
    for size in (0, 7, 100, len(whole) // 2, len(whole) - 1):
        (tmp_path / "cut.mcap").write_bytes(whole[:size])
        check_refusal(tmp_path / "cut.mcap", "truncated or damaged")
    (tmp_path / "cut.db3").write_bytes(whole)
    check_refusal(tmp_path / "cut.db3", "truncated or damaged")


@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
@pytest.mark.filterwarnings("ignore::robsim.base.errors.FileWarning")
def test_damaged_bags_are_read_or_refused(run, suffix, tmp_path):
    """Bytes that are lost, changed or cut off: a run, or one line that names the file."""
    whole = rs.logs.write_bag(run, tmp_path / f"run{suffix}").read_bytes()
    path, rng, text = tmp_path / f"odd{suffix}", np.random.default_rng(2), 0
    for i in range(30):
        data, at = bytearray(whole), int(rng.integers(len(whole) - 8))
        if i % 3 == 0:
            del data[at : at + int(rng.integers(1, 99))]
        else:
            data[at : at + 8] = [b"\xff" * 8, rng.bytes(8)][i % 3 - 1]
        path.write_bytes(data)
        try:
            rs.logs.read_bag(path)
        except rs.errors.InputError as error:
            text += 1
            assert str(error).startswith(str(path)) and "\n" not in str(error)
    assert text > 10


def test_a_truncated_database_is_reported(run, tmp_path):
    whole = rs.logs.write_bag(run, tmp_path / "run.db3").read_bytes()
    (tmp_path / "cut.db3").write_bytes(whole[: len(whole) // 2])
    check_refusal(tmp_path / "cut.db3", "truncated or damaged")


def test_a_definition_in_the_bag_is_compared_and_never_parsed(bag, tmp_path):
    data = bag.read_bytes()
    assert data.count(b"float64[] position") >= 1
    (tmp_path / "other.mcap").write_bytes(
        data.replace(b"float64[] position", b"float32[] position")
    )
    check_refusal(tmp_path / "other.mcap", "JointState has other fields in this bag|checksum")
