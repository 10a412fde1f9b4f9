"""A controller drives a robot in another process, over UDP on this machine.

The robot sends its joints at 500 Hz, and its camera sends images at 30 Hz that are 20 ms old, plus
or minus 10 ms; one image in twenty is lost. The controller answers each state with a command. The
same experiment is also simulated, for comparison.
"""

import select
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from udp_robot import packets

import robsim as rs

HERE = Path(__file__).parent
MARKS = [f"plate.{i}" for i in range(4)]
SILENCE = 5.0  # seconds without a state until the driver gives up
REST = (0.0,) * packets.JOINTS
FIRST = 1  # number of the first command, which answers no state


class Driver:
    """A controller that answers packets of the robot, and records its commands."""

    def __init__(self, controller):
        self.controller, self.image, self.state, self.last = controller, None, None, None
        self.refused, self.sequence, self.answered = 0, FIRST, 0
        self.times, self.errors, self.phases, self.took, self.trips = [], [], [], [], []

    def hear(self, data):
        """Store a packet: a state or an image; count it if it is invalid."""
        packet = packets.parse(data)
        if isinstance(packet, packets.State):
            if packet.sequence > max(self.answered, FIRST):
                self.trips.append(packet.round_trip)
            self.answered, self.state, self.last = packet.sequence, packet, packet
        elif isinstance(packet, packets.Image):
            self.image = packet
        else:
            self.refused += 1

    def answer(self):
        """Return the command that answers the last state."""
        state, marks = self.state, self._marks()
        begin = time.perf_counter()
        command = self.controller.step(marks, np.array(state.q), state.timestamp)
        self.took.append(time.perf_counter() - begin)
        self._note(state.timestamp, command)
        self.state, self.sequence = None, self.sequence + 1
        return packets.pack(packets.Command(self.sequence, state.timestamp, command.velocities))

    def rest(self):
        """Return the command to stand still."""
        self.sequence += 1
        return packets.pack(packets.Command(self.sequence, 0.0, REST))

    def _marks(self):
        """Return the marks of a new image with the time of the image, or None."""
        image, self.image = self.image, None
        if image is None:
            return None
        plate = {i: image.marks[name] for i, name in enumerate(MARKS) if name in image.marks}
        return rs.control.Marks({"plate": plate}, image.timestamp)

    def _note(self, t, command):
        if not self.phases or self.phases[-1][1] != command.phase:
            self.phases.append((t, command.phase))
        if command.error.size:
            self.times.append(t)
            self.errors.append(float(np.linalg.norm(command.error)))


def drive(link, driver, duration):
    """Answer the states of the robot until the controller has converged or the time is over."""
    link.send(packets.pack(packets.Command(FIRST, 0.0, REST)))
    try:
        while select.select([link], [], [], SILENCE)[0]:
            while select.select([link], [], [], 0.0)[0]:
                driver.hear(link.recv(packets.LARGEST))
            if driver.state is None:
                continue
            now = driver.state.timestamp
            link.send(driver.answer())
            if driver.phases[-1][1] == "converged" or now > duration:
                return
        raise TimeoutError(f"no state of the robot for {SILENCE:g} s")
    finally:
        link.send(driver.rest())


def driven(experiment):
    """Start the process of a robot, drive the robot, and always end the process."""
    driver = Driver(rs.Controller(experiment))
    robot = subprocess.Popen(
        [sys.executable, "-m", "udp_robot.robot"], cwd=HERE, stdout=subprocess.PIPE, text=True
    )
    try:
        port = int(robot.stdout.readline() or sys.exit("the robot did not start"))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.connect(("127.0.0.1", port))
            drive(link, driver, experiment.duration)
    finally:
        robot.kill()
        robot.communicate()
    return driver


def off(experiment, q):
    """Return the true distance in pixels of the worst mark from its goal."""
    look = experiment.scene.view
    away = look(np.array(q)).pixels - look(experiment.scene.home).pixels
    return np.abs(away).max()


def beside(what, form, *numbers):
    """Print a line of a table: a simulated and a driven value."""
    print(f"{what:18}" + "".join(f"{number:>12{form}}" for number in numbers))


def percentiles(what, seconds):
    """Print a line of a table: percentiles of times in microseconds."""
    beside(what, ".0f", *np.percentile(1e6 * np.array(seconds), [50, 90, 99, 100]))


def main():
    """Simulate, drive, and print a comparison."""
    experiment = rs.load_scenario(HERE / "udp_robot" / "arm.toml")
    run = experiment.run()
    rs.Controller(experiment).step(run.pixels.values[0], experiment.start, 0.0)  # compiles
    driver = driven(experiment)

    beside("", "", "simulated", "driven")
    for t in (0.0, 0.5, 1.0, 2.0):
        simulated = float(run.error_norm.sel(time=t, method="nearest"))
        beside(f"error after {t:g} s", ".4f", simulated, np.interp(t, driver.times, driver.errors))
    beside("converged, s", ".2f", float(run.end_time), driver.phases[-1][0])
    beside(
        "off at its end, px",
        ".2f",
        off(experiment, run.q_end.values),
        off(experiment, driver.last.q),
    )
    print("phases:", ", ".join(f"{phase} at {t:.3f} s" for t, phase in driver.phases))
    print(
        f"the robot stopped {driver.last.stops} times, and refused {driver.last.refused} packets\n"
    )
    beside("microseconds", "", "50 %", "90 %", "99 %", "most")
    percentiles("a step", driver.took)
    percentiles("state to command", driver.trips)
    assert driver.phases[-1][1] == "converged" and off(experiment, driver.last.q) < 3.0


if __name__ == "__main__":
    main()
