"""Data of runs for the figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, check_known, format_value
from robsim.declare.spec import add_article
from robsim.engine.outcome import Outcome
from robsim.run.log_commands import is_log_run
from robsim.run.run_from_log import CONVERGED_AT
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    # a run, or its variables alone, which are faster to make and to read
    RunVariables = Mapping[Hashable, xr.DataArray | xr.Variable]

ROUNDING_ERROR = 1e-9  # smaller measures are rounding errors


def check_is_scene(scene: object) -> None:
    """Raise InputError unless `scene` is a Scene."""
    if _has_run_variables(scene):
        raise InputError("expected a Scene, got a run: see `help` for the order of arguments")
    if not isinstance(scene, Scene):
        raise InputError(f"expected a Scene, got {format_value(scene)}")


def _has_run_variables(value: object) -> bool:
    """Return whether a value is a Dataset with the variables of a run."""
    return {"q", "q0", "outcome"} <= set(getattr(value, "data_vars", ()))


def check_is_run(run: xr.Dataset, timed: bool = True) -> xr.Dataset:
    """Return the run; raise InputError if it is not a run or, with `timed`, if it is a summary."""
    if not _has_run_variables(run):
        hint = ""
        if isinstance(run, Scene):
            hint = ": the run is the first argument, and the scene the second"
        elif hasattr(run, "legs"):
            hint = "; draw the run of one leg: mission.legs[0].run in mission.legs[0].scene"
        raise InputError(
            f"expected a run as simulate returns it, got {add_article(type(run).__name__)}{hint}"
        )
    if timed and "time" not in run.dims:
        raise InputError("only the end of this run was recorded: simulate it with record='all'")
    return run


def extract_single_run(run: xr.Dataset, timed: bool = True) -> xr.Dataset:
    """Return a single run up to its end; raise InputError if the batch has several runs."""
    one = check_is_run(run, timed)
    if one.sizes.get("run", 1) != 1:
        raise InputError(
            f"expected one run, got {one.sizes['run']}: pick one, as in run.isel(run=0)"
        )
    one = one.squeeze("run") if "run" in one.dims else one
    if "time" not in one.dims:
        return one
    finite = np.flatnonzero(np.isfinite(one["q"].values).all(axis=1))
    return one.isel(time=slice(0, finite[-1] + 1 if finite.size else 1))


def has_spread(values: Array) -> bool:
    """Return whether the finite values differ by more than rounding."""
    finite = values[np.isfinite(values)]
    return bool(finite.size) and float(np.ptp(finite)) > ROUNDING_ERROR * max(
        1.0, np.abs(finite).max()
    )


def read_configurations(run: RunVariables, scene: Scene) -> Array:
    """Return the recorded coordinates (instants, nq) of a run, with its start and end."""
    _check_run_coordinates(run, scene)
    q = np.vstack([run["q0"].values, run["q"].values.reshape(-1, scene.nq), run["q_end"].values])
    return np.asarray(q[np.isfinite(q).all(axis=1)])


def _check_run_coordinates(run: RunVariables, scene: Scene) -> None:
    """Raise InputError if the run and the scene have different coordinates."""
    names = scene.coordinate_names
    if run["coordinate"].values.tolist() != list(names):
        own = ", ".join(run["coordinate"].values.tolist())
        raise InputError(
            f"the run belongs to another scene: its coordinates are {own}, not {names}"
        )


def read_coordinate_limits(run: xr.Dataset, scene: Scene) -> Array:
    """Return the lowest and highest value (nq, 2) of each coordinate; infinite without limits.

    Raise InputError if `scene` is not a Scene, or not the scene of the run.
    """
    check_is_scene(scene)
    _check_run_coordinates(run, scene)
    return scene.limits


def compute_frame_velocity(run: xr.Dataset, scene: Scene, frame: str) -> Array:
    """Return the twist (instants, 6), v and omega, of the origin of a frame in world axes."""
    check_is_scene(scene)
    _check_run_coordinates(run, scene)
    bodies = scene.tree.bodies(np.ascontiguousarray(run["q"].values.T))
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values
    return np.asarray(np.einsum("ijt,tj->ti", scene.tree.jacobian(bodies, frame), rates))


def find_moving_frame(run: xr.Dataset, scene: Scene) -> str | None:
    """Return the frame of the target if the camera stands still; None if the camera moves.

    Figures show the velocity of this frame.
    """
    if not run.sizes["mark"]:
        return None
    stands = not scene.tree.flag_velocities(str(run["mark_camera"].values[0])).any()
    return scene.object(str(run["mark_target"].values[0])).on if stands else None


def list_run_cameras(run: RunVariables) -> list[str]:
    """Return the names of the cameras that observe in a run."""
    return list(dict.fromkeys(run["mark_camera"].values.tolist()))


def select_camera_view(run: xr.Dataset, camera: str | None) -> xr.Dataset:
    """Return the run with the feature points and image attributes of one camera.

    `camera` None selects the first camera. The coordinate mark_number is the number of a feature
    point among the points of all targets, which is the same in all cameras. Raise InputError if
    there is no camera of that name.
    """
    cameras = list_run_cameras(run)
    if not cameras:
        raise InputError("this run uses no camera, so it has no image")
    name = cameras[0] if camera is None else camera
    check_known(name, cameras, "no camera {} in the run", "cameras")
    one = run.isel(mark=np.flatnonzero(run["mark_camera"].values == name))
    suffix = "" if name == cameras[0] else f"_{name}"
    attributes = {key: run.attrs.get(f"{key}{suffix}") for key in ("image_size", "image_centre")}
    numbers = list(number_camera_marks(run, name))
    return one.assign_coords(mark_number=("mark", numbers)).assign_attrs(attributes)


def number_camera_marks(run: RunVariables, camera: str) -> dict[int, str]:
    """Return the target of each feature point of a camera, by its number among all targets."""
    cameras, targets = run["mark_camera"].values.tolist(), run["mark_target"].values.tolist()
    own = [target for target, eye in zip(targets, cameras, strict=True) if eye == camera]
    first = number_first_marks(run)
    return {first[target] + own[:i].count(target): target for i, target in enumerate(own)}


def number_first_marks(run: RunVariables) -> dict[str, int]:
    """Return the number of the first feature point of each target, counted over all targets."""
    keys = zip(run["mark_target"].values.tolist(), run["mark_camera"].values.tolist(), strict=True)
    counts = Counter(keys)
    first, after = {}, 0
    for (target, _), count in counts.items():
        if target not in first:  # another camera observes the same points
            first[target], after = after, after + count
    return first


def describe_ending(run: xr.Dataset) -> str:
    """Return the outcome and the end time of a single run as text.

    >>> import xarray as xr
    >>> describe_ending(xr.Dataset({"outcome": 1, "end_time": 2.52}))
    'converged after 2.52 s'
    """
    outcome, end = Outcome(int(run["outcome"])), float(run["end_time"])
    if is_log_run(run):
        how = _describe_log_ending(outcome, float(run.attrs.get(CONVERGED_AT, end)))
        return f"{how}; the log ends at {end:.3g} s"
    if outcome == Outcome.RUNNING:
        return "stopped by the user"
    return describe_outcome(outcome, end, bool(run.attrs.get("hold")))


def _describe_log_ending(outcome: Outcome, converged: float) -> str:
    """Return the outcome of a log as text, with the time of convergence in seconds."""
    if outcome == Outcome.CONVERGED:
        return f"converged after {converged:.3g} s"
    return "not converged" if outcome == Outcome.RUNNING else outcome.words


def describe_outcome(outcome: Outcome, time: float, hold: bool) -> str:
    """Return outcome and end time as text; with `hold` a converged run continues to its end."""
    if hold and outcome == Outcome.CONVERGED:
        return f"converged, held for {time:.3g} s"
    return f"{outcome.words} after {time:.3g} s"
