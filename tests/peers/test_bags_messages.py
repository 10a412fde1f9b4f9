"""Messages as input of a controller, and its commands as messages: there and back."""

from types import SimpleNamespace

import numpy as np
import pytest
from bagging import NANO, april_tag, detections, frames, serialise, state, write_bag

import robsim as rs
from robsim.logs import message_types
from robsim.logs.command_messages import make_header
from robsim.logs.message_types import make_message
from robsim.logs.scene_messages import make_camera_info


def experiment(name="chapter_6_1"):
    return rs.load_scenario(rs.examples.path(name))


@pytest.fixture
def ros():
    return rs.control.RosMessages(rs.Controller(experiment()))


def test_joints_are_known_by_name(ros):
    """In any order, with others among them, and in parts; nothing before all are known."""
    names = list(ros.controller.scene.coordinate_names)
    q = np.arange(5) / 7
    np.testing.assert_array_equal(ros.joints(state(q[::-1], names[::-1])), q)
    np.testing.assert_array_equal(ros.joints(state([9, *q], ["gripper", *names])), q)
    some = rs.control.RosMessages(ros.controller, names={names[0]: "arm_0"})
    assert some.joints(state(q[1:], names[1:])) is None
    np.testing.assert_array_equal(some.joints(state(q[:1], ["arm_0"])), q)


def test_times_agree_with_headers(ros):
    assert ros.time(state([], [], 7.25)) == 7.25 and ros.time(state([], [])) is None
    assert ros.marks(detections({}, 3.5)).t == 3.5 and ros.marks(detections({}), t=2.0).t == 2.0


def test_marks_are_known_by_name(ros):
    (sight,) = ros.controller.sights
    places = {"cube.2": (1.5, 2.5), "other": (0, 0), "cube.0": (3, 4), "cube.3": (np.nan, 1)}
    found = ros.marks(detections(places, 1.0)).pixels
    expected = [[3, 4], [np.nan] * 2, [1.5, 2.5], [np.nan] * 2]
    np.testing.assert_array_equal(found[sight.key], expected)
    assert found["other"] is None
    ids = rs.control.RosMessages(ros.controller, marks={"cube": ["a", "b", "c", "d"]})
    seen = ids.marks(detections({"d": (5, 6)}, 1.0)).pixels[sight.key]
    np.testing.assert_array_equal(seen, [*[[np.nan] * 2] * 3, [5, 6]])


def test_a_target_that_is_not_looked_for_is_reported_by_the_controller(ros):
    run, names = experiment().run(duration=0.2), ros.controller.scene.coordinate_names
    places = {f"cube.{i}": place for i, place in enumerate(run.pixels.values[0])}
    marks = ros.marks(detections(places | {"cup": (1, 2)}, 5.0))
    q = ros.joints(state(run.q.values[0], names))
    command = ros.controller.step(marks, q, 5.0)
    np.testing.assert_array_equal(command.velocities, run.qd.values[0])
    assert command.health.unused == ("cup",)


def test_corners_of_april_tags_are_in_our_order_and_pixels():
    """pyapriltags gives the same corners as apriltag_ros; `TagDetector` reads them likewise."""
    tag = rs.vision.Tag("tag36h11", 7, size=0.1)
    scene = rs.Scene(
        [rs.robots.free_camera()],
        [rs.Object(tag.name, marks=tag.marks)],
        [rs.MountedCamera("eye", rs.Camera(np.diag([500, 500, 1]) + 0), on="free_camera.body")],
    )
    controller = rs.Controller(rs.Experiment(scene, rs.IBVS(rs.Pose.at(0, 0, -1)), duration=1.0))
    ours = np.array([[10, 20], [30, 21], [31, 41], [9, 40]]) + 0.25
    theirs = ours[::-1] + 0.5
    array = make_message(
        message_types.APRILTAGS,
        header=make_header(make_message, NANO),
        detections=[april_tag("tag36h11", 7, theirs), april_tag("tag36h11", 8, theirs)],
    )
    found = rs.control.RosMessages(controller).marks(serialise(array)).pixels
    np.testing.assert_array_equal(found[("eye", tag.name)], ours)
    assert [name for name in found if name != ("eye", tag.name)] == [
        f"tag36h11_8.{i}" for i in range(4)
    ]


