"""The Dataset of a simulation: variables with names, units and provenance."""

from __future__ import annotations

import platform
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from robsim.base.arrays import Array
from robsim.engine.outcome import Outcome
from robsim.engine.recorder import RecordedSeries, Recorder
from robsim.files.flat_table import RunDataset
from robsim.files.run_schema import RUN, get_variable_dimensions
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.machine.cache_files import KERNEL_HASH, find_version
from robsim.run import end_variables
from robsim.run.task_error import make_error_variables
from robsim.servo.camera_target import CameraTarget
from robsim.servo.goals.goal import GoalFeatures, GoalPose
from robsim.servo.laws.command_quantity import UNITS as UNITS_OF_COMMANDS
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.task import ServoTask
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.engine.loop import Loop

VERSION = version("robsim")  # of the installed package
BLOCK = 65536  # number of instants in one evaluation of poses and velocities
VARIED = {"long_name": "number that differs from run to run, see Experiment.vary"}
UNITS = {
    "camera_pose": "m",
    "camera_velocity": "m/s, rad/s",
    "frame_pose": "m",
    "frame_velocity": "m/s, rad/s",
    "pixels": "px",
    "pixels_goal": "px",
    "picture_hash": "1",
    "normal_factor": "grey values per m or rad",
    "active": "1",
    "slack": "see constraint",
    "saturation": "1",
    "pixels_end": "px",
    "end_time": "s",
    "path_length": "m",
    "weight": "1",
    "pixel_error": "px",
    "outcome": "1",
    **end_variables.UNITS,
}
TORQUE_UNITS = {"rad": "N m", "m": "N"}
DESCRIPTIONS = {
    "q": "coordinates of the robots",
    "qd": "commanded velocities, held for one period",
    "qd_actual": "velocities of the joints, which follow the command with a lag or under limits",
    "camera_pose": "pose of the camera in the world",
    "camera_velocity": "twist (v, omega) of the camera in its own axes",
    "frame_pose": "pose of the moved frame in the world",
    "frame_velocity": "twist (v, omega) of the moved frame in its own axes",
    "s": "measured features",
    "s_goal": "features at the goal",
    "weight": "weight of each number of s, 0 if its mark is missing",
    "error": "s - s_goal",
    "error_norm": "Euclidean norm of the error",
    "lyapunov": "half the square of error_norm (chapter, eq. 16)",
    "pixels": "image coordinates of the marks, without noise",
    "pixels_goal": "image coordinates of the marks at the goal",
    "picture_hash": "52 bits of the BLAKE2b hash of the newest picture of a camera",
    "active": "multiplier of each constraint, positive where it holds the command back",
    "slack": "excess of the command over a constraint that gave way",
    "torque": "torques of the drives in the step before the instant; at first, to hold the robot",
    "saturation": "share of the last period in which the torque of a drive was limited",
    "torque_limit": "largest torque of each drive; infinite without a limit, NaN without a drive",
    "normal_factor": "upper triangle, row by row, of R with R'R = L'L of the picture, damped",
    "pixels_end": "image coordinates of the marks at the end",
    "outcome": "reason for the end of the run, see robsim.Outcome",
    "end_time": "time at the end of the run",
    "path_length": "path length of the camera, or of the target if the camera does not move",
    "pixel_error": "largest distance of a mark from its goal in the image, at the end",
    "q0": "coordinates at the start",
    "q_end": "coordinates at the end",
    **end_variables.DESCRIPTIONS,
}


def make_dataset(loop: Loop, of: Any, origin: Callable[[], Mapping[str, str]]) -> RunDataset:
    """Return the record of a simulation as a Dataset that is computed when it is read.

    `of` is the experiment, and `origin` returns the attributes with its text. The representations
    of a user's objects are stored now, because the objects may change.
    """
    provenance, scene, varied = _make_provenance(loop, of), of.scene, of.varied
    return RunDataset.of(
        lambda: xr.Dataset(*_make_recorded_variables(loop, scene, varied)),
        lambda: {**provenance, **origin()},
    )


