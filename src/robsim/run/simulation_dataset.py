"""Results: what a simulation returns, with names, units and provenance."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
import xarray as xr

from robsim.base.arrays import Array
from robsim.engine.outcome import Outcome
from robsim.engine.recorder import RecordedSeries, Recorder
from robsim.files.flat_table import RunDataset
from robsim.files.run_schema import RUN, get_variable_dimensions
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.machine.cache_files import KERNEL_HASH
from robsim.run import end_variables
from robsim.run.task_error import make_error_variables
from robsim.servo.camera_target import CameraTarget
from robsim.servo.goals.goal import GoalFeatures, GoalPose
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.task import ServoTask
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.engine.loop import Loop

VERSION = version("robsim")  # of the package that was installed
BLOCK = 65536  # instants that are turned into poses and velocities at a time
VARIED = {"long_name": "what differs from run to run, see Experiment.vary"}
UNITS = {
    "camera_pose": "m",
    "camera_velocity": "m/s, rad/s",
    "frame_pose": "m",
    "frame_velocity": "m/s, rad/s",
    "pixels": "px",
    "pixels_goal": "px",
    "pixels_end": "px",
    "end_time": "s",
    "path_length": "m",
    "weight": "1",
    "pixel_error": "px",
    "outcome": "1",
    **end_variables.UNITS,
}
DESCRIPTIONS = {
    "q": "coordinates of the robots",
    "qd": "commanded velocities, held for one period",
    "qd_actual": "velocities of the joints, which follow the command with a lag or under limits",
    "camera_pose": "pose of the camera in the world",
    "camera_velocity": "twist (v, omega) of the camera in its own axes",
    "frame_pose": "pose in the world of the frame that is moved",
    "frame_velocity": "twist (v, omega) of the frame that is moved, in its own axes",
    "s": "features as measured",
    "s_goal": "features at the goal",
    "weight": "how much each number of s counts, 0 where its mark is not there",
    "error": "s - s_goal",
    "error_norm": "length of the error",
    "lyapunov": "half the square of error_norm (chapter, eq. 16)",
    "pixels": "where the marks are in the image, without noise",
    "pixels_goal": "where the marks are in the image at the goal",
    "pixels_end": "where the marks are in the image at the end",
    "outcome": "why the run ended, see robsim.Outcome",
    "end_time": "when the run ended",
    "path_length": "way of the camera, or of the target where the camera stands still",
    "pixel_error": "largest distance of a mark from its goal in the image, at the end",
    "q0": "start",
    "q_end": "end",
    **end_variables.DESCRIPTIONS,
}


def make_dataset(loop: Loop, of: Any, origin: Callable[[], Mapping[str, str]]) -> RunDataset:
    """Return the record of a finished or stopped simulation, made into a Dataset when it is read.

    `of` is its experiment, and `origin` what it says of that. What a user's objects say of
    themselves is asked now, because they may change.
    """
    said, scene, varied = _make_provenance(loop, of), of.scene, of.varied
    return RunDataset.of(
        lambda: _make_recorded_variables(loop, scene, varied), lambda: {**said, **origin()}
    )


def _make_recorded_variables(loop: Loop, scene: Scene, varied: Mapping[str, Array]) -> xr.Dataset:
    """Return the variables of a simulation."""
    recorder, controller = loop.recorder, loop.controller
    series = recorder.last if recorder.every is None else _trim_series(recorder)
    s_goal = controller.s_goal.T  # (1, k), or (runs, k)
    with np.errstate(over="ignore", invalid="ignore"):  # a run that went wrong is data
        variables = {
            **_compute_motion(controller, series),
            **make_error_variables(series, s_goal[:, None]),
            "pixels": series.pixels.reshape(*series.q.shape[:2], -1, 2),
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
    return xr.Dataset(
        {name: (*_drop_dimensions(absent, *v), attributes[name]) for name, v in whole.items()},
        {name: _drop_dimensions(absent, *v[:2]) + v[2:] for name, v in coordinates.items()},
    )


def _make_varied_variable(name: str, values: Array) -> tuple[tuple[str, ...], Array]:
    """Return the variable of numbers of which each run has its own."""
    return ("run", *(f"{name}.{i}" for i in range(1, values.ndim))), values


def _drop_dimensions(absent: set[str], dims: Sequence[str], data: Any) -> tuple[Sequence[str], Any]:
    """Return a variable without some dimensions, of size one."""
    if absent.isdisjoint(dims):
        return dims, data
    first = tuple(0 if dim in absent else slice(None) for dim in dims)
    return [dim for dim in dims if dim not in absent], data[first]


def _trim_series(recorder: Recorder) -> RecordedSeries:
    """Return the recorded instants; after an interruption, only those until then."""
    if (recorder.outcome != Outcome.RUNNING).all():
        return recorder.series
    kept = int(np.nanmax(recorder.end_step, initial=0.0)) // (recorder.every or 1) + 1
    return RecordedSeries(*(part[:, :kept] for part in recorder.series))


def _compute_motion(controller: TaskController, series: RecordedSeries) -> dict[str, Array]:
    """Return q, qd, and the poses and twists of the camera, or of the frame that is moved."""
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

    Twists are in the axes of the frame.

    Of instants after the end of a run, in which q is NaN, nothing is computed.
    """
    joints, shape = scene.tree, q.shape[:2]
    poses, twists = np.full((q[..., 0].size, 4, 4), np.nan), np.full((q[..., 0].size, 6), np.nan)
    rows, rates = q.reshape(len(poses), -1), qd.reshape(len(poses), -1)
    still = not joints.carried(frame).any()  # then it is where it was
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
    }


