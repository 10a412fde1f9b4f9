"""The teach pendant without a server: joints, the tool, recorded poses, and their files."""

import base64
import csv
import io
import json
import runpy
import struct
import warnings
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.cli.studio_command import _load_shown
from robsim.errors import FileError, FileWarning
from robsim.page.recording_codec import unpack_recording
from robsim.studio.pendant.pendant_session import PendantSession
from robsim.studio.pendant.recorded_poses import ReplayPace, build_replay
from robsim.studio.pendant.tool_search import ToolSearch
from robsim.studio.web.app import UnavailableDownload
from robsim.studio.workbench import Workbench

SQUARE = np.array([(0.2, 0, 0), (0.2, 0.2, 0), (0, 0.2, 0), (0, 0, 0)])  # corners in metres
ARMS = {  # parent to child: kind, xyz, rpy, axis, lower, upper
    "six": [
        ("revolute", "0 0 0.3", "0 0 0", "0 0 1", -2.9, 2.9),
        ("revolute", "0 0 0.1", "0 0 0", "0 1 0", -1.8, 1.8),
        ("revolute", "0 0 0.45", "0 0 0", "0 1 0", -2.6, 2.6),
        ("continuous", "0 0 0.2", "0 0 0", "0 0 1", 0, 0),
        ("revolute", "0 0 0.25", "0 0 0", "0 1 0", -2.2, 2.2),
        ("continuous", "0 0 0.1", "0 0 0", "0 0 1", 0, 0),
    ],
    "seven": [
        ("revolute", "0 0 0.3", "0 0 0.2", "0 0 1", -2.9, 2.9),
        ("revolute", "0 0 0", "-1.5707963 0 0", "0 0 1", -2.0, 2.0),
        ("revolute", "0 -0.35 0", "1.5707963 0 0", "0 0 1", -2.9, 2.9),
        ("revolute", "0.05 0 0", "1.5707963 0 0", "0 0 1", -2.4, 2.4),
        ("revolute", "-0.05 0.35 0", "-1.5707963 0 0", "0 0 1", -2.9, 2.9),
        ("revolute", "0 0 0", "1.5707963 0 0", "0 0 1", -2.2, 2.2),
        ("revolute", "0.08 0 0", "1.5707963 0 0", "0 0 1", -2.9, 2.9),
    ],
    "gantry": [
        ("prismatic", "0 0 1", "0 0 0", "1 0 0", -0.6, 0.6),
        ("prismatic", "0 0 0", "0 0 0", "0 1 0", -0.6, 0.6),
        ("prismatic", "0 0 0", "3.14159265 0 0", "0 0 1", 0, 0.7),
        ("continuous", "0 0 0.1", "0 0 0", "0 0 1", 0, 0),
        ("revolute", "0 0 0.1", "0 0 0", "0 1 0", -1.5, 1.5),
        ("revolute", "0 0 0.1", "0 0 0", "1 0 0", -1.5, 1.5),
    ],
}
POSTURES = {
    "six": [0.1, 0.5, 1.2, 0.1, 0.9, 0.0],
    "seven": [0.1, 0.3, 0.1, -1.9, 0.1, 0.8, 0.2],
    "gantry": [0.1, -0.1, 0.3, 0.2, 0.1, 0.2],
}


def write_stl(path):
    """Write a tetrahedron of 6 cm as a binary STL file."""
    corners = 0.06 * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], "<f4")
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    rows = (np.zeros(3, "<f4").tobytes() + corners[list(f)].tobytes() + b"\0\0" for f in faces)
    path.write_bytes(bytes(80) + struct.pack("<I", 4) + b"".join(rows))


def write_arm(folder, name):
    """Write a URDF arm whose links have meshes, and return its path."""
    write_stl(folder / "part.stl")
    mesh = '<visual><geometry><mesh filename="part.stl"/></geometry></visual>'
    links = [f'<link name="link{i}">{mesh}</link>' for i in range(len(ARMS[name]) + 1)]
    joints = [
        f'<joint name="j{i + 1}" type="{kind}"><parent link="link{i}"/><child link="link{i + 1}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        + (f'<limit lower="{low}" upper="{high}" effort="9" velocity="1.5"/>' if high else "")
        + "</joint>"
        for i, (kind, xyz, rpy, axis, low, high) in enumerate(ARMS[name])
    ]
    path = folder / f"{name}.urdf"
    path.write_text(f'<robot name="{name}">{"".join(links + joints)}</robot>')
    return path


