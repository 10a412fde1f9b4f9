"""A robot in its own process: `python -m udp_robot.robot` prints the port of its socket.

It integrates velocities at 500 Hz, sends its state each time, and stops if no command has arrived
for 0.1 s. Its camera follows the experiment, but images arrive up to 10 ms earlier or later.
"""

import heapq
import select
import socket
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from udp_robot import packets

import robsim as rs

SCENARIO = Path(__file__).with_name("arm.toml")
PATIENCE = 0.1  # seconds without a command until the robot stops
JITTER = 0.01  # seconds by which images arrive earlier or later
LIFE = 30.0  # seconds until the robot ends in any case


class Robot:
    """The robot and its camera, advanced to given times in seconds."""

    def __init__(self, experiment: rs.Experiment, seed: int = 0) -> None:
        self.scene, self.sensing, self.dt = experiment.scene, experiment.sensing, experiment.dt
        self.q, self.qd = experiment.start.copy(), np.zeros(packets.JOINTS)
        self.rng = np.random.default_rng(seed)
        self.now = self.looks = self.heard = 0.0
        self.command = packets.Command(0, 0.0, (0.0,) * packets.JOINTS)
        self.round_trip, self.refused, self.stops = 0.0, 0, 0
        self.under_way: list[tuple[float, int, packets.Image]] = []
        self.images = 0

    def hear(self, data: bytes, now: float) -> None:
        """Store a command; count and ignore invalid packets and older commands."""
        command = packets.parse(data)
        if not isinstance(command, packets.Command) or command.sequence <= self.command.sequence:
            self.refused += 1
            return
        self.command, self.heard = command, now
        self.round_trip = now - command.answers
        self.qd = np.array(command.qd)

    def advance(self, now: float) -> None:
        """Move until a time, and take the images that are due."""
        while self.now + self.dt <= now + 1e-9:
            if self.now - self.heard > PATIENCE and self.qd.any():
                self.qd, self.stops = np.zeros(packets.JOINTS), self.stops + 1
            if self.now >= self.looks:
                self._look()
                self.looks += self.sensing.period
            self.q, self.now = self.q + self.dt * self.qd, self.now + self.dt

    def _look(self) -> None:
        """Take an image, which arrives later or is lost."""
        self.images += 1
        if self.rng.random() < self.sensing.dropped:
            return
        pixels = self.scene.view(self.q).pixels
        pixels = pixels + self.sensing.noise * self.rng.normal(size=pixels.shape)
        marks = {f"plate.{i}": tuple(place) for i, place in enumerate(pixels.tolist())}
        due = self.now + self.sensing.latency + self.rng.uniform(-JITTER, JITTER)
        heapq.heappush(self.under_way, (due, self.images, packets.Image(self.now, marks)))

    def says(self) -> list[bytes]:
        """Return the packets to send now: the images that are due, and the state."""
        said = []
        while self.under_way and self.under_way[0][0] <= self.now:
            said.append(packets.pack(heapq.heappop(self.under_way)[-1]))
        heard = self.command.sequence, self.round_trip, self.refused, self.stops
        state = packets.State(self.now, tuple(self.q), tuple(self.qd), *heard)
        return [*said, packets.pack(state)]


def serve(link: socket.socket, robot: Robot) -> None:
    """Run a robot in real time until its controller is gone."""
    first, sender = link.recvfrom(packets.LARGEST)  # the first sender is the controller
    link.connect(sender)
    link.setblocking(False)
    start = time.perf_counter()
    robot.hear(first, 0.0)
    while (now := time.perf_counter() - start) < LIFE:
        if select.select([link], [], [], max(robot.now + robot.dt - now, 0.0))[0]:
            while (data := _received(link)) is not None:
                robot.hear(data, time.perf_counter() - start)
        now = time.perf_counter() - start
        if now >= robot.now + robot.dt:
            robot.advance(now)
            for each in robot.says():
                link.send(each)


def _received(link: socket.socket) -> bytes | None:
    """Return the next waiting packet, or None."""
    with suppress(BlockingIOError):
        return link.recv(packets.LARGEST)
    return None


def main() -> None:
    """Wait for a controller at a loopback port, and serve it."""
    robot = Robot(rs.load_scenario(SCENARIO))
    robot.scene.view(robot.q)  # compiles, before any clock runs
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.settimeout(LIFE)
        print(link.getsockname()[1], flush=True)
        with suppress(ConnectionError, TimeoutError):  # the controller is gone, or never came
            serve(link, robot)


if __name__ == "__main__":
    main()
