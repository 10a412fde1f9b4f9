"""The cost of a control step: every feature, scheme and imperfection, alone and in batches.

`python -m benchmarks` prints it.
"""

import time
import warnings
from pathlib import Path

import numpy as np

import robsim as rs

BEFORE = Path(__file__).with_name("before.json")  # the same rows at an earlier commit, by name
SIZES = {"single": (1, 1000), "256": (256, 100), "4096": (4096, 25)}  # runs, steps
EXPERIMENT = rs.load_scenario(rs.examples.path("eye_to_hand"))  # six joints, four marks
ARM = EXPERIMENT.scene
TIP = rs.Pose(ARM.robots[0].fk(ARM.home))
FEATURES = [
    *("points", "pixels", "polar", "spherical", "log_depth", "points_3d", "segments", "lines"),
    *("vanishing_point", "sphere", "point_moments", "region_moments", "decoupled_moments"),
]
SCHEMES = {
    **{name: rs.IBVS(features=name) for name in FEATURES},
    "PBVS": rs.PBVS(),
    "Hybrid": rs.Hybrid(),
    "Partitioned": rs.Partitioned(advance=0.5),
    "camera law": rs.IBVS(law="camera"),
    "L desired": rs.IBVS(interaction="desired"),
    "damped inverse": rs.IBVS(inverse="damped"),
    "transpose": rs.IBVS(inverse="transpose"),
    "adaptive gain": rs.IBVS(gain=rs.laws.AdaptiveGain(1.001, 1.0, 1.0)),
    "depth filter": rs.IBVS(depth=rs.laws.DepthFilter(0.5)),
    "Broyden": rs.IBVS(interaction="broyden"),
    "speed limit": rs.IBVS(limit=rs.laws.SpeedLimit(joint=1.0)),
    "smooth start": rs.IBVS(smooth_start=1.0),
    "marks that come and go": rs.IBVS(weighting=["border", "fade"]),
    "secondary motion": rs.IBVS(
        features=rs.features.FeatureBlock("points", marks=[0, 1]), secondary=rs.laws.AvoidLimits()
    ),
    "priorities of two": rs.Priorities(
        [rs.IBVS(features=rs.features.FeatureBlock("points", marks=[0])), rs.PBVS()]
    ),
    "switch": rs.Switch(rs.PBVS(), rs.IBVS(), rs.tasks.ErrorBelow(1e-3)),
    "follow joints": rs.FollowJoints(ARM.home + 0.05, duration=20.0),
    "follow path": rs.FollowPath(TIP @ rs.Pose.at(0.02, 0.02, 0.02), duration=20.0),
}
LATE = rs.Sensing(
    0.5, 0.25, 0.02, 5.0, [rs.imperfections.Occlusion([1], 1.0, 2.0)], 0.1, 0.06, 0.08
)
LAZY = rs.Actuation(lag=0.05, velocity=2.0, acceleration=20.0, encoder=1e-4)
IMPERFECT = {
    "pixel noise": {"sensing": rs.Sensing(noise=0.5)},
    "late images": {"sensing": rs.Sensing(latency=0.06)},
    "joints that lag": {"actuation": rs.Actuation(lag=0.05)},
    "everything wrong": {"sensing": LATE, "actuation": LAZY},
}


SQUARE = 0.1 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
GRID = 0.1 * np.array([[x, y, 0] for x in (-1, -0.3, 0.3, 1) for y in (-1, -0.3, 0.3, 1)])


def arm_with_a_camera(robot, marks=SQUARE):
    """A scene of a robot, or of an arm of the library, a camera on its tip, and marks before it."""
    robot = rs.robots.load(robot) if isinstance(robot, str) else robot
    pose = rs.Pose(robot.fk(robot.home))
    plate = rs.Object("plate", marks=marks, pose=pose @ rs.Pose.at(0, 0, 0.5))
    camera = rs.Camera(np.array([[800, 0, 320], [0, 800, 240], [0, 0, 1.0]]), size=(640, 480))
    eye = rs.MountedCamera("eye", camera, on=f"{robot.name}.{robot.tip}")
    return rs.Scene([robot], [plate], [eye])


def snake(joints):
    """A chain of so many joints, a metre long in all."""
    rows = [[0, 0, 1.0 / joints, np.pi / 2 * (-1) ** i] for i in range(joints)]
    return rs.Robot.from_dh(rows, home=0.5 * np.sin(1.0 + np.arange(joints)), name="snake")


def example(name):
    """The scene, the task, and the start and the imperfections of a shipped scenario."""
    it = rs.load_scenario(rs.examples.path(name))
    return it.scene, it.task, {"start": it.start, "sensing": it.sensing}


def cases():
    """The scene, the task and the imperfections of each row, by name."""
    believed = EXPERIMENT.at("belief.cameras.camera.focal", 525.0).task.belief
    found = {name: (ARM, task, {}) for name, task in SCHEMES.items()}
    found |= {name: (ARM, rs.IBVS(), wrong) for name, wrong in IMPERFECT.items()}
    found["noisy PBVS"] = (ARM, rs.PBVS(), IMPERFECT["pixel noise"])
    found["wrong focal length"] = (ARM, rs.IBVS(belief=believed), {})
    found["free camera"] = (arm_with_a_camera("free_camera"), rs.IBVS(), {})
    found["Puma 560"] = (arm_with_a_camera("puma560"), rs.IBVS(), {})
    found["seven joints"] = (arm_with_a_camera("lbr_iiwa14"), rs.IBVS(), {})
    avoiding = rs.IBVS(secondary=rs.laws.AvoidLimits())
    found["sixty joints"] = (arm_with_a_camera(snake(60)), avoiding, {})
    grid, robust = arm_with_a_camera("puma560", GRID), rs.weights.Tukey(noise=0.5)
    for kind in rs.IBVS, rs.PBVS:
        found[f"robust {kind.__name__}"] = (
            grid,
            kind(weighting=robust),
            {"sensing": rs.Sensing(noise=0.5)},
        )
    shipped = "eye_in_hand", "mobile_arm", "car", "calibration_bench"
    return found | {name: example(name) for name in shipped}


def microseconds(scene, task, runs, steps, start=None, **imperfect):
    """Per run and step; the best of three, one thread, every run to the end of the time."""
    starts = np.repeat(np.atleast_2d(scene.home if start is None else start), runs, axis=0)
    if start is not None:  # a lost target would end the run
        starts = starts + np.random.default_rng(0).uniform(-0.002, 0.002, starts.shape)
    elif len(scene.home) != 7 or len(scene.velocity_names) == 7:  # no quaternion
        starts = starts + np.random.default_rng(0).uniform(-0.02, 0.02, starts.shape)
        starts[:, scene.robots[0].nq :] = scene.home[scene.robots[0].nq :]  # others rest
    loop = {"duration": steps * 0.04, "hold": True, "record": "summary"}
    experiment = rs.Experiment(scene, task, starts, **loop, **imperfect)
    times = []
    for _ in range(4):  # the first compiles
        begin = time.perf_counter()
        experiment.run(threads=1)
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times[1:]) / runs / steps


def measured(only=None):
    """Microseconds per run and step of each row, {name: {size: number}}."""
    warnings.simplefilter("ignore")
    found = {}
    for name, (scene, task, imperfect) in cases().items():
        if only is None or name in only:
            each = {
                size: microseconds(scene, task, *what, **imperfect) for size, what in SIZES.items()
            }
            found[name] = each
            print(f"{name:20}" + "".join(f"{each[size]:9.2f}" for size in SIZES), flush=True)
    return found
