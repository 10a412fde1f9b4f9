"""The schema of run files: required variables, dimensions, types and attributes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.errors import format_value
from robsim.kernels.outcomes import outcome_codes

if TYPE_CHECKING:
    import xarray as xr

RUN, MISSION = "RobSim run", "RobSim mission"
TITLES = (RUN, MISSION)

# the dimensions of each variable, without `run` and, in the first table, `time`
INSTANTS = {
    "q": ("coordinate",),
    "qd": ("velocity",),
    "qd_actual": ("velocity",),
    "camera_pose": ("row", "column"),
    "camera_velocity": ("twist",),
    "frame_pose": ("row", "column"),
    "frame_velocity": ("twist",),
    "s": ("feature",),
    "weight": ("feature",),
    "error": ("feature",),
    "error_norm": (),
    "lyapunov": (),
    "pixels": ("mark", "axis"),
    "picture_hash": ("picture",),
    "normal_factor": ("factor",),
    "active": ("constraint",),
    "slack": ("constraint",),
    "torque": ("velocity",),
    "saturation": ("velocity",),
}
ENDS = {
    "pixels_goal": ("mark", "axis"),
    "s_goal": ("feature",),
    "outcome": (),
    "end_time": (),
    "path_length": (),
    "pixel_error": (),
    "q0": ("coordinate",),
    "q_end": ("coordinate",),
    "pixels_end": ("mark", "axis"),
    "goal_pose": ("row", "column"),
    "distance_to_goal": (),
    "angle_to_goal": (),
    "ending": (),
    "torque_limit": ("velocity",),
}
NAMES = {
    "coordinate": ("coordinate",),
    "coordinate_unit": ("coordinate",),
    "velocity": ("velocity",),
    "twist": ("twist",),
    "axis": ("axis",),
    "feature_unit": ("feature",),
    "mark_camera": ("mark",),
    "mark_target": ("mark",),
    "picture_camera": ("picture",),
    "constraint": ("constraint",),
}
FRAMED = ("frame_pose", "frame_velocity", "goal_pose")  # with an attribute `frame`
SIZES = {"row": 4, "column": 4, "twist": 6, "axis": 2}
WHOLE = ("run", "outcome", "ending")
OPTIONAL = {
    *("qd_actual", "weight", "ending", "picture_hash", "picture_camera", "normal_factor"),
    *("active", "slack", "constraint", "torque", "saturation", "torque_limit"),
}
MOVED = ("camera", "frame")  # a run has the pose and velocity of the camera or of the frame
OF_A_MISSION = ("q", "qd", "coordinate", "time")
VERSIONS = ("robsim", "kernel_hash", "numpy", "numba", "machine")
TEXTS = (
    *(*VERSIONS, "seed", "task", "goal", "belief", "law", "inverse"),
    *("sensing", "actuation", "scenario", "no_scenario", "stored_data", "varied"),
    *("recorded", "commands"),
)
POSITIVE, FLAGS = ("dt", "duration"), ("hold", "single", "succeeded")
NOT_NEGATIVE = ("converged_at",)
OF_IMAGES = ("image_size", "image_centre")  # names, which may be followed by a camera's name


def get_variable_dimensions(name: str, axes: int) -> tuple[str, ...]:
    """Return the dimensions of a variable with a number of axes; leading ones may be missing.

    >>> get_variable_dimensions("q_end", 2), get_variable_dimensions("q_end", 1)
    (('run', 'coordinate'), ('coordinate',))
    """
    timed = ("run", "time") if name in INSTANTS else ("run",)
    every = (*timed, *{**INSTANTS, **ENDS}[name])
    return every[len(every) - axes :]


def check_run_content(run: xr.Dataset) -> None:
    """Raise ValueError with the first error of a Dataset that is not a valid run or mission."""
    title = run.attrs.get("title")
    if not isinstance(title, str) or title not in TITLES:
        raise ValueError(f"its title is {format_value(title)}")
    for problem in (
        *_find_missing_entries(run, title),
        *_find_wrong_variables(run),
        *_find_wrong_attributes(run),
    ):
        raise ValueError(problem)


def _find_missing_entries(run: xr.Dataset, title: str) -> Iterator[str]:
    """Yield messages about missing variables, attributes and instants."""
    pose_names = [f"{each}_pose" for each in MOVED if f"{each}_pose" in run.variables]
    required: set[str] = set(OF_A_MISSION)
    if title == RUN:
        required = {*INSTANTS, *ENDS, *NAMES} - OPTIONAL
        others = [each for each in MOVED if f"{each}_pose" not in pose_names[:1]]
        required -= {f"{each}_{name}" for each in others for name in ("pose", "velocity")}
        required |= {"run", *POSITIVE, *FLAGS[:2], "record", "seed"}
    missing = sorted(required - {*run.variables, *run.attrs})
    if missing or (title == RUN and not pose_names):
        yield f"it has no {', '.join(missing[:5]) or 'pose of a camera or frame'}"
    if any(dim != "run" and not size for dim, size in run.sizes.items() if dim in ("run", "time")):
        yield "it has no instants"


def _find_wrong_variables(run: xr.Dataset) -> Iterator[str]:
    """Yield messages about known variables with wrong dimensions or types."""
    for table, before in ((INSTANTS, ("run", "time")), (ENDS, ("run",)), (NAMES, ())):
        for name in (name for name in table if name in run.variables):
            leading = tuple(dim for dim in before if dim in run.variables[name].dims)
            if run.variables[name].dims != (*leading, *table[name]):
                yield f"{name} has the dimensions {format_value(run.variables[name].dims)}"
            if run.variables[name].dtype.kind not in _get_allowed_dtypes(name):
                yield f"{name} holds values of type {run.variables[name].dtype}"
    for dim, size in SIZES.items():
        if run.sizes.get(dim, size) != size:
            yield f"{dim} has {run.sizes[dim]} entries, not {size}"
    yield from _find_size_conflicts(run)
    yield from _find_unnamed_outcomes(run)


def _get_allowed_dtypes(name: str) -> str:
    if name in NAMES:
        return "UOT"
    return "iu" if name in WHOLE else "f"


def _find_size_conflicts(run: xr.Dataset) -> Iterator[str]:
    """Yield messages about inconsistent runs and instants."""
    for name, dims in (("run", (("run",), ())), ("time", (("time",),))):
        if name in run.variables and run.variables[name].dims not in dims:
            yield f"{name} has the dimensions {format_value(run.variables[name].dims)}"
    if "run" in run.variables and run.variables["run"].dtype.kind not in _get_allowed_dtypes("run"):
        yield "the number of a run is not an integer"
    for name in ("q", "q0"):
        some = run.variables[name].dims if name in run.variables else ("run",)
        if "run" in run.dims and "run" not in some:
            yield f"{name} has no values for each run"
    if "time" in run.dims and "time" not in run["q"].dims:
        yield "q has no values for each instant"
    time = run.variables.get("time")
    if time is not None and not (time.dtype.kind == "f" and np.isfinite(time.values).all()):
        yield "an instant is not a finite time"


def _find_unnamed_outcomes(run: xr.Dataset) -> Iterator[str]:
    """Yield messages about outcomes and endings without a name."""
    for name in {"outcome", "ending"} & set(run.variables):
        attrs, values = run.variables[name].attrs, run.variables[name].values
        flags, meanings = attrs.get("flag_values"), attrs.get("flag_meanings", "")
        count = len(meanings.split()) if isinstance(meanings, str) else None
        has_names = flags is not None and np.size(flags) == count
        if not has_names or not np.isin(values, np.asarray(flags)).all():
            yield f"an {name} has no name"
    if "outcome" in run.variables:
        values = run.variables["outcome"].values
        if not ((values >= outcome_codes.RUNNING) & (values <= outcome_codes.LAST)).all():
            yield f"outcome {values[(values < 0) | (values > outcome_codes.LAST)][0]} is unknown"


def _find_wrong_attributes(run: xr.Dataset) -> Iterator[str]:
    """Yield messages about attributes with a wrong type or value."""
    for name, value in run.attrs.items():
        if not _is_valid_attribute(name, value):
            yield f"attribute {name} is {format_value(value)}"
    for name, variable in run.variables.items():
        if not isinstance(variable.attrs.get("units", ""), str):
            yield f"the unit of {name!s:.80} is not a text"
        if name in FRAMED and not isinstance(variable.attrs.get("frame"), str):
            yield f"{name!s} has no attribute 'frame'"


def _is_valid_attribute(name: str, value: Any) -> bool:
    """Return whether the value of an attribute has the type that its name requires."""
    if name in TEXTS:
        return isinstance(value, str)
    if name in POSITIVE:
        return _is_number_attribute(value) and 0.0 < value < math.inf
    if name in NOT_NEGATIVE:
        return _is_number_attribute(value) and 0.0 <= value < math.inf
    if name in FLAGS:
        return _is_number_attribute(value) and value in (0, 1)
    return not name.startswith(OF_IMAGES) or _is_number_pair(value)


def _is_number_attribute(value: Any) -> bool:
    return isinstance(value, int | float | np.integer | np.floating)


def _is_number_pair(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.shape == (2,) and bool(np.isfinite(value).all())