def open_pendant(robot):
    """Return a session whose messages to pages are collected in `told`, without its thread."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)  # of meshes, where trimesh is not installed
        session = PendantSession(robot)
    session.told = []
    session.broadcast = session.told.append
    return session


def open_arm(folder, name):
    if name == "panda":
        return open_pendant(rs.robots.panda())
    session = open_pendant(rs.Robot.from_urdf(write_arm(folder, name)))
    for i, (value, field) in enumerate(zip(POSTURES[name], session.pendant.fields, strict=True)):
        assert session.do({"joint": [i, value / field.size, None]}) == ""
    return session


def ask(session, **request):
    """Handle a request, and return what the page is told about the pose."""
    note = session.do(request)
    return session._describe_pose() | {"note": note}


def turn(axis, angle):
    """The matrix of a rotation, by the formula of Rodrigues."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([(0, -z, y), (z, 0, -x), (-y, x, 0)])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def multiply_joints(path, q):
    """The pose of the last link as a product of matrices, from the text of a URDF file."""
    T = np.eye(4)
    for joint, value in zip(ET.parse(path).getroot().iter("joint"), q, strict=True):
        xyz, rpy = (
            np.array(joint.find("origin").get(key).split(), float) for key in ("xyz", "rpy")
        )
        axis = np.array(joint.find("axis").get("xyz").split(), float)
        A, B = np.eye(4), np.eye(4)
        A[:3, :3] = turn((0, 0, 1), rpy[2]) @ turn((0, 1, 0), rpy[1]) @ turn((1, 0, 0), rpy[0])
        A[:3, 3] = xyz
        if joint.get("type") == "prismatic":
            B[:3, 3] = axis * value
        else:
            B[:3, :3] = turn(axis, value)
        T = T @ A @ B
    return T


def matrix_of(pose):
    """The matrix of a pose x, y, z and quaternion x, y, z, w."""
    x, y, z, w = pose[3:]
    T = np.eye(4)
    T[:3, :3] = np.eye(3) + 2 * np.array(
        [
            (-y * y - z * z, x * y - z * w, x * z + y * w),
            (x * y + z * w, -x * x - z * z, y * z - x * w),
            (x * z - y * w, y * z + x * w, -x * x - y * y),
        ]
    )
    T[:3, 3] = pose[:3]
    return T


def measure_gap(A, B):
    """Distance in metres and angle in degrees between two poses."""
    R = A[:3, :3].T @ B[:3, :3]
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return np.linalg.norm(A[:3, 3] - B[:3, 3]), np.degrees(np.arctan2(sine, (np.trace(R) - 1) / 2))


@pytest.mark.parametrize("name", ["panda", *ARMS])
def test_the_tool_follows_a_square_to_a_tenth_of_a_millimetre(tmp_path, name):
    session = open_arm(tmp_path, name)
    pendant, start = session.pendant, session._describe_pose()["handle"]
    low, high = pendant.robot.limits.T
    corners = np.concatenate([[np.zeros(3)], SQUARE]) - (0.1, 0.1, 0)
    shares = np.arange(1, 11) / 10
    steps = [a + share * (b - a) for a, b in pairwise(corners) for share in shares]
    for step in [corners[0], *steps]:
        goal = [*(np.array(start[:3]) + step), *start[3:]]
        told, before = ask(session, drag=[goal, "hand 1"]), pendant.q
        assert told["note"] == told["reach"] == "" and told["requested"] is None
        assert (low <= before).all() and (before <= high).all()
        if name == "panda":
            reached = rs.robots.panda().fk(pendant.q)
        else:
            reached = multiply_joints(tmp_path / f"{name}.urdf", pendant.q)
        distance, angle = measure_gap(reached, matrix_of(goal))
        assert distance < 1e-5 and angle < 1e-3
    assert len(steps) == 40
    session.do({"undo": True})  # the whole stroke is one move
    assert ask(session)["handle"] == pytest.approx(start, abs=1e-9)


