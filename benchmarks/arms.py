"""Arms for the benchmark of inverse kinematics, and the data to build them in other programs."""

import numpy as np

import robsim as rs


def arms() -> list[rs.Robot]:
    """The arms of the benchmark."""
    return [rs.robots.load(name) for name in ("puma560", "panda", "ur5e", "lbr_iiwa14")]


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
