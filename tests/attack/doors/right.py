"""Right arguments, by the name of the parameter, and an object of each class that has methods."""

from functools import cache

import numpy as np

import robsim as rs

MARKS = np.array([[-0.1, -0.1, 0], [0.1, -0.12, 0], [0.11, 0.1, 0.02], [-0.1, 0.12, 0], [0, 0, 0]])
CAMERA = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
FEATURES = (
    "DecoupledMoments", "Ellipse", "Lines", "LogDepth", "PixelPoints", "PointMoments", "Points",
    "Points3D", "Polar", "RegionMoments", "Segments", "Sphere", "Spherical", "StereoPoints",
    "ThetaU", "Translation", "VanishingPoint",
)  # fmt: skip
GRID = np.array([[x / 10, y / 10, 0] for x in range(3) for y in range(3)])
POSE = rs.Pose.at(0.1, -0.05, 1.2, rpy=(0.1, 0.2, -0.1))


@cache
def scenario():
    return rs.load_scenario(rs.examples.path("visp_tutorial"))


@cache
def arm():
    return rs.robots.puma560()


@cache
def run():
    return scenario().run(duration=0.2)


@cache
def bench():
    return rs.load_scenario(rs.examples.path("calibration_bench"))


def turned():
    """Coordinates of three views of the bench."""
    return bench().start + np.radians([[0] * 6, [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])


@cache
def views():
    return rs.calibration.simulate_views(bench(), turned())


def hands():
    """Poses of three views, T_m_f."""
    return rs.Pose.at(0, 0.1, [0.3, 0.4, 0.5], rpy=[[0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]])


def tilted():
    """The marks of a plane from three sides."""
    eyes = [rs.Pose.at(0, 0, -1) @ rs.Pose.at(rpy=(i / 9, i / 8, 0)) for i in range(-1, 2)]
    return [CAMERA.project(GRID, each) for each in eyes]


def observed(N=4, B=1, pair=False):
    """The marks that a camera sees, for a number of marks and of runs."""
    rng = np.random.default_rng(N)
    x, Z = rng.uniform(-0.3, 0.3, (B, N, 2)), rng.uniform(1, 2, (B, N))
    camera, marks = rs.Camera(np.eye(3)), rng.uniform(-0.2, 0.2, (N, 3))
    if (
        not hasattr(rs.features.Observation, "of_last")
        and "model" not in rs.features.Observation.of.__code__.co_varnames
    ):
        last = np.ascontiguousarray(np.moveaxis(x, 0, -1)), np.ascontiguousarray(Z.T)
        return rs.features.Observation.of(*last, camera)  # of a RobSim of before
    more = {"model": marks, "guess": POSE}
    if pair:
        more |= {
            "other": rs.features.Observation.of(x - 0.1, Z, camera),
            "between": rs.Pose.at(0.2),
        }
    return rs.features.Observation.of(x, Z, camera, **more)


def state(k=8, n=6, B=1):
    """The state of a law, for a number of features, joints and runs."""
    rng = np.random.default_rng(k)
    e, L, J = (rng.normal(size=(*shape, B)) for shape in ((k,), (k, 6), (6, n)))
    A = np.einsum("kcb,cnb->knb", L, J)
    q = rng.normal(size=(n, B))
    return rs.laws.ControlState(e, L, J, A, 1.0, rs.laws.PseudoInverse(), s_last=e + 1.0, q_last=q)


def limits(n=6):
    return np.tile([-2.0, 2.0], (n, 1))


RIGHT = {
    "acceleration": 1.0, "alpha": 0.0, "angle": 1.0, "at_infinity": 0.5, "at_zero": 2.0,
    "attach": None, "axes": "position", "base": None, "bits": False, "by": None,
    "camera": lambda: CAMERA, "centre": (0, 0, 0), "chunk": 2, "color": "k", "columns": None,
    "components": (0, 1), "cone": 0.5, "corner": 0.01, "count": 3, "damping": 0.01,
    "dimension": "length", "distance": 0.2, "distortion": (-0.1, 0.01, 0, 0), "dt": 0.04,
    "duration": 0.2, "end": lambda: np.ones(3), "error": lambda: np.ones(8), "f": 0.008,
    "feature": rs.features.Points, "features": "points", "filename": "none.stl", "frame": "wrist",
    "frames": None, "gain": 1.0, "goal": observed, "H": lambda: np.eye(3),
    "height": 0.1, "high": 0.3, "interaction": "current", "inverse": "pseudo_inverse",
    "jacobian": lambda: np.eye(6), "joints": None, "K": lambda: CAMERA.K,
    "kind": lambda: rs.joints.JointKind, "lag": 0.1, "law": "joint", "length": 1.0,
    "lens": "fisheye", "limits": limits, "link": None, "links": lambda: arm().links,
    "low": 0.1, "margin": 0.1, "marks": lambda: MARKS, "mass": 1.0, "matrix": lambda: np.eye(4),
    "name": "puma560", "n": 16, "noise": 0.5, "now": None, "of": "points", "on": None,
    "other": "puma560.base", "one": "puma560.tool", "parts": None, "path": "none.file",
    "pixels": lambda: CAMERA.project(MARKS, POSE.inv()), "points": lambda: MARKS,
    "points_a": lambda: CAMERA.project(MARKS, POSE.inv()),
    "points_b": lambda: CAMERA.project(MARKS, rs.Pose.at(z=1.0).inv()),
    "pose": lambda: POSE, "position": (0.1, 0.2, 0.3), "px": 1e-5, "py": 1e-5,
    "q": lambda: scenario().scene.home, "q0": lambda: scenario().scene.home,
    "qd": lambda: np.ones((1, 6)),
    "quaternion": (0, 0, 0, 1), "radius": 0.05, "rates": lambda: np.zeros(6),
    "robot": arm, "rows": [[0, 0.1, 0.2, 1.5], [0, 0, 0.3, 0]], "run": run,
    "s": lambda: np.ones(8), "scene": lambda: scenario().scene, "seconds": 0.5, "seed": 1,
    "seen": observed, "slope": 10.0, "speed": 1.0, "start": lambda: np.zeros(3),
    "state": state, "T": lambda: arm().fk(arm().home), "T_c_o": lambda: POSE,
    "T_left_right": lambda: rs.Pose.at(0.2), "T_w_c": lambda: rs.Pose.at(z=-1.0), "t": 0.0,
    "task": lambda: scenario().task, "tasks": lambda: [scenario().task, rs.PBVS()],
    "text": "3 cm", "tolerance": 1e-3, "twist": (0.1, 0, 0, 0, 0, 0.2), "u0": 240, "v0": 320,
    "v": lambda: np.ones(6), "value": 0.5, "velocity": 1.0, "width": 0.1, "x": 0.1, "y": 0.2,
    "z": 1.0, "left": lambda: CAMERA, "right": lambda: CAMERA, "threads": 1, "tool": arm,
    "pixels_left": lambda: CAMERA.project(MARKS, POSE.inv()), "trials": 1, "experiment": scenario,
    "pixels_right": lambda: CAMERA.project(MARKS, (POSE.inv() @ rs.Pose.at(0.2))),
    "depth": lambda: np.ones(len(MARKS)), "size": (640, 480), "to": None, "rotvec": (0, 0, 1.0),
    "rpy": (0, 0, 0.1), "first": rs.IBVS, "second": rs.PBVS, "restarts": 1,
    "when": lambda: rs.tasks.ErrorBelow(0.1), "iterations": 20, "roll": 1.0, "advance": 1.0,
    "share": 0.5, "tensor": lambda: np.eye(3) * 0.01, "R": lambda: np.eye(3), "W": 0.1, "L": 0.1,
}  # fmt: skip
OWN = {  # arguments with another meaning than their name has elsewhere
    "Scene.view.camera": None, "Scene.camera.name": None, "Scene.object.name": None,
    "Scene.pose.frame": "camera", "Robot.from_dh.joints": None, "Robot.from_dh.limits": None,
    "ControlState.of.error": lambda: np.ones(6), "ControlState.of.interaction": lambda: np.eye(6),
    "ControlState.of.inverse": None, "Observation.of.pose": None, "GoalFeatures.s": (0.0,) * 8,
    "ControlState.of.s": None, "ControlState.of.q": None, "Robot.jacobian.q": lambda: arm().home,
    "Robot.fk.q": lambda: arm().home, "Robot.frames.q": lambda: arm().home, "Posture.q": (0.0,) * 6,
    "Robot.integrate.q": lambda: arm().home, "Robot.ik.q0": lambda: arm().home,
    "check_law.law": rs.laws.JointLaw, "check_law.features": 8, "check_law.joints": 6,
    "check_feature.marks": 4, "MountedCamera.on": "free_camera.body", "IBVS.goal": None,
    "manipulability.q": lambda: arm().home, "condition_number.q": lambda: arm().home,
    "singularity_distance.q": lambda: arm().home, "AvoidLimits.velocity.q": lambda: np.ones((1, 6)),
    "Posture.velocity.q": lambda: np.ones((1, 6)), "Scene.attached.name": "target",
    "Robot.at.pose": lambda: POSE, "FeatureBlock.marks": (0, 1), "Occlusion.marks": (0,),
    "Occlusion.start": 0.1, "Mission.phases": (), "Arc.radius": 1.0, "Path.parts": (),
    "Catenary.start": (0, 0, 0), "Catenary.end": (1, 0, 0), "Catenary.length": 1.5,
    "check_joint.kind": lambda: rs.joints.JointKind, "Robot.coordinates.q": lambda: arm().home,
    "Scene.believe.base": None, "Scene.believe.robot": None, "load.name": "ur5e",
    "bench.suites": "gallery", "bench.schemes": lambda: {"mine": rs.IBVS()},
    "Suite.version": 1, "Suite.title": "ours", "Suite.source": "ours", "Suite.criterion": "ours",
    "Suite.succeeds": lambda: len, "Suite.goal": lambda: scenario().task.goal.q,
    "Suite.starts": lambda: scenario().start[None], "Suite.varied": lambda: {},
    "Suite.groups": lambda: {"side": ["left"]}, "Suite.sensing": rs.Sensing,
    "Suite.draws": lambda: [0], "Suite.columns": lambda: {},
    "Tag.family": "tag36h11", "Tag.id": 3, "Tag.size": 0.1, "Board.family": "DICT_4X4_50",
    "Board.columns": 5, "Board.rows": 4, "Board.square": 0.03, "Board.tag": 0.02,
    "Camera.from_ros.message": lambda: {"k": CAMERA.K, "width": 640, "height": 480},
    "Camera.resized.width": 320, "Camera.resized.height": 240, "Camera.cropped.left": 10,
    "Camera.cropped.top": 20, "Camera.cropped.width": 300, "Camera.cropped.height": 200,
    "TagDetector.targets": lambda: [], "render_targets.targets": lambda: {},
    "render_targets.samples": 1,
    "Tag.is_black.x": lambda: np.zeros(3), "Tag.is_black.y": lambda: np.zeros(3),
    "RosMessages.controller": lambda: rs.Controller(scenario()), "RosMessages.marks.camera": None,
    "RosMessages.marks": None, "RosMessages.command.kind": "geometry_msgs/msg/Twist",
    "calibrate.views": views, "calibrate.also": ("focal",), "calibrate.start": "daniilidis",
    "CalibrationViews.scene": lambda: bench().scene, "CalibrationViews.q": turned,
    "CalibrationViews.pixels": lambda: views().pixels, "CalibrationViews.camera": "camera",
    "CalibrationViews.target": "board", "Calibration.next_poses.candidates": turned,
    "Calibration.next_poses.count": 2, "Calibration.cost.experiment": bench,
    "Calibration.cost.runs": 5, "Calibration.errors.truth": lambda: bench().scene,
    "Calibration.holds.truth": lambda: bench().scene, "Calibration.holds.part": "mount",
    "Calibration.holds.level": 0.9, "simulate_views.experiment": bench, "simulate_views.q": turned,
    "simulate_views.camera": "camera", "simulate_views.target": "board",
    "sample_viewpoints.experiment": bench,
    "sample_viewpoints.start": lambda: rs.starts.About(rpy=[0.1] * 3),
    "solve_hand_eye.T_m_f": hands,
    "solve_hand_eye.T_c_o": lambda: POSE.inv() @ hands() @ POSE,
    "solve_hand_eye.method": "tsai_lenz",
    "solve_robot_world.T_m_f": hands,
    "solve_robot_world.T_c_o": lambda: POSE.inv() @ hands() @ POSE,
    "calibrate_lens.target": lambda: GRID, "calibrate_lens.pixels": tilted,
    "calibrate_lens.coefficients": 4, "calibrate_lens.guess": lambda: CAMERA,
    "TabulatedValues.values": lambda: np.ones(5),
    "check_feature.feature": rs.features.Points, "to_table.of": None,
    "examples.path.name": "eye_in_hand",
}  # fmt: skip


def made(value):
    """Return an argument, which may be a function that makes it."""
    return value() if callable(value) else value


OBJECTS = {
    "Pose": lambda: POSE, "Camera": lambda: CAMERA, "Robot": arm,
    "Scene": lambda: scenario().scene, "Experiment": scenario,
    "Controller": lambda: rs.Controller(scenario()),
    "RosMessages": lambda: rs.control.RosMessages(rs.Controller(scenario())),
    "AvoidLimits": rs.laws.AvoidLimits,
    "AdaptiveGain": lambda: rs.laws.AdaptiveGain(2, 0.5, 10),
    "Inertia": lambda: rs.shapes.Inertia(1.0),
    "Ball": lambda: rs.shapes.Ball(0.1), "Block": lambda: rs.Block(1, 1, 1),
    "Wheel": lambda: rs.Wheel(1, 1), "CameraBody": lambda: rs.CameraBody(1, 1, 1),
    "Capsule": lambda: rs.shapes.Capsule(1, 1),
    "TaperedCylinder": lambda: rs.shapes.TaperedCylinder(2, 1, 1),
    "Calibration": lambda: rs.calibrate(views(), ["focal"]),
    "Motion": lambda: rs.Motion("free_camera", np.zeros(6)), "JointLaw": rs.laws.JointLaw,
    "CameraLaw": rs.laws.CameraLaw, "PartitionedLaw": rs.laws.PartitionedLaw,
    "Posture": lambda: rs.laws.Posture((0.0,) * 6), "Sensing": rs.Sensing,
    **{name: (lambda name=name: getattr(rs.features, name)()) for name in FEATURES},
}  # fmt: skip