def test_an_unreachable_corner_is_named_and_the_arm_goes_as_near_as_it_can(tmp_path):
    session = open_arm(tmp_path, "six")
    start = session._describe_pose()["handle"]
    goal = [*(start[0] + 2.0, *start[1:3]), *start[3:]]
    told = ask(session, drag=[goal, "hand 1"])
    reached = multiply_joints(tmp_path / "six.urdf", session.pendant.q)
    distance, angle = measure_gap(reached, matrix_of(goal))
    assert (
        f"out of reach: {100 * distance:.3g} cm too far and turned by {angle:.3g} deg"
        == told["reach"]
    )
    assert told["requested"] == pytest.approx(goal, abs=1e-8)
    # the shoulder is at 0.4 m; the arm of 1 m ends on the sphere around it
    shoulder = np.array([0, 0, 0.4])
    longest = np.linalg.norm(np.array(goal[:3]) - shoulder) - 1.0
    assert longest - 1e-9 <= distance <= longest + 0.06
    assert ask(session, home=True)["reach"] == ""


def test_a_joint_at_its_limit_is_marked_and_named(tmp_path):
    session = open_arm(tmp_path, "gantry")
    start = session._describe_pose()["handle"]
    told = ask(session, drag=[[start[0] + 0.7, *start[1:]], "hand 1"])
    assert told["reach"] == (
        "out of reach: 19.8 cm too far and turned by 1.11 deg; j1 at its limit of 60 cm"
    )
    assert told["limits"] == ["high", "", "", "", "", ""]
    assert told["joints"][0] == 60.0


def test_a_stretched_arm_bends_when_its_tool_is_pushed_back():
    session = open_pendant(rs.robots.planar_2r())
    for i in range(2):
        session.do({"joint": [i, 0, None]})
    told = ask(session, drag=[[1.7, 0, 0, 0, 0, 0, 1], "hand 1"])
    assert told["reach"] == ""
    assert session.pendant.tool.position == pytest.approx([1.7, 0, 0], abs=1e-8)


def test_angles_go_on_beyond_a_turn_and_keep_their_side():
    session = open_pendant(rs.robots.ur5e())
    session.do({"joint": [5, 350, None]})
    handle = session._describe_pose()["handle"]
    told = ask(session, drag=[[handle[0], handle[1] + 0.01, *handle[2:]], "hand 1"])
    assert told["reach"] == "" and 340 < told["joints"][5] <= 360


def test_an_angle_turns_no_farther_than_its_limits_demand():
    arm = rs.robots.ur5e()
    search = ToolSearch(arm, arm.tip, arm.home)
    near, found = np.radians([-248.6, 350, 0, 0, 0, 0]), np.radians([298.6, -5, 0, 0, 0, 0])
    assert np.degrees(search._unwind(found, near))[:2] == pytest.approx([-61.4, 355])


def test_a_typed_pose_may_need_another_configuration_and_a_dragged_one_does_not_jump(tmp_path):
    pendant = open_arm(tmp_path, "six").pendant
    low, high = np.clip(pendant.robot.limits.T, -3, 3)
    other = np.random.default_rng(6).uniform(low, high)
    T = rs.Pose(multiply_joints(tmp_path / "six.urdf", other))
    pendant.move_tool(T)
    assert pendant.reach_text == (
        "out of reach: 1.34 cm too far and turned by 0.0622 deg; j1 at its limit of -166.2 deg"
    )
    pendant.undo()
    pendant.move_tool(T, wide=True)
    assert pendant.reach_text == "reached in another configuration of the arm"
    reached = multiply_joints(tmp_path / "six.urdf", pendant.q)
    np.testing.assert_allclose(reached, T.matrix, rtol=0, atol=1e-7)


def test_a_typed_pose_and_refused_numbers():
    session = open_pendant(rs.robots.panda())
    session.do({"tool": [2, 45.0]})
    told = ask(session, tool=[5, 30.0])
    assert told["tool"]["position"] == pytest.approx([30.6890567, 0, 45.0], abs=1e-6)
    assert told["tool"]["rpy"][2] == pytest.approx(30.0, abs=1e-6)
    before = session.pendant.q
    assert ask(session, joint=[0, 200, None])["note"] == (
        "link1: 200 deg is outside of its limits, -166 to 166 deg"
    )
    for wrong in (
        *({"joint": [9, 1, None]}, {"joint": [0, True, None]}, {"joint": 3}, {"tool": [6, 1]}),
        *({"drag": [[0] * 7, 1]}, {"drag": [[0, 0, 1, 0, 0, 0, "x"], 1]}, {"link": "none"}),
        *({"go": 0}, {"remove": True}, {"pace": [2, None]}, {"pace": [0.5, 0]}, {"nothing": 1}),
        *({"rename": [0, ""]}, {"reorder": [0, 1]}, {"lead": []}, {"redo": True}, {"replay": True}),
        {"tool": [0, 1e300]},
    ):
        note = session.do(wrong)
        assert note and "internal" not in note
    np.testing.assert_array_equal(session.pendant.q, before)


