"""What a ROS 2 node hears and says: messages of rosbags there and back, and the example's node."""

import importlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

import robsim as rs
from robsim.logs import messages
from robsim.logs.messages import message
from robsim.logs.write_commands import header, joint_state

ROOT = Path(__file__).parents[2]
NANO = 1_000_000_000


def sent(each):
    """A message as it comes out of its bytes."""
    store = messages.typestore()
    return store.deserialize_cdr(store.serialize_cdr(each, each.__msgtype__), each.__msgtype__)


def state(q, names, t=0.0):
    return sent(joint_state(message, round(t * NANO), names, np.array(q, float), np.empty(0)))


def detections(marks, t=0.0):
    """A Detection2DArray of {name: (column, row)}."""
    head, found = header(message, round(t * NANO)), []
    for name, (column, row) in marks.items():
        point = message("vision_msgs/msg/Point2D", x=float(column), y=float(row))
        centre = message("vision_msgs/msg/Pose2D", position=point, theta=0.0)
        box = message("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
        kind = "vision_msgs/msg/Detection2D"
        found.append(message(kind, header=head, results=[], bbox=box, id=name))
    return sent(message(messages.DETECTIONS, header=head, detections=found))


def april_tag(family, number, corners):
    """A detection as apriltag_ros has it: corners from the lower left, an edge at a whole pixel."""
    points = [message("apriltag_msgs/msg/Point", x=float(x), y=float(y)) for x, y in corners]
    return message(
        "apriltag_msgs/msg/AprilTagDetection",
        family=family,
        id=number,
        hamming=0,
        goodness=0.0,
        decision_margin=50.0,
        centre=points[0],
        corners=points,
        homography=np.eye(3).ravel(),
    )


def frames(*each, t=0.0):
    """A TFMessage of (parent, frame, pose)."""
    found = []
    for parent, frame, pose in each:
        x, y, z, *turn = (float(value) for value in pose.q)
        place = message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
        rotation = message("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", turn, strict=True)))
        both = message("geometry_msgs/msg/Transform", translation=place, rotation=rotation)
        head = header(message, round(t * NANO), parent)
        kind = "geometry_msgs/msg/TransformStamped"
        found.append(message(kind, header=head, child_frame_id=frame, transform=both))
    return sent(message(messages.FRAMES, transforms=found))


def experiment(name="chapter_6_1"):
    return rs.load_scenario(rs.examples.path(name))


@pytest.fixture
def ros():
    return rs.RosMessages(rs.Controller(experiment()))


def test_joints_are_known_by_name(ros):
    """In any order, with others among them, and in parts; nothing before all are known."""
    names = list(ros.controller.scene.coordinate_names)
    q = np.arange(5) / 7
    np.testing.assert_array_equal(ros.joints(state(q[::-1], names[::-1])), q)
    np.testing.assert_array_equal(ros.joints(state([9, *q], ["gripper", *names])), q)
    some = rs.RosMessages(ros.controller, names={names[0]: "arm_0"})
    assert some.joints(state(q[1:], names[1:])) is None
    np.testing.assert_array_equal(some.joints(state(q[:1], ["arm_0"])), q)


def test_times_are_those_of_headers(ros):
    assert ros.time(state([], [], 7.25)) == 7.25 and ros.time(state([], [])) is None
    assert ros.marks(detections({}, 3.5)).t == 3.5 and ros.marks(detections({}), t=2.0).t == 2.0


def test_marks_are_known_by_name(ros):
    (sight,) = ros.controller.sights
    places = {"cube.2": (1.5, 2.5), "other": (0, 0), "cube.0": (3, 4), "cube.3": (np.nan, 1)}
    found = ros.marks(detections(places, 1.0)).pixels
    expected = [[3, 4], [np.nan] * 2, [1.5, 2.5], [np.nan] * 2]
    np.testing.assert_array_equal(found[sight.key], expected)
    assert found["other"] is None
    ids = rs.RosMessages(ros.controller, marks={"cube": ["a", "b", "c", "d"]})
    seen = ids.marks(detections({"d": (5, 6)}, 1.0)).pixels[sight.key]
    np.testing.assert_array_equal(seen, [*[[np.nan] * 2] * 3, [5, 6]])


def test_what_is_not_looked_for_is_told_by_the_controller(ros):
    run, names = experiment().run(duration=0.2), ros.controller.scene.coordinate_names
    places = {f"cube.{i}": place for i, place in enumerate(run.pixels.values[0])}
    marks = ros.marks(detections(places | {"cup": (1, 2)}, 5.0))
    q = ros.joints(state(run.q.values[0], names))
    command = ros.controller.step(marks, q, 5.0)
    np.testing.assert_array_equal(command.velocities, run.qd.values[0])
    assert command.health.unused == ("cup",)


