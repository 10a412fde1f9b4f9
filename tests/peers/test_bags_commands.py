"""Commands in bags that are no commands, or of something else: a line each."""

import numpy as np
import pytest
from bagging import NANO, write_bag

import robsim as rs
from robsim.logs import message_types
from robsim.logs.bag_files import TimedMessage
from robsim.logs.command_messages import make_header, make_trajectory, make_twist
from robsim.logs.command_reader import CommandReader
from robsim.logs.message_types import make_message
from robsim.logs.twists import twist_components


def controller(name):
    return rs.Controller(rs.load_scenario(rs.examples.path(name)))


def read(name, kind, *each):
    """The commands of some messages, and the commanded joints that the scene does not have."""
    commands = CommandReader(controller(name), kind, {})
    stream = commands.stream(
        "topic /told", [TimedMessage(i * NANO, one) for i, one in enumerate(each)]
    )
    return None if stream is None else stream.values, list(commands.others)


def twisted(**parts):
    """A Twist of components such as linear_y."""
    found = make_twist(make_message, np.zeros(0), ())
    for name, value in parts.items():
        of, axis = name.split("_")
        setattr(getattr(found, of), axis, value)
    return found


def stamped(frame, **parts):
    return make_message(
        message_types.STAMPED, header=make_header(make_message, 0, frame), twist=twisted(**parts)
    )


def streamed(names, velocity, count=1):
    now = make_trajectory(make_message, names, np.zeros(len(names)), np.zeros(len(names)), 0)
    now.points[0].velocities, now.points = np.array(velocity), now.points * count
    return now


def test_motion_that_a_body_cannot_execute_is_left_out_and_named():
    values, others = read(
        "unicycle_docking",
        message_types.TWIST,
        twisted(linear_x=0.5, linear_z=1.0, angular_z=-0.25),
    )
    assert values.tolist() == [[0.5, -0.25]] and others == ["linear.z of topic /told"]


def test_a_twist_of_a_mobile_arm_agrees_with_its_base():
    values, others = read("mobile_arm", message_types.TWIST, twisted(linear_y=0.5, angular_z=1.0))
    names = controller("mobile_arm").scene.velocity_names
    assert {n: v for n, v in zip(names, values[0], strict=True) if v} == {
        "body.vy": 0.5,
        "body.omega": 1.0,
    }
    assert others == []


def test_a_trajectory_without_points_is_a_stop_and_a_joint_that_is_not_named_goes_on():
    names = controller("chapter_6_1").scene.velocity_names
    values, others = read(
        "chapter_6_1",
        message_types.TRAJECTORY,
        streamed([*names[::-1], "gripper"], [5, 4, 3, 2, 1, 9]),
        streamed(names[:2], [7, 8]),
        streamed(names[1:], [0] * 4, count=0),
    )
    assert values.tolist() == [[1, 2, 3, 4, 5], [7, 8, 3, 4, 5], [7, 0, 0, 0, 0]]
    assert others == ["joint gripper"]


NAMES = ["shoulder", "wrist"]
REFUSED = {
    "a plan": ("chapter_6_1", message_types.TRAJECTORY, lambda: streamed(NAMES, [1, 2], count=2),
               "a trajectory of 2 points, at 0 s; commands have one"),
    "no velocity": ("chapter_6_1", message_types.TRAJECTORY, lambda: streamed(NAMES, []),
                    "2 names but 0 velocit"),
    "nan": ("chapter_6_1", message_types.TRAJECTORY, lambda: streamed(NAMES, [1, np.nan]),
            "velocity of joint wrist is nan, at 0 s"),
    "world": ("visp_tutorial", message_types.STAMPED, lambda: stamped("map", linear_x=1.0),
              "a twist in 'map', at 0 s; expected axes of the body"),
    "nan twist": ("visp_tutorial", message_types.STAMPED, lambda: stamped("", angular_x=np.nan),
                  "topic /told: nan, at 0 s"),
    "no body": ("chapter_6_1", message_types.TWIST, twisted, "one body .*; the scene has none"),
    "fewer": ("chapter_6_1", message_types.NUMBERS,
              lambda: make_message(message_types.NUMBERS, layout=None, data=np.zeros(3)),
              "3 numbers, at 0 s; 5 are commanded"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_an_invalid_command_is_reported_in_a_line(case):
    name, kind, made, words = REFUSED[case]
    with pytest.raises(rs.errors.InputError, match=words) as raised:
        read(name, kind, made())
    assert "\n" not in str(raised.value)


def test_the_parts_of_twists():
    assert twist_components(["a.vx", "a.wz"]) == (("linear", "x", 0), ("angular", "z", 1))
    with pytest.raises(rs.errors.InputError, match="the scene has a, b"):
        twist_components(["a.v", "b.omega"])


def test_a_bag_of_joints_without_commands_in_the_scene_is_named(tmp_path):
    made = rs.load_scenario(rs.examples.path("chapter_6_1"))
    rs.logs.write_bag(made.run(duration=0.2), tmp_path / "run.mcap")
    told = [("/cmd_vel", message_types.TWIST, 0, twisted(linear_x=1.0))]
    path = write_bag(tmp_path / "bag", told)
    (tmp_path / "run.mcap").rename(path / "run_1.mcap")
    with pytest.raises(rs.errors.InputError, match=f"{path}: a Twist commands one body"):
        rs.logs.read_bag(path, topics={"commands": "/cmd_vel"})
