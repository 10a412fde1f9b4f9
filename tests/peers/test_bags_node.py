"""The node of the example, between topics that are none of ROS."""

import importlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from bagging import NANO, detections, frames, serialise, state

import robsim as rs
from robsim.logs import message_types
from robsim.logs.message_types import make_message

ROOT = Path(__file__).parents[2]


def experiment(name="chapter_6_1"):
    return rs.load_scenario(rs.examples.path(name))


class Node:
    """A stand-in for the node of rclpy in the example, with its publications and its log."""

    def __init__(self, **told):
        self.told, self.heard, self.timers = told, {}, []
        self.published, self.logged = [], []

    def declare_parameter(self, name, value):
        return SimpleNamespace(value=self.told.get(name, value))

    def create_publisher(self, kind, topic, queue):
        self.topic = topic
        return SimpleNamespace(publish=lambda each: self.published.append(serialise(each)))

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
        return make_message(kind, **fields | arrays)

    return make


@pytest.fixture
def node(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    example = importlib.import_module("ros2_node")

    def started(**told):
        found = Node(**{"scenario": str(rs.examples.path("chapter_6_1")), **told})
        return found, example.Servo(found, type_of, None, None)

    return started


def test_the_commands_of_the_example_node_equal_the_simulated_ones(node):
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
        kind=message_types.TWIST,
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


def test_without_ros_it_names_the_missing_packages(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    monkeypatch.setitem(__import__("sys").modules, "rclpy", None)
    with pytest.raises(SystemExit, match=r"^needs ROS 2: source /opt/ros/DISTRO/setup.bash"):
        importlib.import_module("ros2_node").main()