def test_corners_of_april_tags_are_in_our_order_and_pixels():
    """pyapriltags gives the same corners as apriltag_ros; `Detector` reads them likewise."""
    tag = rs.Tag("tag36h11", 7, size=0.1)
    scene = rs.Scene(
        [rs.robots.free_camera()],
        [rs.Object(tag.name, marks=tag.marks)],
        [rs.MountedCamera("eye", rs.Camera(np.diag([500, 500, 1]) + 0), on="free_camera.body")],
    )
    controller = rs.Controller(rs.Experiment(scene, rs.IBVS(rs.Pose.at(0, 0, -1)), duration=1.0))
    ours = np.array([[10, 20], [30, 21], [31, 41], [9, 40]]) + 0.25
    theirs = ours[::-1] + 0.5
    array = message(
        messages.APRILTAGS,
        header=header(message, NANO),
        detections=[april_tag("tag36h11", 7, theirs), april_tag("tag36h11", 8, theirs)],
    )
    found = rs.RosMessages(controller).marks(sent(array)).pixels
    np.testing.assert_array_equal(found[("eye", tag.name)], ours)
    assert [name for name in found if name != ("eye", tag.name)] == [
        f"tag36h11_8.{i}" for i in range(4)
    ]


BODIES = ("visp_tutorial", "unicycle_docking", "differential_drive", "holonomic")
SAID = [
    *(("chapter_6_1", kind) for kind in (messages.NUMBERS, messages.JOINTS, messages.TRAJECTORY)),
    *((name, kind) for name in BODIES for kind in messages.TWISTS),
]


@pytest.mark.parametrize(("name", "kind"), SAID)
def test_commands_come_back_from_a_bag(name, kind, tmp_path):
    """Those of a run, said by a node and recorded, are those of the run that is read."""
    made = experiment(name)
    run = made.run(duration=0.4)
    ros = rs.RosMessages(rs.Controller(made))
    store, path = messages.typestore(), tmp_path / "bag"
    own = {*run.velocity.values} & {*ros.controller.velocity_names}
    columns = [i for i, each in enumerate(run.velocity.values) if each in own]
    with Writer(path, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {}
        for i, t in enumerate((run.time.values * NANO).round().astype(int).tolist()):
            names = list(made.scene.coordinate_names)
            now = joint_state(message, t, names, run.q.values[i], np.empty(0))
            ros.joints(now)
            eye, target = run.mark_camera.values, run.mark_target.values
            places = {f"{target[j]}.{j}": p for j, p in enumerate(run.pixels.values[i])}
            said = (
                ("/joint_states", now),
                (f"/{eye[0]}/detections", detections(places, t / NANO)),
                ("/commands", ros.command(run.qd.values[i, columns], kind)),
            )
            for topic, each in said:
                if topic not in topics:
                    topics[topic] = writer.add_connection(topic, each.__msgtype__, typestore=store)
                writer.write(topics[topic], t, store.serialize_cdr(each, each.__msgtype__))
    again = rs.open_bag(path, made, topics={"commands": "/commands"}, clock="log")
    np.testing.assert_array_equal(again.qd, run.qd)
    assert again.attrs["commands"] == "topic /commands"


def test_a_trajectory_leads_to_where_joints_will_be(ros):
    names = ros.controller.scene.coordinate_names
    other = rs.RosMessages(ros.controller, order=[*names[::-1], "gripper"])
    ros.joints(state([1, 2, 3, 4, 5], names))
    each = sent(ros.command([10, 20, 30, 40, 50], messages.TRAJECTORY, ahead=0.25))
    (point,) = each.points
    assert tuple(each.joint_names) == names and point.time_from_start.nanosec == 250_000_000
    np.testing.assert_array_equal(point.positions, [3.5, 7, 10.5, 14, 17.5])
    np.testing.assert_array_equal(point.velocities, [10, 20, 30, 40, 50])
    numbers = sent(other.command([10, 20, 30, 40, 50]))
    np.testing.assert_array_equal(numbers.data, [50, 40, 30, 20, 10, 0])
    with pytest.raises(rs.InputError, match="needs the position of joint tool"):
        other.command([1] * 5, messages.TRAJECTORY)


def test_a_twist_is_that_of_the_body():
    ros = rs.RosMessages(rs.Controller(experiment("visp_tutorial")))
    each = sent(ros.command([1, 2, 3, 4, 5, 6], messages.STAMPED)).twist
    assert [getattr(each.linear, a) for a in "xyz"] == [1, 2, 3]
    assert [getattr(each.angular, a) for a in "xyz"] == [4, 5, 6]
    drive = rs.RosMessages(rs.Controller(experiment("unicycle_docking")))
    each = sent(drive.command([0.5, -0.25], messages.TWIST))
    assert (each.linear.x, each.angular.z, each.linear.y, each.angular.x) == (0.5, -0.25, 0, 0)


def test_what_does_not_fit_is_told_in_a_line(ros):
    names = list(ros.controller.scene.coordinate_names)
    for call, words in (
        (lambda: ros.joints(state([np.nan] * 5, names, 2.5)), r"shoulder is nan, at 2.5 s"),
        (lambda: ros.joints(state([0] * 2, names[:1] * 2)), "joint shoulder is there twice"),
        (lambda: ros.joints(state([0] * 2, names)), "5 names and 2 of position"),
        (lambda: ros.joints(3), "expected a message JointState, got 3, without header"),
        (lambda: ros.marks(state([], [])), "of detections, got .*, without detections"),
        (lambda: ros.marks(detections({})), "no time of its own: give t"),
        (lambda: ros.marks(detections({}), "left"), "no camera 'left'; cameras: camera"),
        (lambda: ros.command([0] * 4), r"velocities"),
        (lambda: ros.command([0] * 5, "std_msgs/msg/Float64"), "did you mean 'std_msgs/msg/Float"),
        (lambda: ros.command([0] * 5, None), "no command of type None"),
        (lambda: ros.command([0] * 5, messages.TWIST), "commands one body .*; here are none"),
        (lambda: ros.command([0] * 5, messages.TRAJECTORY, ahead=0), "ahead"),
        (lambda: rs.RosMessages(3), "expected a Controller, got 3"),
        (lambda: rs.RosMessages(ros.controller, order=["a"]), "expected joint shoulder once"),
        (lambda: rs.RosMessages(ros.controller, order=3), "order: expected names of joints"),
        (lambda: rs.RosMessages(ros.controller, names={"rist": "a"}), "did you mean 'wrist'"),
        (lambda: rs.RosMessages(ros.controller, marks={"cube": "abcd"}), "'cube' has 4 marks"),
    ):
        with pytest.raises(rs.InputError, match=words) as raised:
            call()
        assert "\n" not in str(raised.value)
    seen = detections({"cube.0": (0, 0)}, 2.0)
    seen.detections.append(seen.detections[0])
    with pytest.raises(rs.InputError, match=r"mark 'cube.0' is there twice, at 2 s"):
        ros.marks(seen)


class Node:
    """What the example needs of a node of rclpy, with what was published and logged."""

    def __init__(self, **told):
        self.told, self.heard, self.timers = told, {}, []
        self.published, self.logged = [], []

    def declare_parameter(self, name, value):
        return SimpleNamespace(value=self.told.get(name, value))

    def create_publisher(self, kind, topic, queue):
        self.topic = topic
        return SimpleNamespace(publish=lambda each: self.published.append(sent(each)))

    def create_subscription(self, kind, topic, call, queue):
        self.heard[topic] = call

    def create_timer(self, seconds, call):
        self.timers.append(call)

    def get_logger(self):
        log = self.logged.append
        return SimpleNamespace(info=log, warning=log, error=log)

    def get_clock(self):
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=5 * NANO))