def test_undo_and_redo_of_moves_and_of_the_list():
    session = open_pendant(rs.robots.panda())
    for value in (10, 20, 30):
        session.do({"joint": [0, value, "slider 1"]})
    session.do({"record": True})
    session.do({"joint": [0, -10, "slider 2"]})
    angles = []
    for request in ("undo", "undo", "undo", "redo", "redo", "redo"):
        told = ask(session, **{request: True})
        angles.append((round(told["joints"][0], 9), len(session.pendant.poses)))
    assert angles == [(30, 1), (30, 0), (0, 0), (30, 0), (30, 1), (-10, 1)]


def test_only_the_last_of_waiting_drags_is_computed():
    session = open_pendant(rs.robots.panda())
    handle = session._describe_pose()["handle"]
    for i in range(50):
        session.receive({"drag": [[handle[0] + 1e-3 * i, *handle[1:]], "hand 1"]})
    session.receive({"record": True})
    session.receive({"drag": [handle, "hand 2"]})
    assert [next(iter(each)) for each in session._requests.take(0.1)] == ["drag", "record", "drag"]


def record_poses(session, count, seed=0):
    """Record some random configurations, and return them."""
    low, high = np.clip(session.pendant.robot.limits.T, -2, 2)
    for share in np.random.default_rng(seed).uniform(0.1, 0.9, (count, len(low))):
        for i, field in enumerate(session.pendant.fields):
            session.do({"joint": [i, float(low[i] + share[i] * (high - low)[i]) / field.size, 1]})
        session.do({"record": True})
    return [pose.q for pose in session.pendant.poses]


def ends_of(mission):
    return np.array([leg.q_end for leg in mission.legs])


def test_twenty_recorded_poses_are_replayed_within_the_speed_of_the_joints(tmp_path):
    session = open_arm(tmp_path, "six")
    recorded = record_poses(session, 20)
    session.do({"pace": [1.0, None]})
    robot, poses, pace = session.pendant.robot, session.pendant.poses, session.pendant.pace
    mission = build_replay(robot, poses, pace).run()
    assert mission.succeeded and len(mission.legs) == 20
    assert np.abs(ends_of(mission) - recorded).max() < 1e-6
    fastest = np.abs(np.diff(mission.run["q"].values, axis=0)).max() / 0.04
    assert 1.4 < fastest < 1.5 + 1e-9  # rad/s, of the URDF file
    slow = build_replay(robot, poses[:2], ReplayPace(0.5, 3.0)).run()
    assert [leg.end - leg.start for leg in slow.legs] == pytest.approx([3.0, 3.0], abs=0.05)


def join_parts(session, kind):
    """The arrays of a recording that arrived in parts."""
    messages = [each for each in map(json.loads, session.told) if each["type"] == kind]
    assert [each["part"] for each in messages] == list(range(messages[0]["parts"]))
    return unpack_recording(base64.b64decode("".join(each["recording"] for each in messages)))[1]


def test_every_message_is_below_64_kib():
    session = PendantSession(rs.robots.panda())
    session.told = []
    session.broadcast = session.told.append
    session.start()
    session.close()
    record_poses(session, 8)
    session.pendant.set_pace(0.1, 20.0)
    assert session.do({"replay": True}) == ""
    assert max(map(len, session.told)) < 64 * 1024
    assert join_parts(session, "recording")["poses"].shape[0] == 1
    replayed = join_parts(session, "replay")
    assert replayed["time"][-1] == pytest.approx(160.0, abs=0.1)
    assert len(replayed["poses"]) == len(replayed["time"])


@pytest.mark.parametrize("seconds", [300.0, 600.0])
def test_a_long_replay_is_shown_with_fewer_instants_or_refused(seconds):
    session = open_pendant(rs.robots.planar_2r())
    record_poses(session, 4)
    session.do({"pace": [1.0, seconds]})
    note = session.do({"replay": True})
    if seconds == 600.0:
        assert note.startswith("the replay takes 40 minutes, and at most 30 are shown")
        return
    time = join_parts(session, "replay")["time"]
    assert note == "" and 3500 < len(time) < 4100
    assert time[-1] == pytest.approx(1200.0, abs=0.5)