BODIES = ("visp_tutorial", "unicycle_docking", "differential_drive", "holonomic")
SAID = [
    *(
        ("chapter_6_1", kind)
        for kind in (message_types.NUMBERS, message_types.JOINTS, message_types.TRAJECTORY)
    ),
    *((name, kind) for name in BODIES for kind in message_types.TWISTS),
]


@pytest.mark.parametrize(("name", "kind"), SAID)
def test_commands_come_back_from_a_bag(name, kind, tmp_path):
    """Commands that a node publishes and a bag records equal the commands of the read run."""
    made = experiment(name)
    run = made.run(duration=0.4)
    ros = rs.control.RosMessages(rs.Controller(made))
    columns = [run.velocity.values.tolist().index(n) for n in ros.controller.velocity_names]
    eye, target = run.mark_camera.values[0], run.mark_target.values
    names = [f"{each}.{j}" for j, each in enumerate(target)]

    def told():
        for i, t in enumerate((run.time.values * NANO).round().astype(int).tolist()):
            now = state(run.q.values[i], list(made.scene.coordinate_names), t / NANO)
            ros.joints(now)
            places = dict(zip(names, run.pixels.values[i], strict=True))
            command = ros.command(run.qd.values[i, columns], kind)
            yield "/joint_states", now.__msgtype__, t, now
            yield f"/{eye}/detections", message_types.DETECTIONS, t, detections(places, t / NANO)
            yield "/commands", kind, t, command

    path = write_bag(tmp_path / "bag", told())
    again = rs.logs.read_bag(path, made, topics={"commands": "/commands"}, clock="log")
    np.testing.assert_array_equal(again.qd, run.qd)
    assert again.attrs["commands"] == "topic /commands"


def test_a_trajectory_leads_to_where_joints_will_be(ros):
    names = ros.controller.scene.coordinate_names
    other = rs.control.RosMessages(ros.controller, order=[*names[::-1], "gripper"])
    ros.joints(state([1, 2, 3, 4, 5], names))
    each = serialise(ros.command([10, 20, 30, 40, 50], message_types.TRAJECTORY, ahead=0.25))
    (point,) = each.points
    assert tuple(each.joint_names) == names and point.time_from_start.nanosec == 250_000_000
    np.testing.assert_array_equal(point.positions, [3.5, 7, 10.5, 14, 17.5])
    np.testing.assert_array_equal(point.velocities, [10, 20, 30, 40, 50])
    numbers = serialise(other.command([10, 20, 30, 40, 50]))
    np.testing.assert_array_equal(numbers.data, [50, 40, 30, 20, 10, 0])
    with pytest.raises(rs.errors.InputError, match="needs the position of joint tool"):
        other.command([1] * 5, message_types.TRAJECTORY)


def test_a_twist_agrees_with_the_body():
    ros = rs.control.RosMessages(rs.Controller(experiment("visp_tutorial")))
    each = serialise(ros.command([1, 2, 3, 4, 5, 6], message_types.STAMPED)).twist
    assert [getattr(each.linear, a) for a in "xyz"] == [1, 2, 3]
    assert [getattr(each.angular, a) for a in "xyz"] == [4, 5, 6]
    drive = rs.control.RosMessages(rs.Controller(experiment("unicycle_docking")))
    each = serialise(drive.command([0.5, -0.25], message_types.TWIST))
    assert (each.linear.x, each.angular.z, each.linear.y, each.angular.x) == (0.5, -0.25, 0, 0)


