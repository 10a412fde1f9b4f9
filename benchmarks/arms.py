"""Arms for the benchmark of inverse kinematics, and what another program needs to build them."""

import numpy as np

import robsim as rs

HALF = np.pi / 2


def ur5e() -> rs.Robot:
    """Universal Robots UR5e: standard DH of the maker's support pages, limits of its manual."""
    d = [0.1625, 0, 0, 0.1333, 0.0997, 0.0996]
    a = [0, -0.425, -0.3922, 0, 0, 0]
    alpha = [HALF, 0, 0, HALF, -HALF, 0]
    span = np.array([2, 2, 1, 2, 2, 2]) * np.pi
    home = np.radians([0, -90, 90, -90, -90, 0])
    return _arm("ur5e", d, a, alpha, span, home)


def iiwa14() -> rs.Robot:
    """KUKA LBR iiwa 14 R820: link lengths and limits of its data sheet."""
    d, alpha = [0.36, 0, 0.42, 0, 0.4, 0, 0.126], np.radians([-90, 90, 90, -90, -90, 90, 0])
    span = np.radians([170, 120, 170, 120, 170, 120, 175])
    home = np.radians([0, 30, 0, -60, 0, 60, 0])
    return _arm("iiwa14", d, np.zeros(7), alpha, span, home)


def _arm(name, d, a, alpha, span, home) -> rs.Robot:
    rows = np.column_stack([np.zeros(len(d)), d, a, alpha])
    limits = np.column_stack([-span, span])
    return rs.Robot.from_dh(rows, name=name, limits=limits, home=home)


def arms() -> list[rs.Robot]:
    """Those of the benchmark."""
    return [rs.robots.puma560(), rs.robots.panda(), ur5e(), iiwa14()]


def poses(robot: rs.Robot, count: int, seed: int = 0) -> np.ndarray:
    """That random coordinates within the limits reach."""
    low, high = robot.limits.T
    q = np.random.default_rng(seed).uniform(low, high, (count, robot.nq))
    return robot.fk(q)


def constants(robot: rs.Robot) -> np.ndarray:
    """(n + 1, 4, 4) with T = C0 Rz(q1) C1 Rz(q2) ... Cn: all that an arm of revolute joints is."""
    found = [np.eye(4)]
    for link in robot.links[1:]:
        found[-1] = found[-1] @ link.joint.place.matrix
        if link.joint.kind == "revolute":
            found.append(np.eye(4))
        found[-1] = found[-1] @ link.joint.tail.matrix
    return np.array(found)
