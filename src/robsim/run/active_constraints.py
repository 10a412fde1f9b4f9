"""Constraints that hold back the command of a run at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array

if TYPE_CHECKING:
    import xarray as xr

HOLDING = 1e-3  # share of the largest multiplier above which a constraint is named


def name_holding_constraints(run: xr.Dataset) -> list[str]:
    """Return the names of the constraints that hold the command of a single run at its end.

    Parameters
    ----------
    run : Dataset
        A single run.

    Returns
    -------
    list of str
        Names by falling multiplier; empty for a law without constraints.
    """
    if "active" not in run:
        return []
    active = run["active"]
    if "time" in active.dims:
        active = active.dropna("time", how="all").isel(time=-1)
    return select_holding_constraints(active.values, [str(x) for x in run["constraint"].values])


def select_holding_constraints(multipliers: Array, names: list[str]) -> list[str]:
    """Return the names of the constraints with the largest multipliers (c,), in this order."""
    order = np.argsort(-multipliers, kind="stable")
    least = HOLDING * float(np.nanmax(multipliers, initial=0.0))
    return [names[i] for i in order if multipliers[i] > max(least, 0.0)]
