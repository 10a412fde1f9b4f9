"""How fast a call of fk, jacobian, ik and closed_ik is, alone and in batches (see README.md).

A plain compiled loop over the same products of constants and rotations is the measure of batches.
Single calls are timed in windows of a millisecond or so, and the quickest counts: then other
programs on the machine disturb least. For batches, processor time counts.
"""

import argparse
import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import arms
import numba
import numpy as np
from ik import busy
from speed import best

import robsim as rs

HERE = Path(__file__).parent
SMALL, LARGE = 1_000, 1_000_000
WINDOWS = 400


def least(call: Callable[[], object]) -> float:
    """Least seconds of a call, by the mean of short windows."""
    start = time.perf_counter()
    call()
    count = max(1, round(1e-3 / (time.perf_counter() - start)))
    return best(lambda: [call() for _ in range(count)], WINDOWS) / count


@numba.njit(error_model="numpy")
def plain(constants, q, out):
    """Poses out[run, 4, 4] = C0 Rz(q1) C1 Rz(q2) ... Cn as one writes it down, run by run."""
    for b in range(q.shape[0]):
        T = constants[0].copy()
        for i in range(q.shape[1]):
            c, s, C = np.cos(q[b, i]), np.sin(q[b, i]), constants[i + 1]
            for r in range(3):
                x, y = c * T[r, 0] + s * T[r, 1], c * T[r, 1] - s * T[r, 0]
                z, p = T[r, 2], T[r, 3]
                for k in range(4):
                    T[r, k] = x * C[0, k] + y * C[1, k] + z * C[2, k] + (p if k == 3 else 0.0)
        out[b] = T


def batches(robot: rs.Robot) -> dict[str, float]:
    """Seconds per configuration of batches, ours and the plain loop's."""
    found, constants = {}, arms.constants(robot)
    for count in (SMALL, LARGE):
        q = np.random.default_rng(0).uniform(-1.0, 1.0, (count, robot.nq))
        calls = {
            "fk": lambda q=q: robot.fk(q),
            "jacobian": lambda q=q: robot.jacobian(q),
            "plain": lambda q=q: plain(constants, q, np.empty((len(q), 4, 4))),
        }
        for name, call in calls.items():
            call()
            found[f"{name} {count}"] = busy(call, max(9, 200_000 // count)) / count
    out = np.empty((LARGE, 4, 4))
    plain(constants, q, out)
    if np.abs(out - robot.fk(q)).max() > 1e-12:
        raise SystemExit("the plain loop has another arm")
    return found


def singles(robot: rs.Robot) -> dict[str, float]:
    """Seconds of single calls: a pose near home, and random ones within the limits for `ik`."""
    q = np.array(robot.home) + 0.1
    T, far = robot.fk(q), arms.poses(robot, 100)
    found = {
        "fk": least(lambda: robot.fk(q)),
        "jacobian": least(lambda: robot.jacobian(q)),
        "ik": least(lambda: robot.ik(T)),
        "ik far": best(lambda: [robot.ik(pose) for pose in far], 20) / len(far),
    }
    try:
        found["closed_ik"] = least(lambda: robot.closed_ik(T))
    except rs.errors.InputError:
        return found  # no closed form
    return found


def peers(python: str, robot: rs.Robot) -> dict[str, dict[str, float]]:
    """The time of other programs for single calls with the same arm, by their own Python."""
    with tempfile.TemporaryDirectory() as folder:
        file, q = Path(folder) / "arm.npz", np.array(robot.home) + 0.1
        constants, far = arms.constants(robot), arms.poses(robot, 100)
        np.savez(file, constants=constants, limits=robot.limits, home=robot.home, q=q, poses=far)
        call = [python, HERE / "peer_kinematics.py", file]
        done = subprocess.run(call, capture_output=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print a table for each arm."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", help="a Python that has pin, roboticstoolbox-python or EAIK")
    python = parser.parse_args().peer
    for name in ("puma560", "rhino_xr4", "ur5e", "panda"):
        robot = rs.robots.load(name)
        alone = singles(robot)
        told = ", ".join(f"{what} {1e6 * seconds:.1f}" for what, seconds in alone.items())
        print(f"{name}: us for one: {told}")
        many = batches(robot)
        for what in ("fk", "jacobian"):
            small, large = (many[f"{what} {count}"] for count in (SMALL, LARGE))
            print(
                f"    {what} of many: {1e9 * small:.0f} ns of {SMALL}, {1e9 * large:.0f} of "
                f"{LARGE}, {large / small:.2f} times; {small / many[f'plain {SMALL}']:.2f} and "
                f"{large / many[f'plain {LARGE}']:.2f} times the plain loop of poses"
            )
        for who, theirs in (peers(python, robot) if python else {}).items():
            both = {what: seconds for what, seconds in theirs.items() if what in alone}
            ratios = (f"{k} {1e6 * s:.1f} us, ratio {s / alone[k]:.2f}" for k, s in both.items())
            print(f"    {who}: {'; '.join(ratios) or 'nothing of the kind'}")


if __name__ == "__main__":
    main()
