"""The played cell or the driving node is killed, and another takes its place."""

import signal

import numpy as np
from ros_cells import ACCELERATION, DT, MOVES, JointMotion
from ros_processes import wait_until


def test_either_side_is_killed_and_started_again(braking_cell, robsim, listener):
    path = braking_cell[1]
    motion = JointMotion(listener)
    play = robsim("ros2", "play", path)
    wait_until(motion.count, "states")  # the discovery of a node may take longer than a motion
    drive = robsim("ros2", "drive", path)
    wait_until(lambda: motion.speed() > MOVES, "motion")

    since, line = motion.count(), play.mark()
    drive.finish(signal.SIGKILL)
    play.wait_for("no command", since=line)
    wait_until(lambda: motion.speed() == 0.0, "rest")
    changes = np.abs(np.diff(motion.velocities(since), axis=0))
    assert changes.max() <= 1.01 * ACCELERATION * DT
    drive = robsim("ros2", "drive", path)
    wait_until(lambda: motion.speed() > 0.0, "motion by a new node")  # slower, nearer to the goal

    line = drive.mark()
    play.finish(signal.SIGKILL)
    drive.wait_for("joint", since=line)
    since = motion.count()
    robsim("ros2", "play", path)
    wait_until(lambda: motion.count() > since + 5 and motion.speed() > 0.0, "motion again")
