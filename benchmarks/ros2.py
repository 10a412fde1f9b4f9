"""The latency that the drive node adds to a bare node of rclpy, and its memory (see README.md).

python benchmarks/ros2.py [--seconds 20] [--rate 100]

A simulated cell in this process publishes marks and joints, and waits for the command; in turn to
`robsim ros2 drive`, and to a node that returns as many numbers without computing anything. Both run
at the same time in processes of their own. `--seconds 600` shows whether the memory grows.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import robsim as rs

SHARES = (50, 90, 99, 99.9, 100)
START, LATE = 60.0, 1.0  # seconds for a start, and until an answer counts as lost
WARM = 2.0  # seconds that are not counted
JOINTS, MARKS = "/joint_states", "/camera/detections"
COMMANDS = "/forward_velocity_controller/commands"
BARE = """
import rclpy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
rclpy.init()
node = rclpy.create_node("bare")
commands = node.create_publisher(Float64MultiArray, "/bare{COMMANDS}", 1)
def answer(state):
    commands.publish(Float64MultiArray(data=[0.0] * len(state.position)))
node.create_subscription(Float64MultiArray, "/bare{MARKS}", lambda message: None, 10)
node.create_subscription(JointState, "/bare{JOINTS}", answer, 10)
try:
    rclpy.spin(node)
except BaseException:
    pass
"""


def environment():
    """Return variables that keep all nodes on this machine, and among themselves."""
    domain = os.environ.get("ROS_DOMAIN_ID", "77")
    return {"ROS_DOMAIN_ID": domain, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def experiment(dt):
    """Return an arm above a plate that never rests: its pixels are noisy, and it goes on."""
    eye_in_hand = rs.load_scenario(rs.examples.path("eye_in_hand"))
    return eye_in_hand.with_(dt=dt, hold=True, sensing=rs.Sensing(noise=0.5), record="summary")


class Partner:
    """A node in another process, and the times at which it answers.

    `prefix` distinguishes its topics, `dim` are the marks by their ids.
    """

    def __init__(self, node, prefix, process):
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64MultiArray

        self.process, self.seconds, self.command, self.lost = process, [], None, 0
        self.joints = node.create_publisher(JointState, prefix + JOINTS, 1)
        self.marks = node.create_publisher(Float64MultiArray, prefix + MARKS, 1)
        node.create_subscription(Float64MultiArray, prefix + COMMANDS, self.on_command, 1)

    def on_command(self, message):
        self.command = message.data

    @property
    def ready(self):
        """Whether the partner hears both topics."""
        return self.joints.get_subscription_count() and self.marks.get_subscription_count()

    def ask(self, spin, marks, joints):
        """Return the command for marks and joints, or None if there is none in time."""
        self.command, begin = None, time.perf_counter()
        self.marks.publish(marks)
        self.joints.publish(joints)
        while self.command is None and time.perf_counter() < begin + LATE:
            spin()
        self.seconds.append(time.perf_counter() - begin)
        self.lost += self.command is None
        return self.command

    def memory(self):
        """Return the resident memory of the process in MB."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def messages(cell, start):
    """Return the marks and the joints of a cell as messages."""
    from builtin_interfaces.msg import Time
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

    stamp = start + round(cell.now.time * 1e9)
    time_of = Time(sec=stamp // 10**9, nanosec=stamp % 10**9)
    joints = JointState(name=list(cell.scene.coordinate_names), position=cell.now.measured.tolist())
    joints.header.stamp = time_of
    (pixels,) = cell.now.pixels.values()
    dim = [MultiArrayDimension(label=f"plate.{i}") for i in range(len(pixels))]
    data = [float(time_of.sec), float(time_of.nanosec), *pixels.ravel().tolist()]
    return Float64MultiArray(layout=MultiArrayLayout(dim=dim, data_offset=2), data=data), joints


def measure(seconds, rate, drive, bare):
    """Ask both in turn at a rate; return their partners, and the memory of the node by time."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    node = rclpy.create_node("benchmark")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    partners = ours, theirs = Partner(node, "", drive), Partner(node, "/bare", bare)
    limit = time.monotonic() + START
    while not all(partner.ready for partner in partners):
        if time.monotonic() > limit or None not in (drive.poll(), bare.poll()):
            raise SystemExit("a node did not start")
        executor.spin_once(timeout_sec=0.05)
    cell, begin, memory = experiment(1 / rate).cell(), time.time_ns(), []
    spin = lambda: executor.spin_once(timeout_sec=LATE)  # noqa: E731
    clock = time.perf_counter()
    for i in range(int((seconds + WARM) * rate)):
        wait = clock + i / rate - time.perf_counter()
        if wait > 0:
            time.sleep(wait)
        now = messages(cell, begin)
        for partner in partners if i % 2 else partners[::-1]:
            partner.ask(spin, *now)
        command = ours.command
        cell.advance(np.zeros(cell.columns.size) if command is None else np.array(command))
        if i % rate == 0:
            memory.append(ours.memory())
    return ours, theirs, memory


def line(name, seconds):
    """Print the percentiles of some times in milliseconds."""
    print(f"{name:34}" + "".join(f"{x:9.3f}" for x in 1e3 * np.percentile(seconds, SHARES)))


def report(ours, theirs, memory, rate):
    """Print the times of both nodes, the added time, and the memory."""
    skipped = int(WARM * rate)
    drive, bare = (np.array(each.seconds[skipped:]) for each in (ours, theirs))
    print(f"{'milliseconds':34}" + "".join(f"{share:>8}%" for share in SHARES))
    line("bare rclpy, there and back", bare)
    line("robsim ros2 drive", drive)
    added = np.median(drive) - np.median(bare)
    print(f"added: {1e3 * added:.3f} ms (median); lost answers: {ours.lost} and {theirs.lost}")
    half = len(memory) // 2
    print(
        f"memory of the node: {memory[int(WARM)]:.1f} MB after {WARM:g} s, {memory[half]:.1f} MB "
        f"after {half} s, {memory[-1]:.1f} MB after {len(memory)} s"
    )


def main():
    """Start both nodes, measure, and stop them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=20.0, help="how long (20)")
    parser.add_argument("--rate", type=int, default=100, help="joint states per second (100)")
    told = parser.parse_args()
    os.environ.update(environment())
    import rclpy

    rclpy.init()
    names = {"{JOINTS}": JOINTS, "{MARKS}": MARKS, "{COMMANDS}": COMMANDS}
    code = BARE
    for name, topic in names.items():
        code = code.replace(name, topic)
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell.toml"
        cell.write_text(experiment(1 / told.rate).to_toml(), encoding="utf-8")
        quiet = {"stdout": subprocess.DEVNULL}
        commands = [["-m", "robsim", "ros2", "drive", cell], ["-c", code]]
        nodes = [subprocess.Popen([sys.executable, *each], **quiet) for each in commands]
        try:
            report(*measure(told.seconds, told.rate, *nodes), told.rate)
        finally:
            for each in nodes:
                each.send_signal(signal.SIGINT)
            for each in nodes:
                each.wait(START)
            rclpy.shutdown()


if __name__ == "__main__":
    main()