def test_an_unsuitable_message_is_reported_in_a_line(ros):
    names = list(ros.controller.scene.coordinate_names)
    for call, words in (
        (lambda: ros.joints(state([np.nan] * 5, names, 2.5)), r"shoulder is nan, at 2.5 s"),
        (lambda: ros.joints(state([0] * 2, names[:1] * 2)), "joint shoulder occurs twice"),
        (lambda: ros.joints(state([0] * 2, names)), "5 names but 2 values of position"),
        (lambda: ros.joints(3), "expected a message JointState, got 3: .* no attribute 'position'"),
        (lambda: ros.marks(state([], [])), "of detections, got .* no attribute 'detections'"),
        (lambda: ros.frames(SimpleNamespace(transforms=[4])), "expected a message TFMessage"),
        (lambda: ros.time(SimpleNamespace(header=3)), "expected a message with a time"),
        (lambda: ros.marks(detections({})), "the message has no time: give t"),
        (lambda: ros.marks(detections({}), "left"), "no camera 'left'; cameras: camera"),
        (lambda: ros.command([0] * 4), r"velocities"),
        (lambda: ros.command([0] * 5, "std_msgs/msg/Float64"), "did you mean 'std_msgs/msg/Float"),
        (lambda: ros.command([0] * 5, None), "no command of type None"),
        (lambda: ros.command([0] * 5, message_types.TWIST), "one body .*; the scene has none"),
        (lambda: ros.command([0] * 5, message_types.TRAJECTORY, ahead=0), "ahead"),
        (lambda: rs.control.RosMessages(3), "expected a Controller, got 3"),
        (
            lambda: rs.control.RosMessages(ros.controller, order=["a"]),
            "expected joint shoulder once",
        ),
        (
            lambda: rs.control.RosMessages(ros.controller, order=3),
            "order: expected names of joints",
        ),
        (
            lambda: rs.control.RosMessages(ros.controller, names={"rist": "a"}),
            "did you mean 'wrist'",
        ),
        (
            lambda: rs.control.RosMessages(ros.controller, marks={"cube": "abcd"}),
            "'cube' has 4 marks",
        ),
    ):
        with pytest.raises(rs.errors.InputError, match=words) as raised:
            call()
        assert "\n" not in str(raised.value)
    seen = detections({"cube.0": (0, 0)}, 2.0)
    seen.detections.append(seen.detections[0])
    with pytest.raises(rs.errors.InputError, match=r"mark 'cube.0' occurs twice, at 2 s"):
        ros.marks(seen)


def test_frames_are_left_out_if_joints_have_the_pose_of_a_body():
    ros = rs.control.RosMessages(rs.Controller(experiment("unicycle_docking")))
    moved = frames(("world", "unicycle.body", rs.Pose.at(3, 4, 0, rpy=(0, 0, 1))), t=1.5)
    assert ros.roams and ros.time(moved) == 1.5
    np.testing.assert_allclose(ros.frames(moved), [3, 4, 1], atol=1e-15)
    names = ros.controller.scene.coordinate_names
    np.testing.assert_array_equal(ros.joints(state([1, 2, 3], names)), [1, 2, 3])
    assert ros.frames(moved) is None and not ros.roams
    with pytest.raises(rs.errors.InputError, match="expected a message TFMessage, got 3"):
        ros.frames(3)
    assert not rs.control.RosMessages(rs.Controller(experiment())).roams


def test_an_april_tag_that_is_there_twice_is_reported():
    scene = rs.load_scenario(rs.examples.path("visp_tutorial"))
    ros = rs.control.RosMessages(rs.Controller(scene))
    tag = april_tag("tag36h11", 3, np.arange(8).reshape(4, 2))
    twice = make_message(
        message_types.APRILTAGS, header=make_header(make_message, NANO), detections=[tag, tag]
    )
    with pytest.raises(rs.errors.InputError, match=r"mark 'tag36h11_3.0' occurs twice, at 1 s"):
        ros.marks(serialise(twice))


def test_the_camera_info_of_a_fisheye_is_that_of_the_camera():
    K, lens = [[300, 0, 320], [0, 295, 240], [0, 0, 1]], (-0.008, 0.045, -0.043, 0.008)
    camera = rs.Camera(K, (640, 480), distortion=lens, lens="fisheye")
    info = make_camera_info(make_message, camera, None)
    assert info.distortion_model == "equidistant" and info.d.tolist() == list(lens)
    fields = {"width": 640, "height": 480, "k": info.k, "d": info.d}
    message = SimpleNamespace(**fields, distortion_model=info.distortion_model)
    assert rs.Camera.from_ros(message) == camera
