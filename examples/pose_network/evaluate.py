"""Count how often four schemes reach the goal, on posters that the training does not show.

    cd examples; python -m pose_network.evaluate [--posters 12] [--starts 2] [--suites near far]

A run succeeds if it ends within 2 mm and 0.2 degrees of the goal. "Close" are the runs within 1 cm
and 1 degree. In the suite "dark" the goal was photographed in more light than the runs have; in
the suite "wide" the poster is larger than the view. The posters of a kind have other seeds than in
training; two of the kinds, and the photograph, are not in the training at all.
"""

import argparse
import time
import zlib
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from matplotlib import cbook
from matplotlib.image import imread
from pose_network.pose_feature import LearnedPose, make_luminance, make_task
from pose_network.posters import KINDS, UNSEEN, draw_poster
from pose_network.views import CAMERA, POSTER_WIDTH, draw_starts

import robsim as rs
from robsim.shapes import Poster
from robsim.statistics.proportions import estimate_clustered_share


class Suite(NamedTuple):
    """Starts, the light of the goal relative to the light of the runs, and the poster's width."""

    roll: float  # degrees; a third of it about x and y
    aside: float  # metres
    further: float
    light: float = 1.0
    width: float = POSTER_WIDTH


SUITES = {
    "near": Suite(30, 0.05, 0.25),
    "far": Suite(60, 0.10, 0.50),
    "dark": Suite(30, 0.05, 0.25, light=1.4),
    "wide": Suite(60, 0.10, 0.50, width=1.4),  # no edge of the poster is in view at the goal
}
DISTANCE, ANGLE = 2e-3, np.radians(0.2)  # of a success
DURATION, GAIN = 8.0, 5.0  # seconds and 1/s


def make_scene(picture, width=POSTER_WIDTH):
    """Return a flying camera 1 m in front of a poster."""
    eye = rs.MountedCamera("eye", CAMERA, on="free_camera.body")
    poster = Poster(picture, width=width)
    wall = rs.Object("wall", poster, pose=rs.Pose.at(0, 0, 1))
    robot = rs.robots.load("free_camera")
    return rs.Scene(robot, objects=[wall], cameras=[eye])


def make_schemes(photograph):
    """Return the compared schemes by name, towards a photograph (60, 80) at the goal."""
    goal = rs.tasks.TaughtGoal(picture=photograph)
    learned = LearnedPose(tolerance=5e-4)
    coarse = make_luminance(level=1)
    return {
        "luminance": rs.IBVS(goal, features=make_luminance(), gain=GAIN),
        "luminance, level 1, L mean": rs.IBVS(goal, features=coarse, interaction="mean", gain=GAIN),
        "network": rs.IBVS(goal, features=learned, gain=GAIN),
        "network, then luminance": make_task(GAIN, goal=goal),
    }


def list_posters(count):
    """Return (kind, picture) of the posters."""
    listed = [(kind, draw_poster(kind, seed)) for kind in KINDS for seed in range(count)]
    colours = imread(cbook.get_sample_data("grace_hopper.jpg", asfileobj=False))
    grey = colours[:368, :, :3] @ [0.299, 0.587, 0.114]  # 368 x 512
    blocks = grey.reshape(184, 2, 256, 2).mean(axis=(1, 3))
    return [*listed, ("photograph", np.rint(blocks).astype(np.uint8))]


def succeed(run, factor=1.0):
    """Return the runs (n,) that ended at the goal, within a factor of the largest errors."""
    near = run.distance_to_goal.values < factor * DISTANCE
    return near & (run.angle_to_goal.values < factor * ANGLE)


def evaluate(suites, posters, starts):
    """Print the shares of successful runs by suite, scheme and kind of poster."""
    for suite in suites:
        results, seconds = defaultdict(list), defaultdict(float)
        for number, (kind, picture) in enumerate(list_posters(posters)):
            rng = np.random.default_rng([number, zlib.crc32(suite.encode())])
            *limits, light, width = SUITES[suite]
            poses = rs.Pose(draw_starts(rng, starts, *limits))
            scene = make_scene(picture, width)
            photograph = np.clip(np.rint(light * scene.picture()), 0, 255).astype(np.uint8)
            for name, task in make_schemes(photograph).items():
                began = time.process_time()
                run = rs.simulate(scene, task, poses, duration=DURATION)
                seconds[name] += time.process_time() - began
                ends = zip(succeed(run), succeed(run, 5.0), strict=True)
                results[name] += [(kind, number, *each) for each in ends]
        print_table(suite, results, seconds)


def print_table(suite, results, seconds):
    """Print the shares of one suite."""
    print(f"\n{suite}: {SUITES[suite]}")
    kinds = [*KINDS, "photograph"]
    for name, rows in results.items():
        kind, number, success, close = (np.array(column) for column in zip(*rows, strict=True))
        share = estimate_clustered_share(success, number)
        print(
            f"{name:26} {share}, close {close.mean():.1%}, {len(rows)} runs, {seconds[name]:.0f} s"
        )
        groups = {"trained kinds": ~np.isin(kind, [*UNSEEN, "photograph"])}
        groups |= {each: kind == each for each in kinds}
        parts = [f"{each} {success[chosen].mean():.0%}" for each, chosen in groups.items()]
        print("   " + ", ".join(parts), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--posters", type=int, default=12, help="posters of each kind")
    parser.add_argument("--starts", type=int, default=2, help="starts of each poster")
    parser.add_argument("--suites", nargs="+", choices=SUITES, default=list(SUITES))
    chosen = parser.parse_args()
    evaluate(chosen.suites, chosen.posters, chosen.starts)