def _make_provenance(loop: Loop, of: Any) -> dict[str, Any]:
    """Return the attributes that say which version computed the run, and how."""
    task = of.task
    return {
        "title": RUN,
        "robsim": VERSION,
        "kernel_hash": KERNEL_HASH,
        "numpy": np.__version__,
        "numba": numba.__version__,
        "machine": platform.machine(),
        "dt": loop.dt,
        "duration": loop.steps * loop.dt,
        "seed": str(loop.seed),  # may exceed what a file's integers hold
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
    """Return which parts of a scene are believed wrongly, by name."""
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
    """Return size and centre of the images in pixels; those of the first have no name."""
    cameras = {sight.eye.name: sight.eye.camera for sight in sights}
    found: dict[str, Any] = {}
    for i, (name, camera) in enumerate(cameras.items()):
        suffix = f"_{name}" if i else ""
        if camera.size:
            found[f"image_size{suffix}"] = np.array(camera.size)
        K = np.atleast_3d(camera.K)[..., 0]  # of the first run, where each has its own
        found[f"image_centre{suffix}"] = K[:2, 2].copy()
    return found


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
        **dict.fromkeys(("s", "s_goal", "error", "error_norm"), unit),
        "lyapunov": f"{unit}^2" if unit not in ("1", "see feature_unit") else unit,
    }
    named: dict[str, dict[str, Any]] = {
        name: {"units": u, "long_name": DESCRIPTIONS[name]} for name, u in units.items()
    }
    for name in ("camera_pose", "camera_velocity", "frame_pose", "frame_velocity"):
        named[name]["frame"] = controller.frame
    named["goal_pose"] |= end_variables.make_goal_attributes(controller)
    if not controller.sights:
        named["path_length"] |= {"long_name": "way of the frame that is moved"}
    named["outcome"] |= _make_flag_attributes([each.name for each in Outcome], 0)
    return named


def _make_flag_attributes(names: Sequence[str], first: int) -> dict[str, Any]:
    """Return the attributes that name the values of a variable, from the first on."""
    values = np.arange(first, first + len(names), dtype=np.int8)
    return {"flag_values": values, "flag_meanings": " ".join(names)}
