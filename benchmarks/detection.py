"""Servo loops that detect marks in rendered pictures, and the detectors (see README.md).

Run `python benchmarks/detection.py`. Tags and posters are left out without the extra `vision`.
"""

import time
from importlib.util import find_spec

import numpy as np

import robsim as rs
from robsim.vision import (
    Board,
    DotDetector,
    DotPattern,
    KeypointDetector,
    MarkSearch,
    Optics,
    Tag,
    TagDetector,
    TagTracker,
)

NOISE = Optics(read_noise=2.0, full_well=20_000)
EYE = rs.Camera([[500.0, 0, 319.5], [0, 500.0, 239.5], [0, 0, 1]], (640, 480))
TAG = Tag("tag36h11", 7, size=0.1)
DOTS = DotPattern.grid(2, 2, spacing=0.08, radius=0.012)
BOARD = Board("DICT_4X4_50", 5, 4, square=0.03, tag=0.021)
CORNERS = [[-0.12, -0.09, 0], [0.12, -0.09, 0], [0.12, 0.09, 0], [-0.12, 0.09, 0]]
REPEATS = 5
TURN = (0.05, -0.05, 0.1, 0.985**0.5)  # a quaternion


def draw_poster(count=3000):
    """Return a poster with a picture of random boxes."""
    rng, grey = np.random.default_rng(1), np.full((480, 640), 128, dtype=np.uint8)
    for _ in range(count):
        (x, y), (a, b) = rng.integers(0, (640, 480)), rng.integers(3, 30, 2)
        grey[y : y + b, x : x + a] = rng.integers(0, 255)
    return rs.shapes.Poster(grey, width=0.4)


def list_cases():
    """Return {name: detector, fields of its object}; those of OpenCV only with the extra."""
    cases = {"dots": (DotDetector(), {"dots": DOTS})}
    if find_spec("pyapriltags"):
        cases |= {
            "tag_tracker": (TagTracker(), {"tag": TAG}),
            "tag_tracker, board": (TagTracker(), {"board": BOARD}),
            "tags": (TagDetector(), {"tag": TAG}),
            "tags, board": (TagDetector(), {"board": BOARD}),
            "keypoints": (KeypointDetector(), {"shapes": draw_poster(), "marks": CORNERS}),
        }
    return cases


def build_scene(optics=NOISE, **printed):
    """Return a flying camera before a printed target."""
    target = rs.Object("target", **printed)
    robot = rs.robots.free_camera()
    eye = rs.MountedCamera("eye", EYE, on=f"{robot.name}.body", optics=optics)
    return rs.Scene(robot, target, eye)


def measure_loops():
    """Yield name, steps a second of CPU, and the final error in pixels of each loop."""
    goal = rs.GoalPose(rs.Pose.at(0.0, 0.0, 0.4))
    for name, (detector, printed) in list_cases().items():
        for optics, label in ((None, ""), (NOISE, ", noise")):
            scene = build_scene(optics, **printed)
            start = [0.05, -0.04, -0.5, *TURN]
            task = rs.IBVS(goal, detector=detector)
            one = rs.Experiment(scene, task, start, duration=4.0, hold=True)
            one.run(duration=0.2)
            rates = []
            for _ in range(REPEATS):
                began = time.process_time()
                run = one.run(threads=1)
                rates.append(run.sizes["time"] / (time.process_time() - began))
            yield name + label, max(rates), float(run.pixel_error)


def measure_detectors():
    """Yield name, milliseconds and rms error in pixels of each detector."""
    rng = np.random.default_rng(1)
    for name, (detector, printed) in list_cases().items():
        errors, times = [], []
        for seed in range(20):
            pose = rs.Pose.at(*rng.uniform(-0.05, 0.05, 2), 0.5, rotvec=rng.uniform(-0.4, 0.4, 3))
            target = rs.Object("target", pose=pose, **printed)
            scene = rs.Scene(objects=target, cameras=rs.MountedCamera("eye", EYE, optics=NOISE))
            picture, true = scene.picture(seed=seed)[None], scene.view(points="target").pixels
            search = MarkSearch(target.mark_target, target.marks, EYE, np.rint(true)[None])
            began = time.thread_time_ns()
            found = detector.find(picture, search)[0]
            times.append(time.thread_time_ns() - began)
            errors.append(found - true)
        yield name, min(times) / 1e6, float(np.sqrt(np.nanmean(np.square(errors))))


def main():
    """Print the tables."""
    print(f"\n{'servo loops, 640 x 480':38}{'steps/s':>9}{'end, px':>9}")
    for name, rate, error in measure_loops():
        print(f"{name:38}{rate:9.0f}{error:9.3f}", flush=True)
    print(f"\n{'detectors, 640 x 480, noise':38}{'ms':>9}{'rms, px':>9}")
    for name, low, error in measure_detectors():
        print(f"{name:38}{low:9.3f}{error:9.4f}", flush=True)


if __name__ == "__main__":
    main()