NUMBERS = {"data", "position", "velocity", "effort", "positions", "velocities", "accelerations"}


def type_of(kind):
    """Make messages of lists, as rclpy does; arrays are none of its types."""

    def make(**fields):
        assert not any(isinstance(value, np.ndarray) for value in fields.values())
        arrays = {name: np.array(fields[name]) for name in NUMBERS & fields.keys()}
        return message(kind, **fields | arrays)

    return make


@pytest.fixture
def node(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    example = importlib.import_module("ros2_node")

    def started(**told):
        found = Node(**{"scenario": str(rs.examples.path("chapter_6_1")), **told})
        return found, example.Servo(found, type_of, None, None)

    return started


def test_the_node_of_the_example_commands_what_is_simulated(node):
    run = experiment().run(duration=1.0)
    ros, _ = node(
        names=[f"{name}=arm_{name}" for name in run.coordinate.values],
        ids=["cube=a,b,c,d"],
        order=[f"arm_{name}" for name in run.velocity.values[::-1]],
        marks="/CAMERA/tags",
    )
    assert ros.topic == "/forward_velocity_controller/commands"
    for i, t in enumerate(5.0 + run.time.values):
        places = dict(zip("dcba", run.pixels.values[i][::-1], strict=True))
        ros.heard["/camera/tags"](detections(places, t))
        names = [f"arm_{name}" for name in run.coordinate.values[::-1]]
        ros.heard["/joint_states"](state(run.q.values[i][::-1], names, t))
    told = [each.data[::-1] for each in ros.published]
    np.testing.assert_array_equal(told, run.qd)
    assert ros.logged == ["moving "]


def test_the_node_follows_a_base_by_its_frames(node):
    """No joints at all: map to odom does not move, odom to base does."""
    run = experiment("unicycle_docking").run(duration=1.0)
    ros, _ = node(
        scenario=str(rs.examples.path("unicycle_docking")),
        kind=messages.TWIST,
        commands="/cmd_vel",
        frames=["world=map", "unicycle.body=base_link"],
    )
    shift = rs.Pose.at(1, 2, 0, rpy=(0, 0, 0.5))
    ros.heard["/tf_static"](frames(("map", "odom", shift)))
    for i, t in enumerate(5.0 + run.time.values):
        names = (f"{run.mark_target.values[0]}.{j}" for j in range(run.sizes["mark"]))
        places = dict(zip(names, run.pixels.values[i], strict=True))
        ros.heard[f"/{run.mark_camera.values[0]}/detections"](detections(places, t))
        x, y, theta = run.q.values[i]
        base = shift.inv() @ rs.Pose.at(x, y, 0, rpy=(0, 0, theta))
        ros.heard["/tf"](frames(("odom", "base_link", base), t=t))
    told = [(each.linear.x, each.angular.z) for each in ros.published]
    np.testing.assert_allclose(told, run.qd, atol=1e-9)


def test_frames_are_left_out_where_joints_say_where_a_body_is():
    ros = rs.RosMessages(rs.Controller(experiment("unicycle_docking")))
    moved = frames(("world", "unicycle.body", rs.Pose.at(3, 4, 0, rpy=(0, 0, 1))), t=1.5)
    assert ros.roams and ros.time(moved) == 1.5
    np.testing.assert_allclose(ros.frames(moved), [3, 4, 1], atol=1e-15)
    names = ros.controller.scene.coordinate_names
    np.testing.assert_array_equal(ros.joints(state([1, 2, 3], names)), [1, 2, 3])
    assert ros.frames(moved) is None and not ros.roams
    with pytest.raises(rs.InputError, match="expected a message TFMessage, got 3"):
        ros.frames(3)
    assert not rs.RosMessages(rs.Controller(experiment())).roams


def test_the_node_stops_the_robot_where_joints_are_silent_or_wrong(node, monkeypatch):
    run, (ros, _) = experiment().run(duration=0.2), node()
    clock = [10.0]
    monkeypatch.setattr("time.monotonic", lambda: clock[0])
    names = run.coordinate.values.tolist()
    ros.heard["/camera/detections"](
        detections({f"cube.{i}": p for i, p in enumerate(run.pixels.values[0])})
    )
    ros.heard["/joint_states"](state(run.q.values[0], names))
    np.testing.assert_array_equal(ros.published[-1].data, run.qd.values[0])
    clock[0] += 0.09
    ros.timers[0]()
    assert len(ros.published) == 1
    clock[0] += 0.02
    ros.heard["/joint_states"](state([np.nan] * 5, names))
    ros.timers[0]()
    assert not ros.published[-1].data.any() and len(ros.published) == 2
    ros.timers[0]()
    assert len(ros.published) == 2 and "shoulder is nan" in ros.logged[-1]


def test_the_node_waits_for_the_word_to_run(node, tmp_path, monkeypatch):
    path = tmp_path / "held.toml"
    text = rs.examples.path("chapter_6_1").read_text(encoding="utf-8")
    path.write_text(f"{text}\n[safety]\nhold_to_run = true\n", encoding="utf-8")
    run, (ros, _) = experiment().run(duration=0.4), node(scenario=str(path))
    clock = [10.0]
    monkeypatch.setattr("time.monotonic", lambda: clock[0])
    moved = []
    for i, word in enumerate((None, False, True, None)):
        clock[0] += 0.15
        if word is not None:
            ros.heard["/robsim/run"](SimpleNamespace(data=word))
        t = 5.0 + 0.04 * i
        seen = {f"cube.{j}": p for j, p in enumerate(run.pixels.values[0])}
        ros.heard["/camera/detections"](detections(seen, t))
        ros.heard["/joint_states"](state(run.q.values[0], run.coordinate.values.tolist(), t))
        moved.append(bool(ros.published[-1].data.any()))
    assert moved == [False, False, True, True]


def test_without_ros_it_says_what_is_needed(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    monkeypatch.setitem(__import__("sys").modules, "rclpy", None)
    with pytest.raises(SystemExit, match=r"^needs ROS 2: source /opt/ros/DISTRO/setup.bash"):
        importlib.import_module("ros2_node").main()


def test_an_april_tag_that_is_there_twice_is_told():
    scene = rs.load_scenario(rs.examples.path("visp_tutorial"))
    ros = rs.RosMessages(rs.Controller(scene))
    tag = april_tag("tag36h11", 3, np.arange(8).reshape(4, 2))
    twice = message(messages.APRILTAGS, header=header(message, NANO), detections=[tag, tag])
    with pytest.raises(rs.InputError, match=r"mark 'tag36h11_3.0' is there twice, at 1 s"):
        ros.marks(sent(twice))
