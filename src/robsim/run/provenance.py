"""The start and the settings of a run, read from its stored data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import as_integer
from robsim.base.errors import InputError, format_value
from robsim.files.run_schema import MISSION
from robsim.run.mission_run import MissionRun

if TYPE_CHECKING:
    import xarray as xr


NEEDED = ("dt", "duration", "seed", "hold", "record", "single")


def get_run_attributes(run: object) -> dict[str, Any]:
    """Return the attributes of a run or of a mission's run; InputError for other values."""
    attrs = getattr(run, "attrs", None)
    a_run = isinstance(run, MissionRun) or hasattr(run, "data_vars")
    if not a_run or not isinstance(attrs, dict):
        raise InputError(
            f"expected a run, a Dataset of simulate or open_run, got {format_value(run)}"
        )
    return attrs


def check_run(run: object) -> None:
    """Raise InputError unless a value is a run, and not the run of a whole mission."""
    title = get_run_attributes(run).get("title")
    if isinstance(run, MissionRun) or title == MISSION:
        raise InputError(
            "this is a whole mission; expected the run of a leg, legs[i].run; "
            "Experiment.of(it).run() repeats the whole mission"
        )


def read_run_settings(run: xr.Dataset) -> dict[str, Any]:
    """Return the start and the settings of a run, as fields of its experiment.

    Raise InputError if the run lacks them, or if it is a selection of non-consecutive runs.
    """
    attrs = run.attrs
    lacking = [name for name in NEEDED if name not in attrs]
    if lacking or _get_needed_values(run, "q0").size == 0:
        raise InputError(f"this run is incomplete: it has no {', '.join(lacking) or 'rows'}")
    first = _get_first_run_number(_get_needed_values(run, "run"))
    try:
        dt, record = float(attrs["dt"]), attrs["record"]
        return {
            "start": run["q0"].values,
            "dt": dt,
            "duration": compute_whole_duration(float(attrs["duration"]) / dt, dt),
            "seed": int(attrs["seed"]),
            "hold": bool(attrs["hold"]),
            "record": record if isinstance(record, str) else as_integer(record, "record", 1),
            "first_run": first,
        }
    except (TypeError, ValueError, ArithmeticError) as reason:
        raise InputError(f"this run was changed after RobSim made it: {reason}") from None


def compute_whole_duration(periods: float, dt: float) -> float:
    """Return the duration in seconds of a whole number of periods, safe against rounding."""
    return max(round(periods) - 0.5, 1.0) * dt


def _get_first_run_number(numbers: Any) -> int:
    """Return the number of the first run; InputError unless the numbers are consecutive.

    The number of a run determines its noise.
    """
    numbers = np.atleast_1d(numbers)
    if (np.diff(numbers) != 1).any():
        raise InputError(
            f"runs {format_value(numbers.tolist())} are not consecutive: repeat them one by one"
        )
    return int(numbers[0])


def _get_needed_values(run: xr.Dataset, name: str) -> Any:
    if name not in run.variables:
        raise InputError(f"this is not a complete run: it has no '{name}'")
    return run[name].values
