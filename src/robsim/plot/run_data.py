"""Extraction of data from runs for the figures."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, check_known, format_value
from robsim.engine.outcome import Outcome
from robsim.run.log_commands import is_log_run
from robsim.run.run_from_log import CONVERGED_AT
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

ROUNDING_ERROR = 1e-9  # smaller measures are rounding errors


def check_is_scene(scene: object) -> None:
    """Raise InputError unless this is a Scene."""
    if not isinstance(scene, Scene):
        raise InputError(f"expected a Scene, got {format_value(scene)}")


def check_is_run(run: xr.Dataset, timed: bool = True) -> xr.Dataset:
    """Return the run; raise InputError if it is no run or, with `timed`, only a summary."""
    if not {"q", "q0", "outcome"} <= set(getattr(run, "data_vars", ())):
        raise InputError(
            f"expected a run as simulate returns it, got {type(run).__name__}; of a mission, draw "
            "the run of a leg: story.legs[0].run in story.legs[0].scene"
        )
    if timed and "time" not in run.dims:
        raise InputError("only the end of this run was recorded: simulate it with record='all'")
    return run


def extract_single_run(run: xr.Dataset, timed: bool = True) -> xr.Dataset:
    """Return a single run up to its end; raise InputError if the batch has several runs."""
    one = check_is_run(run, timed)
    if one.sizes.get("run", 1) != 1:
        raise InputError(
            f"this figure shows one run, and these are {one.sizes['run']}: "
            "pick one, as in run.isel(run=0)"
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


def read_configurations(run: xr.Dataset, scene: Scene) -> Array:
    """Return the recorded coordinates (instants, nq) of a run, with its start and end."""
    _check_run_coordinates(run, scene)
    q = np.vstack([run["q0"].values, run["q"].values.reshape(-1, scene.nq), run["q_end"].values])
    return np.asarray(q[np.isfinite(q).all(axis=1)])


def _check_run_coordinates(run: xr.Dataset, scene: Scene) -> None:
    """Raise InputError if the coordinates of the run are not the scene's."""
    names = scene.coordinate_names
    if run["coordinate"].values.tolist() != list(names):
        own = ", ".join(run["coordinate"].values.tolist())
        raise InputError(
            f"the run belongs to another scene: its coordinates are {own}, not {names}"
        )


def read_coordinate_limits(run: xr.Dataset, scene: Scene) -> Array:
    """Return the lowest and highest value (nq, 2) of each coordinate; infinite without limits.

    Raise InputError if `scene` is no Scene, or not the scene of the run.
    """
    check_is_scene(scene)
    _check_run_coordinates(run, scene)
    return scene.limits


def compute_frame_velocity(run: xr.Dataset, scene: Scene, frame: str) -> Array:
    """Return the velocity (instants, 6), v and omega, of a frame's origin in world axes."""
    check_is_scene(scene)
    _check_run_coordinates(run, scene)
    bodies = scene.tree.bodies(np.ascontiguousarray(run["q"].values.T))
    return np.asarray(np.einsum("ijt,tj->ti", scene.tree.jacobian(bodies, frame), run["qd"].values))


def find_moving_frame(run: xr.Dataset, scene: Scene) -> str | None:
    """Return the frame of interest for velocities; None for the camera.

    If the camera stands still, it is the frame that carries the target.
    """
    if not run.sizes["mark"]:
        return None
    stands = not scene.tree.carries(str(run["mark_camera"].values[0])).any()
    return scene.object(str(run["mark_target"].values[0])).on if stands else None


def list_run_cameras(run: xr.Dataset) -> list[str]:
    """Return the names of the cameras that observe in a run."""
    return list(dict.fromkeys(run["mark_camera"].values.tolist()))


def select_camera_view(run: xr.Dataset, camera: str | None) -> xr.Dataset:
    """Return the run with the feature points and image attributes of one camera.

    `camera` None selects the first camera. The coordinate mark_number counts the feature points of
    all targets, and is the same for all cameras. Raise InputError if there is no camera of that
    name.
    """
    cameras = list_run_cameras(run)
    if not cameras:
        raise InputError("this run uses no camera, and so has no image")
    name = cameras[0] if camera is None else camera
    check_known(name, cameras, "no camera {} in the run", "cameras")
    one = run.isel(mark=np.flatnonzero(run["mark_camera"].values == name))
    suffix = "" if name == cameras[0] else f"_{name}"
    attributes = {key: run.attrs.get(f"{key}{suffix}") for key in ("image_size", "image_centre")}
    first, targets = number_first_marks(run), one["mark_target"].values.tolist()
    numbers = [first[t] + targets[:i].count(t) for i, t in enumerate(targets)]
    return one.assign_coords(mark_number=("mark", numbers)).assign_attrs(attributes)


def number_first_marks(run: xr.Dataset) -> dict[str, int]:
    """Return for each target the number of its first feature point, counted over all targets."""
    keys = zip(run["mark_target"].values.tolist(), run["mark_camera"].values.tolist(), strict=True)
    counts = Counter(keys)
    first, after = {}, 0
    for (target, _), count in counts.items():
        if target not in first:  # another camera observes the same points
            first[target], after = after, after + count
    return first


def describe_ending(run: xr.Dataset) -> str:
    """Return how and when a single run ended, as a title.

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
    """Return how a log ended, with the time of convergence in seconds if it converged."""
    if outcome == Outcome.CONVERGED:
        return f"converged after {converged:.3g} s"
    return "not converged" if outcome == Outcome.RUNNING else outcome.words


def describe_outcome(outcome: Outcome, time: float, hold: bool) -> str:
    """Return how and when a run ended, as text; `hold` marks runs that continue once converged."""
    if hold and outcome == Outcome.CONVERGED:
        return f"converged, held for {time:.3g} s"
    return f"{outcome.words} after {time:.3g} s"