@pytest.mark.parametrize("name", ["panda", "gantry"])
def test_the_files_give_the_same_motion(tmp_path, monkeypatch, name):
    session = open_arm(tmp_path, name)
    recorded = record_poses(session, 3)
    session.do({"rename": [1, 'above "the cup"']})
    kinds = {}
    for file in ("experiment.toml", "experiment.py", "poses.csv"):
        kinds[file], content = session.download(file)
        (tmp_path / file).write_bytes(content)
    assert session.file_name("poses.csv").endswith("-poses.csv")
    assert kinds["poses.csv"] == "text/csv" and session.download("run.nc") is None
    experiment = rs.load_scenario(tmp_path / "experiment.toml")
    assert [phase.name for phase in experiment.task.phases][1] == 'above "the cup"'
    run = experiment.run()
    np.testing.assert_array_equal([p.task.to for p in experiment.task.phases], recorded)
    assert np.abs(ends_of(run) - recorded).max() < 1e-6
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FileWarning)  # of meshes, where trimesh is not installed
        shown = Workbench(experiment).recording()  # as `robsim studio experiment.toml` opens it
    assert len(shown.arrays["time"]) == run.run.sizes["time"]
    monkeypatch.setattr(rs, "show", lambda run: None)
    made = runpy.run_path(str(tmp_path / "experiment.py"))
    np.testing.assert_array_equal(made["run"].run["q"].values, run.run["q"].values)
    head, *rows = csv.reader(io.StringIO((tmp_path / "poses.csv").read_text()))
    units = [field.unit for field in session.pendant.fields]
    assert head[1:] == [
        f"{field.name} [{unit}]" for field, unit in zip(session.pendant.fields, units, strict=True)
    ]
    shown = np.array([row[1:] for row in rows], float) * [
        np.pi / 180 if u == "deg" else 0.01 for u in units
    ]
    np.testing.assert_allclose(shown, recorded, rtol=0, atol=1e-9)


def test_a_table_of_poses_is_loaded_again_and_wrong_tables_are_refused(tmp_path):
    session = open_arm(tmp_path, "gantry")
    recorded = record_poses(session, 3)
    table = session.download("poses.csv")[1].decode()
    for _ in range(3):
        session.do({"remove": 0})
    assert session.do({"load": table}) == ""
    np.testing.assert_array_equal([pose.q for pose in session.pendant.poses], recorded)
    for wrong, reason in {
        "": "expected the columns pose, j1 [cm], j2 [cm], j3 [cm], j4 [deg]",
        table.replace("[cm]", "[m]"): "expected the columns",
        table + "pose 9,1,2\n": "line 5: expected 7 columns, got 3",
        table + "pose 9,1,2,3,x,5,6\n": "line 5: j4: expected a number, got 'x'",
        table + "pose 9,100,2,3,4,5,6\n": "line 5: j1: 100 cm is outside of its limits",
        table + "pose 9,nan,2,3,4,5,6\n": "line 5: j1",
        table + "pose 1,1,2,3,4,5,6\n": "line 5: another pose is called 'pose 1'",
    }.items():
        assert reason in session.do({"load": wrong})
    assert len(session.pendant.poses) == 3


def test_the_files_read_as_a_person_writes_them():
    session = open_pendant(rs.robots.panda())
    session.do({"record": True})
    text = session.download("experiment.toml")[1].decode()
    assert '"-45 deg"' in text and 'speed = "30 deg/s"' in text and len(text.splitlines()) < 20
    code = session.download("experiment.py")[1].decode()
    assert '    "pose 1": [0, -45, 0, -135, 0, 90, 45],\n' in code
    assert "FollowJoints(to=np.array(q) * deg, speed=30 * deg, acceleration=60 * deg)" in code


