"""What a recording says in curves, events and words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.errors import InputError
from robsim.page.bodies import Stage
from robsim.plot import history, palette
from robsim.run.experiment import Experiment

if TYPE_CHECKING:
    import xarray as xr

AXES = ("x", "y", "z")


def curves(stage: Stage, run: xr.Dataset) -> list[dict[str, Any]]:
    """Return the panels of curves: the error, the velocity of what moves, and the joints."""
    whose = "camera" if "camera_velocity" in run else "frame"
    twist = run[f"{whose}_velocity"].values
    vector = [color for color, _ in palette.COMPONENTS]
    error = np.column_stack([run["error_norm"].values, np.abs(run["error"].values)])
    names = ["|e|", *(f"|e{i}|" for i in range(error.shape[1] - 1))]
    units = sorted(set(run["feature_unit"].values.tolist()))
    unit = "" if units == ["1"] else ", ".join(units)
    grey = [palette.BLACK, *[palette.GREY] * (error.shape[1] - 1)]
    return [
        _panel(stage, "error", unit, names, grey, error, True),
        _panel(stage, f"{whose} v", "m/s", [f"v{a}" for a in AXES], vector, twist[:, :3]),
        _panel(stage, f"{whose} ω", "rad/s", [f"ω{a}" for a in AXES], vector, twist[:, 3:]),
        *joint_curves(stage, run),
    ]


def joint_curves(stage: Stage, run: xr.Dataset) -> list[dict[str, Any]]:
    """Return the panel of the velocities that are commanded."""
    names = run["velocity"].values.tolist()
    colors = [palette.nth(i) for i in range(len(names))]
    return [_panel(stage, "joint velocities", "", names, colors, run["qd"].values)]


def _panel(
    stage: Stage,
    title: str,
    unit: str,
    names: list[str],
    colors: list[str],
    values: Any,
    logarithmic: bool = False,
) -> dict[str, Any]:
    return {
        "title": title,
        "unit": unit,
        "names": names,
        "colors": colors,
        "values": stage.array(f"curve {title}", values),
        "log": logarithmic,
    }


def events(run: xr.Dataset) -> list[dict[str, Any]]:
    """Return what happened when: the end of the run, and its outcome."""
    end = float(run["end_time"])
    return [{"time": end, "text": history.ending(run)}] if np.isfinite(end) else []


def texts(run: xr.Dataset, experiment: Experiment, trials: bool) -> dict[str, str]:
    """Return the explanation and the text of the experiment, where there are such."""
    from robsim.analysis.explain import explain

    found = {}
    try:
        found["explanation"] = str(explain(run, experiment, trials=trials))
    except InputError as reason:
        found["explanation"] = f"not explained: {reason}"
    try:
        found["experiment"] = experiment.text
    except InputError as reason:
        found["experiment"] = f"not a text: {reason}"
    return found
