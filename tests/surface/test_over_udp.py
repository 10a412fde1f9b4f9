"""The example of a robot that is another process: its packets, and its loop on a clock of ours."""

import struct
from pathlib import Path

import numpy as np
import pytest

import robsim as rs

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def parts(monkeypatch):
    """The modules of the example: its driver, its packets and its robot."""
    monkeypatch.syspath_prepend(EXAMPLES)
    import drive_over_udp
    from udp_robot import packets, robot

    return drive_over_udp, packets, robot


@pytest.fixture
def experiment():
    return rs.load_scenario(EXAMPLES / "udp_robot" / "arm.toml")


def each_kind(packets):
    joints = tuple(np.linspace(-1.0, 1.0, 6))
    return (
        packets.State(1.25, joints, joints[::-1], 7, 0.001, 2, 1),
        packets.Command(2**32 - 1, 0.125, joints),
        packets.Image(0.5, {"plate.0": (1.5, -2.5), "plate.3": (3.0, 4.0)}),
        packets.Image(0.5, {}),
    )


def test_packets_are_the_same_there_and_back(parts):
    _, packets, _ = parts
    for packet in each_kind(packets):
        assert packets.parse(packets.pack(packet)) == packet


def test_a_header_has_the_size_in_big_endian(parts):
    _, packets, _ = parts
    data = packets.pack(packets.Command(3, 0.5, (1.0, 0, 0, 0, 0, 0)))
    assert data[:3] == b"\0\x3fV" and len(data) == 0x3F
    assert struct.unpack(">Id6d", data[3:]) == (3, 0.5, 1.0, 0, 0, 0, 0, 0)


def test_an_invalid_packet_is_none(parts):
    _, packets, _ = parts
    for packet in each_kind(packets):
        data = packets.pack(packet)
        for size in range(len(data)):
            assert packets.parse(data[:size]) is None
        assert packets.parse(data + b"\0") is None
        assert packets.parse(data[:2] + b"?" + data[3:]) is None
    assert packets.parse(packets.pack(packets.Command(1, np.nan, (0.0,) * 6))) is None
    assert packets.parse(packets.pack(packets.Image(0.0, {"plate.0": (np.inf, 0.0)}))) is None
    image = packets.pack(packets.Image(0.0, {"plate.0": (0.0, 0.0)}))
    assert packets.parse(image.replace(b"plate", b"pl\xffte")) is None
    rng = np.random.default_rng(0)
    for size in rng.integers(0, 200, 500):
        assert packets.parse(rng.bytes(size)) is None


def test_an_invalid_packet_is_counted_and_moves_nothing(parts, experiment):
    driver, packets, robot = parts
    arm = robot.Robot(experiment)
    arm.hear(packets.pack(packets.Command(2, 0.0, (0.1,) * 6)), 0.0)
    for data in (
        b"",
        b"garbage",
        arm.says()[-1],
        packets.pack(packets.Command(1, 0.0, (9.0,) * 6)),
    ):
        arm.hear(data, 0.0)
    assert arm.refused == 4 and arm.qd.tolist() == [0.1] * 6
    ours = driver.Driver(rs.Controller(experiment))
    ours.hear(b"garbage")
    assert ours.refused == 1 and ours.state is None


def test_a_robot_that_hears_nothing_stops(parts, experiment):
    _, packets, robot = parts
    arm = robot.Robot(experiment)
    arm.hear(packets.pack(packets.Command(1, 0.0, (0.1,) * 6)), 0.0)
    arm.advance(1.0)
    moved = arm.q - experiment.start
    np.testing.assert_allclose(moved, 0.1 * robot.PATIENCE, atol=0.11 * experiment.dt)
    assert arm.stops == 1 and not arm.qd.any()


def talk(parts, experiment, duration, answers=lambda i: True):
    """Let driver and robot talk without a network, on a clock of ours."""
    driver, _, robot = parts
    arm, ours = robot.Robot(experiment), driver.Driver(rs.Controller(experiment))
    for i in range(round(duration / experiment.dt)):
        arm.advance(i * experiment.dt)
        for data in arm.says():
            ours.hear(data)
        command = ours.answer()
        if answers(i):
            arm.hear(command, i * experiment.dt)
        if ours.phases[-1][1] == "converged":
            break
    return arm, ours


def test_the_loop_agrees_with_the_simulation(parts, experiment):
    """Images come at other times, with other noise: the errors differ by some of their delay."""
    run = experiment.run()
    arm, ours = talk(parts, experiment, experiment.duration)
    assert [phase for _, phase in ours.phases] == ["waiting", "moving", "converged"]
    assert abs(ours.phases[-1][0] - float(run.end_time)) < 0.3
    for t in (0.0, 0.5, 1.0, 2.0):
        simulated = float(run.error_norm.sel(time=t, method="nearest"))
        assert np.interp(t, ours.times, ours.errors) == pytest.approx(simulated, rel=0.15)
    assert parts[0].off(experiment, arm.q) < 2.0 and arm.refused == arm.stops == 0


def test_commands_that_are_lost_only_slow_it_down(parts, experiment):
    arm, ours = talk(parts, experiment, 6.0, answers=lambda i: i % 150 < 60)
    assert arm.stops > 3 and ours.errors[-1] < 0.1 * ours.errors[0]