def make_plain_variables(loop: Loop, scene: Scene) -> dict[Hashable, xr.Variable]:
    """Return the variables of a simulation by name, coordinates included, without a Dataset."""
    variables, coordinates = _make_recorded_variables(loop, scene, {})
    return {name: xr.Variable(*v) for name, v in {**variables, **coordinates}.items()}


def _make_recorded_variables(
    loop: Loop, scene: Scene, varied: Mapping[str, Array]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the variables and the coordinates of a simulation: (dims, values, attributes)."""
    recorder, controller = loop.recorder, loop.controller
    series = recorder.last if recorder.every is None else _trim_series(recorder)
    s_goal = controller.s_goal.T  # (1, k), or (runs, k)
    with np.errstate(over="ignore", invalid="ignore"):  # runs may end with NaN or infinity
        variables = {
            **_compute_motion(controller, series),
            **make_error_variables(series, s_goal[:, None]),
            "pixels": series.pixels.reshape(*series.q.shape[:2], -1, 2),
            **({"picture_hash": series.hashes} if series.hashes.shape[-1] else {}),
            **({"normal_factor": series.factors} if series.factors.shape[-1] else {}),
            **({"active": series.active, "slack": series.slack} if series.active.shape[-1] else {}),
            **_make_drive_variables(loop, series),
            "pixels_goal": controller.goal_pixels,
            "s_goal": s_goal if len(s_goal) > 1 else s_goal[0],
            **end_variables.make_end_variables(loop),
        }
    whole = {
        name: (get_variable_dimensions(name, data.ndim), data) for name, data in variables.items()
    }
    whole |= {name: _make_varied_variable(name, values) for name, values in varied.items()}
    attributes = {**_make_variable_attributes(controller, scene), **dict.fromkeys(varied, VARIED)}
    attributes["ending"] = _make_flag_attributes(
        ["none", *(type(each).__name__ for each in loop.endings)], -1
    )
    absent = {dim for dim, gone in (("run", loop.single), ("time", recorder.every is None)) if gone}
    coordinates = _make_coordinates(loop, scene, series.q.shape[1])
    if recorder.every is None:
        del coordinates["time"]
    return (
        {name: (*_drop_dimensions(absent, *v), attributes[name]) for name, v in whole.items()},
        {name: _drop_dimensions(absent, *v[:2]) + v[2:] for name, v in coordinates.items()},
    )


def _make_drive_variables(loop: Loop, series: RecordedSeries) -> dict[str, Array]:
    """Return the torques of drives, their saturation and their limits, if there are drives."""
    driven = loop.driven
    if driven is None or not series.torque.shape[-1]:  # a log has no torques
        return {}
    limits = np.full(loop.scene.nv, np.nan)
    limits[driven.velocities] = driven.limits
    return {"torque": series.torque, "saturation": series.saturation, "torque_limit": limits}


def _make_varied_variable(name: str, values: Array) -> tuple[tuple[str, ...], Array]:
    """Return the variable of numbers that differ from run to run."""
    return ("run", *(f"{name}.{i}" for i in range(1, values.ndim))), values


def _drop_dimensions(absent: set[str], dims: Sequence[str], data: Any) -> tuple[Sequence[str], Any]:
    """Return a variable without some dimensions of size one."""
    if absent.isdisjoint(dims):
        return dims, data
    first = tuple(0 if dim in absent else slice(None) for dim in dims)
    return [dim for dim in dims if dim not in absent], data[first]


def _trim_series(recorder: Recorder) -> RecordedSeries:
    """Return the recorded instants; after an interruption, only the simulated ones."""
    if (recorder.outcome != Outcome.RUNNING).all():
        return recorder.series
    count = int(np.nanmax(recorder.end_step, initial=0.0)) // (recorder.every or 1) + 1
    return RecordedSeries(*(part[:, :count] for part in recorder.series))


def _compute_motion(controller: TaskController, series: RecordedSeries) -> dict[str, Array]:
    """Return q, qd, and the poses and twists of the camera or of the moved frame."""
    follows = series.rates.shape[-1] == 0
    scene, whose = controller.scene, "camera" if controller.sights else "frame"
    rates = series.qd if follows else series.rates
    poses, twists = compute_frame_motion(scene, controller.frame, series.q, rates)
    return {
        "q": series.q,
        "qd": series.qd,
        **({} if follows else {"qd_actual": series.rates}),
        f"{whose}_pose": poses,
        f"{whose}_velocity": twists,
    }


def compute_frame_motion(scene: Scene, frame: str, q: Array, qd: Array) -> tuple[Array, Array]:
    """Return poses (runs, instants, 4, 4) and twists (runs, instants, 6) of a frame.

    Twists are in the axes of the frame. After the end of a run, where q is NaN, poses and twists
    are NaN.
    """
    joints, shape = scene.tree, q.shape[:2]
    poses, twists = np.full((q[..., 0].size, 4, 4), np.nan), np.full((q[..., 0].size, 6), np.nan)
    rows, rates = q.reshape(len(poses), -1), qd.reshape(len(poses), -1)
    still = not joints.flag_moves(frame).any()  # a frame that no joint moves
    live = np.flatnonzero(still | ~np.isnan(rows).any(axis=1))
    for part in _split_into_blocks(len(live)):
        some = live[part]
        q_some, rates_some = (np.ascontiguousarray(part[some].T) for part in (rows, rates))
        T, V = joints.motion(frame, q_some, rates_some, some // shape[1])
        poses[some], twists[some] = homogeneous_matrix(T), V.T
    return poses.reshape(*shape, 4, 4), twists.reshape(*shape, 6)


def _split_into_blocks(count: int) -> Iterator[slice]:
    return (slice(i, i + BLOCK) for i in range(0, count, BLOCK))


def _make_coordinates(loop: Loop, scene: Scene, instants: int) -> dict[str, Any]:
    every = loop.recorder.every or 1
    seconds = {"units": "s", "long_name": "time"}
    keys = [sight.key for sight in loop.controller.sights for _ in sight.target.marks]
    has_pictures = loop.recorder.last.hashes.shape[-1] > 0
    cameras = loop.controller.picture_cameras if has_pictures else []
    constraints = loop.controller.constraint_labels if loop.recorder.last.active.shape[-1] else ()
    return {
        "run": (["run"], loop.runs),
        "time": (["time"], np.arange(instants) * every * loop.dt, seconds),
        "coordinate": (["coordinate"], list(scene.coordinate_names)),
        "coordinate_unit": (["coordinate"], list(scene.coordinate_units)),
        "velocity": (["velocity"], list(scene.velocity_names)),
        "twist": (["twist"], ["vx", "vy", "vz", "wx", "wy", "wz"]),
        "axis": (["axis"], ["column", "row"]),
        "feature_unit": (["feature"], list(loop.controller.units)),
        "mark_camera": (["mark"], np.array([camera for camera, _ in keys], dtype=str)),
        "mark_target": (["mark"], np.array([target for _, target in keys], dtype=str)),
        **({"picture_camera": (["picture"], np.array(cameras, dtype=str))} if cameras else {}),
        **({"constraint": (["constraint"], list(constraints))} if constraints else {}),
    }


def _make_provenance(loop: Loop, of: Any) -> dict[str, Any]:
    """Return the attributes with the versions, the settings and the scheme of a run."""
    task = of.task
    return {
        "title": RUN,
        "robsim": VERSION,
        "kernel_hash": KERNEL_HASH,
        "numpy": np.__version__,
        "numba": find_version("numba"),
        "machine": platform.machine(),
        "dt": loop.dt,
        "duration": loop.steps * loop.dt,
        "seed": str(loop.seed),  # may exceed the integers of a file
        "hold": int(loop.hold),
        "record": loop.record,
        "task": type(task).__name__,
        **(_describe_scheme(task, of) if isinstance(task, ServoTask) else {}),
        "tolerance": loop.controller.tolerance,
        **_make_image_attributes(loop.controller.sights),
        "sensing": repr(of.sensing),
        "actuation": repr(of.actuation),
        "single": int(loop.single),
        **({"varied": " ".join(of.varied)} if of.varied else {}),
    }


def _describe_scheme(task: ServoTask, of: Any) -> dict[str, Any]:
    kinds = {GoalPose: "computed", GoalFeatures: "given"}
    by_name = isinstance(task.interaction, str)
    return {
        "goal": kinds.get(type(task.goal), "shown"),
        "belief": _list_wrong_beliefs(task.belief, of),
        "law": repr(task.law),
        "inverse": repr(task.inverse),
        "interaction": task.interaction if by_name else type(task.interaction).__name__,
    }


def _list_wrong_beliefs(belief: Scene | None, of: Any) -> str:
    """Return a description of the believed scene: the names of the parts that are wrong."""
    truth = of.scene
    if any(name.startswith("belief.") for name in of.varied):
        return "differs from the truth, and from run to run"
    if belief is None or belief == truth:
        return "the truth"
    kinds = ("robots", "objects", "cameras", "motions")
    true = [part for kind in kinds for part in getattr(truth, kind)]
    wrong = [p.name for kind in kinds for p in getattr(belief, kind) if p not in true]
    return f"differs from the truth: {', '.join(wrong) or 'in the order of its parts'}"


def _make_image_attributes(sights: Sequence[CameraTarget]) -> dict[str, Any]:
    """Return size and centre of the images in pixels; the first camera has no suffix."""
    cameras = {sight.eye.name: sight.eye.camera for sight in sights}
    attributes: dict[str, Any] = {}
    for i, (name, camera) in enumerate(cameras.items()):
        suffix = f"_{name}" if i else ""
        if camera.size:
            attributes[f"image_size{suffix}"] = np.array(camera.size)
        K = np.atleast_3d(camera.K)[..., 0]  # of the first run, if runs differ
        attributes[f"image_centre{suffix}"] = K[:2, 2].copy()
    return attributes


def _make_variable_attributes(
    controller: TaskController, scene: Scene
) -> dict[str, dict[str, Any]]:
    """Return unit and long name of each variable."""
    features = controller.units
    unit = features[0] if len(set(features)) == 1 else "see feature_unit"
    joints = sorted(set(scene.coordinate_units))
    unit_q = joints[0] if len(joints) == 1 else "see coordinate_unit"
    units = {
        **UNITS,
        **dict.fromkeys(("q", "q0", "q_end"), unit_q),
        **dict.fromkeys(("qd", "qd_actual"), f"{unit_q}/s" if len(joints) == 1 else "m/s, rad/s"),
        **_make_torque_units(controller, scene),
        **dict.fromkeys(("torque", "torque_limit"), TORQUE_UNITS.get(unit_q, "N m, N")),
        **dict.fromkeys(("s", "s_goal", "error", "error_norm"), unit),
        "lyapunov": f"{unit}^2" if unit not in ("1", "see feature_unit") else unit,
    }
    attributes: dict[str, dict[str, Any]] = {
        name: {"units": u, "long_name": DESCRIPTIONS[name]} for name, u in units.items()
    }
    if controller.command_quantity == "torque":
        attributes["qd"] |= {"long_name": "commanded torques, held for one period"}
    for name in ("camera_pose", "camera_velocity", "frame_pose", "frame_velocity"):
        attributes[name]["frame"] = controller.frame
    attributes["goal_pose"] |= end_variables.make_goal_attributes(controller)
    if not controller.sights:
        attributes["path_length"] |= {"long_name": "path length of the moved frame"}
    attributes["outcome"] |= _make_flag_attributes([each.name for each in Outcome], 0)
    return attributes


def _make_torque_units(controller: TaskController, scene: Scene) -> dict[str, str]:
    """Return the unit of the commands of a law of torques; none for a law of velocities."""
    if controller.command_quantity == "velocity":
        return {}
    slides = {scene.velocity_units[i] == "m/s" for i in controller.columns}
    return {"qd": "N, N m" if len(slides) > 1 else UNITS_OF_COMMANDS["torque"][slides.pop()]}


def _make_flag_attributes(names: Sequence[str], first: int) -> dict[str, Any]:
    """Return the CF attributes that name the values of a variable, from `first` on."""
    values = np.arange(first, first + len(names), dtype=np.int8)
    return {"flag_values": values, "flag_meanings": " ".join(names)}
