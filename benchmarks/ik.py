"""How fast inverse kinematics is, as ratios measured in one run (see README.md).

With one thread it is processor time that is compared, which other programs on the machine disturb
less.
"""

import argparse
import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import arms
import numpy as np
from speed import best

import robsim as rs

HERE = Path(__file__).parent
POSES = 10_000


def busy(call: Callable[[], object], repeats: int = 5) -> float:
    """Least seconds of processor time of several calls."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def peer(python: str, robot: rs.Robot, poses: np.ndarray) -> dict[str, dict[str, float]]:
    """The same arm, limits and poses with roboticstoolbox-python, by its own Python."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "arm.npz"
        np.savez(
            file,
            constants=arms.constants(robot),
            limits=robot.limits,
            home=robot.home,
            at_home=robot.fk(robot.home),
            poses=poses,
        )
        call = [python, HERE / "peer_rtb.py", file]
        done = subprocess.run(call, capture_output=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", help="a Python that has roboticstoolbox-python")
    python = parser.parse_args().peer
    print(f"{POSES} poses of random coordinates within the limits, to 1e-8 m and rad, from home")
    for robot in arms.arms():
        poses = arms.poses(robot, POSES)
        found = robot.ik(poses)
        one = busy(lambda: robot.ik(poses, threads=1)) / POSES  # noqa: B023
        two = best(lambda: robot.ik(poses, threads=2)) / POSES  # noqa: B023
        single = busy(lambda: [robot.ik(T) for T in poses[:100]]) / 100  # noqa: B023
        print(
            f"{robot.name:8} solved {100 * found.success.mean():6.2f} %, "
            f"{found.iterations.mean():.1f} iterations, {found.restarts.mean():.2f} restarts "
            f"(at most {found.restarts.max()}); {1e6 * one:.2f} us per solve with one thread, "
            f"{1e6 * two:.2f} us with two, {1e6 * single:.0f} us for a pose alone"
        )
        if python:
            theirs = peer(python, robot, poses)
            one = min(one, busy(lambda: robot.ik(poses, threads=1)) / POSES)  # noqa: B023
            for name, accuracy in {"default": "1.4e-3, its default", "same": "1e-8"}.items():
                seconds, solved = theirs[name]["seconds_per_solve"], theirs[name]["solved"]
                print(
                    f"{'':8} roboticstoolbox-python to {accuracy}: solved {100 * solved:.2f} %, "
                    f"{1e6 * seconds:.1f} us; ratio {seconds / one:.1f} with one thread"
                )


if __name__ == "__main__":
    main()