def test_recorded_poses_are_renamed_reordered_removed_and_visited():
    session = open_pendant(rs.robots.panda())
    for value in (10, 20, 30):
        session.do({"joint": [0, value, None]})
        session.do({"record": True})
    session.do({"rename": [0, " pick "]})
    assert session.do({"rename": [1, "pick"]}) == "another pose is called 'pick'"
    session.do({"reorder": [0, 2]})
    session.do({"remove": 0})
    session.do({"record": True})
    assert [pose.name for pose in session.pendant.poses] == ["pose 3", "pick", "pose 4"]
    assert ask(session, go=1)["joints"][0] == pytest.approx(10.0, abs=1e-12)


def test_without_a_pose_there_are_no_files():
    with pytest.raises(UnavailableDownload, match="no pose is recorded yet"):
        open_pendant(rs.robots.panda()).download("experiment.toml")


def test_an_arm_on_a_platform_moves_while_the_platform_stands():
    session = open_pendant(rs.robots.mobile_arm())
    pendant = session.pendant
    session.do({"joint": [0, 50, None]})
    handle = session._describe_pose()["handle"]
    told = ask(session, drag=[[handle[0] + 0.03, handle[1] + 0.02, *handle[2:]], "hand 1"])
    assert told["reach"] == told["note"] == ""
    assert pendant.q[:3].tolist() == [0.5, 0, 0]
    session.do({"record": True})
    assert session.do({"replay": True}) == ""
    assert json.loads(session.told[-1])["type"] == "replay"
    session.do({"joint": [0, 60, None]})
    session.do({"record": True})
    assert session.do({"replay": True}) == (
        "'pose 2' differs from 'pose 1' in body.x, which FollowJoints cannot move: record both "
        "with the same values"
    )


@pytest.mark.parametrize("name", ["car", "free_camera", "rhino_gripper", "holonomic_base"])
def test_other_robots_are_shown_with_units_and_refuse_in_words(name):
    session = open_pendant(rs.robots.load(name))
    session.start()
    session.close()
    joints = json.loads(session.told[0])["joints"]
    assert [each["unit"] for each in joints] == [
        {"m": "cm", "rad": "deg", "1": ""}[unit] for unit in session.pendant.robot.coordinate_units
    ]
    coupled = json.loads(session.told[0])["coupled"]
    assert [each["name"] for each in coupled] == (
        {
            "rhino_gripper": ["finger_left", "finger_right"],
            "car": ["knuckle_left", "knuckle_right"],
        }.get(name, [])
    )
    session.do({"record": True})
    note = session.do({"replay": True})
    refused = "FollowJoints moves joints of one coordinate" in note
    assert refused == (name != "rhino_gripper") and (refused or note == "")
    if name == "car":
        handle = session._describe_pose()["handle"]
        assert session.do({"drag": [handle, 1]}).startswith("no joint moves 'camera_mount'")


def test_a_robot_without_joints_is_shown(tmp_path):
    path = tmp_path / "table.urdf"
    path.write_text('<robot name="table"><link name="top"/></robot>')
    session = open_pendant(rs.Robot.from_urdf(path))
    session.start()
    session.close()
    assert json.loads(session.told[0])["joints"] == []


def test_missing_meshes_are_reported_on_the_page(tmp_path):
    path = write_arm(tmp_path, "six")
    (tmp_path / "part.stl").unlink()
    with pytest.warns(FileWarning, match="7 of 7 meshes are not drawn"):
        session = PendantSession(rs.Robot.from_urdf(path))
    assert session.remark.startswith("7 of 7 meshes")


def test_the_command_opens_robots_by_file_and_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert _load_shown(write_arm(tmp_path, "six"))[0].name == "six"
    assert _load_shown(Path("panda"))[0] == rs.robots.panda()
    (tmp_path / "panda").mkdir()  # a folder of scenarios has priority over the library
    with pytest.raises(FileError, match="panda"):
        _load_shown(Path("panda"))
    with pytest.raises(FileError, match="no file, folder or robot 'puma'; did you mean 'puma560'"):
        _load_shown(Path("puma"))
    (tmp_path / "broken.urdf").write_text("<robot name='x'><link")
    with pytest.raises(FileError, match="not valid XML"):
        _load_shown(Path("broken.urdf"))
    with pytest.raises(FileError, match=r"absent\.urdf"):
        _load_shown(Path("absent.urdf"))


def test_the_search_names_the_lead_that_fits_the_joints():
    for name, lead in {"panda": "pose", "rhino_xr4": "pointing", "scara": "position"}.items():
        robot = rs.robots.load(name)
        assert ToolSearch(robot, robot.tip, robot.home).natural_lead == lead
