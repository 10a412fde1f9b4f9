"""How fast the loop is, as ratios measured in one run (see README.md)."""

import argparse
import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy_baseline as baseline

import robsim as rs

HERE = Path(__file__).parent
REPEATS = 5
STEPS, RUNS = 50, 10_000
DT, GAIN = 0.04, 5.0


def scene(points: np.ndarray) -> rs.Scene:
    """The scene of the NumPy baseline: Puma 560, camera on the flange, a fixed square."""
    arm = rs.Robot.from_dh(baseline.PUMA560, name="puma")
    eye = rs.MountedCamera("eye", rs.Camera(np.eye(3)), on="puma.link6")
    return rs.Scene([arm], [rs.Object("square", marks=points)], [eye])


def best(call: Callable[[], object], repeats: int = REPEATS) -> float:
    """Least seconds of several calls."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def single_step() -> float:
    """Seconds per step of one recorded run, with all that simulate does around it."""
    q0, points, _ = baseline.scene(1, 0)
    where, task = scene(points), rs.IBVS(goal=baseline.Q_GOAL, gain=0.05, tolerance=1e-300)
    steps = 2000
    rs.simulate(where, task, q0[0], dt=DT, duration=DT)
    return best(lambda: rs.simulate(where, task, q0[0], dt=DT, duration=DT * steps)) / steps


def batch_step(threads: int) -> tuple[float, float]:
    """Seconds per run and step of the batch, and how far q is from the baseline's."""
    q0, points, s_goal = baseline.scene(RUNS, 0)
    where, task = scene(points), rs.IBVS(goal=baseline.Q_GOAL, gain=GAIN, tolerance=1e-300)
    settings = {"dt": DT, "duration": STEPS * DT, "record": "summary", "threads": threads}
    run = rs.simulate(where, task, q0, **settings)
    expected = baseline.simulate(q0, STEPS, DT, GAIN, points, s_goal)
    seconds = best(lambda: rs.simulate(where, task, q0, **settings), 3)
    return seconds / RUNS / STEPS, float(np.abs(run.q_end.values - expected).max())


def numpy_step(solve: Callable[..., np.ndarray]) -> float:
    """Seconds per run and step of the baseline with one way to solve."""
    q0, points, s_goal = baseline.scene(RUNS, 0)
    call = lambda: baseline.simulate(q0, STEPS, DT, GAIN, points, s_goal, solve=solve)  # noqa: E731
    return best(call, 3) / RUNS / STEPS


def peer_step(python: str) -> float:
    """Seconds per step of machinevision-toolbox-python, measured by its own Python."""
    done = subprocess.run([python, HERE / "peer_mvtb.py"], capture_output=True, check=True)
    return float(json.loads(done.stdout.splitlines()[-1])["seconds_per_step"])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", help="a Python that has machinevision-toolbox-python")
    peer = parser.parse_args().peer
    ours = single_step()
    print(f"single run, recorded          {1e6 * ours:8.1f} us per step")
    if peer:
        theirs = min(peer_step(peer) for _ in range(3))
        ours = min(ours, single_step())
        print(f"machinevision-toolbox-python  {1e6 * theirs:8.1f} us per step")
        print(f"ratio                         {theirs / ours:8.1f}")
    one, off = batch_step(1)
    two, _ = batch_step(2)
    print(f"batch of {RUNS}, one thread   {1e6 * one:8.3f} us per run and step")
    print(f"largest difference of q from NumPy's  {off:.1g}")
    print(f"batch of {RUNS}, two threads  {1e6 * two:8.3f} us")
    for solve in (baseline.pseudo_inverse, baseline.normal_equations):
        theirs = numpy_step(solve)
        print(
            f"NumPy, {solve.__name__:20}   {1e6 * theirs:8.3f} us, "
            f"ratio {theirs / one:.1f} with one thread, {theirs / two:.1f} with two"
        )


if __name__ == "__main__":
    main()
