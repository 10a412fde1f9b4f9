"""Photometric servo loops beside ViSP's program, many loops, and a controller (see README.md).

    python benchmarks/direct.py --peer /path/to/peer_photometric

The peer is built from peer_photometric.cpp. Both sides have the picture, the poses and the camera
of the shipped experiment `photometric`, and take turns. Without `--peer` the peer is left out.
"""

import argparse
import re
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import robsim as rs

EXAMPLE = rs.load_scenario(rs.examples.path("photometric"))
PICTURE = Path(rs.examples.path("photometric")).with_suffix(".png")
STEPS, TURNS, LOOPS = 250, 5, 1000
ROW = re.compile(r"tilted .* ([\d.]+) ms a step, +([\d.]+) with")


def run_steps(experiment):
    """Return milliseconds of CPU of a step of a loop that does not end early."""
    began = time.process_time_ns()
    run = experiment.run(threads=1)
    return (time.process_time_ns() - began) / 1e6 / (run.sizes["time"] - 1)


def run_peer(peer):
    """Return milliseconds of CPU of a step of the peer: as it is written, and with L'e first."""
    call = ["env", "OMP_NUM_THREADS=1", peer, str(PICTURE), str(STEPS)]
    text = subprocess.run(call, check=True, capture_output=True, text=True).stdout
    return tuple(map(float, ROW.search(text).groups()))


def build_endless():
    """Return the loop of the example, which goes on at its goal, with ViSP's derivative."""
    features = replace(EXAMPLE.task.features, tolerance=1e-6, step=0.0, derivative="seven_taps")
    task = replace(EXAMPLE.task, features=features)
    return EXAMPLE.with_(task=task, duration=STEPS * EXAMPLE.dt, hold=True)


def compare_loops(peer):
    """Print the time of a step of a loop, beside the peer."""
    endless, ours, theirs = build_endless(), [], []
    run_steps(endless)
    for _ in range(TURNS):
        ours.append(run_steps(endless))
        if peer:
            theirs.append(run_peer(peer))
    print(f"a step at 320 x 240: {min(ours):.3f} ms of CPU")
    for name, each in zip(("as written", "L'e first"), np.array(theirs).T, strict=False):
        print(f"ViSP, {name}: {min(each):.3f} ms, {min(each) / min(ours):.1f} times")


def scale_camera(factor):
    """Return the example with a camera of fewer pixels."""
    eye = EXAMPLE.scene.camera()
    width, height = (side // factor for side in eye.camera.size)
    eye = replace(eye, camera=eye.camera.resized(width, height))
    features = replace(EXAMPLE.task.features, border=max(10 // factor, 3))
    task = replace(EXAMPLE.task, features=features)
    return replace(EXAMPLE, scene=EXAMPLE.scene.replacing(eye), task=task)


def measure_many():
    """Print the time of many loops from random starts near the goal, at two sizes of picture."""
    rng, goal = np.random.default_rng(32), rs.Pose.at(0, 0, -1)
    shifts, turns = rng.uniform(-0.015, 0.015, (LOOPS, 3)), rng.uniform(-0.04, 0.04, (LOOPS, 3))
    starts = (goal @ rs.Pose.at(*shifts.T, rotvec=turns)).q
    for factor in (4, 1):
        many = scale_camera(factor).with_(start=starts, record="summary", duration=10.0)
        many.with_(start=starts[:2]).run(threads=1)
        began = time.process_time_ns()
        run = many.run(threads=1)
        seconds = (time.process_time_ns() - began) / 1e9
        good = (run.outcome == rs.Outcome.CONVERGED).mean().item()
        steps = run.end_time.values.sum() / EXAMPLE.dt
        print(
            f"{LOOPS} loops at {320 // factor} x {240 // factor}: {seconds:.1f} s of CPU, "
            f"{1e3 * seconds / steps:.3f} ms a step, {good:.0%} converge"
        )


def measure_controller():
    """Print the median and 99 % of the time of a step of a controller with a new picture."""
    q, times = np.asarray(EXAMPLE.start), []
    controller = rs.Controller(EXAMPLE)
    frame = EXAMPLE.scene.picture(q)
    for i in range(500):
        began = time.process_time_ns()
        controller.step(None, q, i * EXAMPLE.dt, images={"camera": frame})
        times.append((time.process_time_ns() - began) / 1e6)
    middle, high = np.percentile(times, (50, 99))
    print(f"Controller.step at 320 x 240: {middle:.2f} ms, 99 %: {high:.2f} ms of CPU")


def main():
    """Print all times."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peer", help="the program peer_photometric")
    options = parser.parse_args()
    compare_loops(options.peer)
    measure_controller()
    measure_many()


if __name__ == "__main__":
    main()
