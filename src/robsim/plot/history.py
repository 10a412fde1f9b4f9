"""What the figures read from a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robsim.arrays import Array
from robsim.errors import InputError
from robsim.outcome import Outcome

if TYPE_CHECKING:
    import xarray as xr

    from robsim.scene import Scene


def checked(run: xr.Dataset, timed: bool = True) -> xr.Dataset:
    """The run as it is, or an InputError if it is no run, or (`timed`) only a summary of one."""
    if not {"q", "q0", "outcome"} <= set(getattr(run, "data_vars", ())):
        raise InputError(f"expected a run as simulate returns it, got {type(run).__name__}")
    if timed and "time" not in run.dims:
        raise InputError("only the end of this run was recorded: simulate it with record='all'")
    return run


def single(run: xr.Dataset, timed: bool = True) -> xr.Dataset:
    """One run, up to its end; InputError for a batch of several."""
    one = checked(run, timed)
    if one.sizes.get("run", 1) != 1:
        raise InputError(
            f"this figure shows one run, and these are {one.sizes['run']}: "
            "pick one, as in run.isel(run=0)"
        )
    one = one.squeeze("run") if "run" in one.dims else one
    if "time" not in one.dims:
        return one
    lived = np.flatnonzero(np.isfinite(one["q"].values).all(axis=1))
    return one.isel(time=slice(0, lived[-1] + 1 if lived.size else 1))


def configurations(run: xr.Dataset, scene: Scene) -> Array:
    """(moments, nq): what was recorded of a single run, its start and its end included."""
    names = scene.coordinate_names
    if run["coordinate"].values.tolist() != list(names):
        found = ", ".join(run["coordinate"].values.tolist())
        raise InputError(f"the run is not one of this scene: it moves {found}, not {names}")
    q = np.vstack([run["q0"].values, run["q"].values.reshape(-1, scene.nq), run["q_end"].values])
    alive: Array = q[np.isfinite(q).all(axis=1)]
    return alive


def ending(run: xr.Dataset) -> str:
    """Why and when a single run ended, as a title.

    >>> import xarray as xr
    >>> ending(xr.Dataset({"outcome": 1, "end_time": 2.52}))
    'converged after 2.52 s'
    """
    if int(run["outcome"]) == Outcome.RUNNING:
        return "stopped by the user"
    name = Outcome(int(run["outcome"])).name.lower().replace("_", " ")
    return f"{name} after {float(run['end_time']):.3g} s"
