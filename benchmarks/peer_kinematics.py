"""How long Pinocchio, the Robotics Toolbox and EAIK take for single calls; those that are there.

Run it with a Python of its own: `pip install pin roboticstoolbox-python EAIK`. Its argument is a
file that benchmarks/kinematics.py wrote: an arm's constants, T = C0 Rz(q1) C1 Rz(q2) ... Cn, and
coordinates. Prints one line of JSON, seconds by program and call, named as ours.
"""

import contextlib
import json
import sys
import time
from collections.abc import Callable

import numpy as np

WINDOWS = 400


def least(call: Callable[[], object], windows: int = WINDOWS) -> float:
    """Least seconds of a call, by the mean of short windows."""
    call()
    times = []
    for _ in range(windows):
        start = time.perf_counter()
        for _ in range(20):
            call()
        times.append((time.perf_counter() - start) / 20)
    return min(times)


def expected(given: dict[str, np.ndarray]) -> np.ndarray:
    """The pose at the coordinates, by plain products."""
    T = given["constants"][0]
    for angle, C in zip(given["q"], given["constants"][1:], strict=True):
        Rz = np.eye(4)
        Rz[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        T = T @ Rz @ C
    return T


def check(who: str, T: np.ndarray, given: dict[str, np.ndarray]) -> None:
    """Stop unless the other program has the same arm."""
    if np.abs(np.asarray(T) - expected(given)).max() > 1e-9:
        raise SystemExit(f"{who} has another arm")


def pinocchio(given: dict[str, np.ndarray]) -> dict[str, float]:
    """Poses and Jacobians in the axes of the base, of a frame behind the last joint."""
    import pinocchio as pin

    model, parent, q = pin.Model(), 0, given["q"]
    for i, C in enumerate(given["constants"][:-1]):
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(C), f"joint{i}")
    place = pin.SE3(given["constants"][-1])
    frame = model.addFrame(pin.Frame("tip", parent, place, pin.FrameType.OP_FRAME))
    data, axes = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def fk() -> np.ndarray:
        pin.framesForwardKinematics(model, data, q)
        return data.oMf[frame].homogeneous

    check("Pinocchio", fk(), given)
    jacobian = lambda: pin.computeFrameJacobian(model, data, q, frame, axes)  # noqa: E731
    return {"fk": least(fk), "jacobian": least(jacobian)}


def toolbox(given: dict[str, np.ndarray]) -> dict[str, float]:
    """The compiled parts of roboticstoolbox-python; ik from home, to 1e-8."""
    from roboticstoolbox import ET, ETS

    parts = [ET.SE3(given["constants"][0])]
    for C, span in zip(given["constants"][1:], given["limits"], strict=True):
        parts += [ET.Rz(qlim=span), ET.SE3(C)]
    chain, q = ETS(parts), given["q"]
    check("roboticstoolbox-python", chain.eval(q), given)
    T = np.asarray(chain.eval(q))
    found = {"fk": least(lambda: chain.eval(q)), "jacobian": least(lambda: chain.jacob0(q))}
    if len(q) >= 6:
        found["ik"] = least(lambda: chain.ik_LM(T, q0=given["home"], tol=5e-17))
        one = lambda: [chain.ik_LM(P, q0=given["home"], tol=5e-17) for P in given["poses"]]  # noqa: E731
        found["ik far"] = least(one, 2) / len(given["poses"])
    return found


def eaik(given: dict[str, np.ndarray]) -> dict[str, float]:
    """All solutions of one pose, of arms that have no more joints than a pose needs."""
    from eaik.IK_HP import HPRobot

    if len(given["q"]) > 6:
        return {}
    T, axes, points = given["constants"][0], [], []
    for C in given["constants"][1:]:
        axes.append(T[:3, 2])
        points.append(T[:3, 3])
        T = T @ C
    offsets = np.diff([np.zeros(3), *points, T[:3, 3]], axis=0)
    robot = HPRobot(np.array(axes), offsets)
    if not robot.hasKnownDecomposition():
        return {}
    goal = expected(given)
    goal[:3, :3] = goal[:3, :3] @ T[:3, :3].T  # its tool has the axes of the base at q = 0
    found = robot.IK(goal)
    if np.abs(robot.fwdKin(found.Q[0]) - goal).max() > 1e-6:
        raise SystemExit("EAIK has another arm")
    return {"closed_ik": least(lambda: robot.IK(goal))}


def main() -> None:
    given = dict(np.load(sys.argv[1]))
    report = {}
    for call in (pinocchio, toolbox, eaik):
        with contextlib.suppress(ImportError):
            report[call.__name__] = call(given)
    print(json.dumps(report))


if __name__ == "__main__":
    main()
