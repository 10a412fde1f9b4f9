"""Messages that command velocities, for the message classes of rclpy or rosbags."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.logs import message_types
from robsim.logs.twists import TwistComponent
from robsim.run.log import NANO

NONE = make_read_only(np.empty(0))
# Make(type, field=...) returns a message, as `message_types.make_message`
MakeMessage = Callable[..., message_types.Message]


def make_header(make: MakeMessage, time: int, frame: str = "") -> message_types.Message:
    """Return the header of a message at a time in nanoseconds."""
    stamp = make("builtin_interfaces/msg/Time", sec=time // NANO, nanosec=time % NANO)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def make_joint_state(
    make: MakeMessage,
    time: int,
    names: Sequence[str],
    position: Array,
    velocity: Array,
    effort: Array = NONE,
) -> message_types.Message:
    """Return coordinates, velocities or efforts (n,) as JointState; absent ones are empty."""
    parts = {"position": position, "velocity": velocity, "effort": effort}
    return make(message_types.JOINTS, header=make_header(make, time), name=list(names), **parts)


def make_number_array(make: MakeMessage, velocity: Array) -> message_types.Message:
    """Return velocities (n,) as Float64MultiArray."""
    layout = make("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
    return make(message_types.NUMBERS, layout=layout, data=velocity)


def make_trajectory(
    make: MakeMessage, names: Sequence[str], position: Array, velocity: Array, ahead: int
) -> message_types.Message:
    """Return a JointTrajectory with one point: the positions of the joints after `ahead` ns.

    The trajectory begins at once, at the positions (n,), and has constant velocities (n,).
    """
    after = make("builtin_interfaces/msg/Duration", sec=ahead // NANO, nanosec=ahead % NANO)
    point = make(
        "trajectory_msgs/msg/JointTrajectoryPoint",
        positions=position + velocity * (ahead / NANO),
        velocities=velocity,
        accelerations=np.empty(0),
        effort=np.empty(0),
        time_from_start=after,
    )
    start = make_header(make, 0)  # zero: now
    return make(message_types.TRAJECTORY, header=start, joint_names=list(names), points=[point])


def make_twist(
    make: MakeMessage, velocity: Array, parts: Sequence[TwistComponent]
) -> message_types.Message:
    """Return velocities as Twist; `parts` are the components of the twist with their indices."""
    values = {of: dict.fromkeys("xyz", 0.0) for of in ("linear", "angular")}
    for each in parts:
        values[each.of][each.axis] = float(velocity[each.column])
    vectors = {of: make("geometry_msgs/msg/Vector3", **xyz) for of, xyz in values.items()}
    return make(message_types.TWIST, **vectors)
