"""Curves and events of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.page.recording_frames import Entry
from robsim.plot import palette, run_data
from robsim.run.frame_motion import compute_frame_motion
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from robsim.plot.run_data import RunVariables


@dataclass(frozen=True, eq=False)
class CurvePanel:
    """A panel of curves: values (T, n), one column for each name.

    `limited` (T, n) are flags of the instants after a period in which a value was limited.
    """

    title: str
    unit: str
    names: list[str]
    colors: list[str]
    values: Array
    log: bool = False
    limited: NDArray[np.uint32] | None = None

    @property
    def entry(self) -> Entry:
        """The entry of the header, with the names of the arrays."""
        entry = {key: getattr(self, key) for key in ("title", "unit", "names", "colors", "log")}
        limited = {} if self.limited is None else {"limited": self._limited_array}
        return {**entry, "values": self.array, **limited}

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays of the panel by name."""
        limited = {} if self.limited is None else {self._limited_array: self.limited}
        return {self.array: self.values, **limited}

    @property
    def _limited_array(self) -> str:
        """The name of the array of the flags."""
        return f"limited {self.title}"

    @property
    def array(self) -> str:
        """The name of the array of the values."""
        return f"curve {self.title}"


def build_curve_panels(
    run: RunVariables, scene: Scene, second: RunVariables | None = None
) -> list[CurvePanel]:
    """Return the panels of curves: error, velocities of the moving frame and the joints, torques.

    If a second run is given, the first panel has the image errors of both runs.
    """
    frame, twist = _select_frame_twist(run, scene)
    vector = [color for color, _ in palette.COMPONENTS]
    error = np.column_stack([run["error_norm"].values, np.abs(run["error"].values)])
    names = ["|e|", *(f"|e{i}|" for i in range(error.shape[1] - 1))]
    units = {unit for each in run["feature_unit"].values.tolist() for unit in each.split(", ")}
    unit = ", ".join(sorted(units - {"1"}))
    grey = [palette.BLACK, *[palette.GREY] * (error.shape[1] - 1)]
    return [
        *([] if second is None else [_compare_image_errors(run, second)]),
        CurvePanel("error", unit, names, grey, error, True),
        CurvePanel(f"{frame} v", "m/s", [f"v{a}" for a in "xyz"], vector, twist[:, :3]),
        CurvePanel(f"{frame} ω", "rad/s", [f"ω{a}" for a in "xyz"], vector, twist[:, 3:]),
        *build_joint_panels(run),
    ]


def _select_frame_twist(run: RunVariables, scene: Scene) -> tuple[str, Array]:
    """Return the name of the moving frame, and its twists (T, 6) in its own axes."""
    variable = "camera_velocity" if "camera_velocity" in run else "frame_velocity"
    frame = str(run[variable].attrs.get("frame", ""))
    target_frame = str(run["goal_pose"].attrs.get("frame", frame)) if "goal_pose" in run else frame
    if target_frame == frame:
        return variable.removesuffix("_velocity"), run[variable].values
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values
    _, twists = compute_frame_motion(scene, target_frame, run["q"].values[None], rates[None])
    return target_frame, twists[0]


def _compare_image_errors(run: RunVariables, second: RunVariables) -> CurvePanel:
    """Return the panel of the largest image distances of a feature point from its goal."""
    away = [one["pixels"].values - one["pixels_goal"].values for one in (run, second)]
    each = [np.linalg.norm(pixels, axis=-1) for pixels in away]
    largest = [x.max(axis=1) if x.shape[1] else np.full(len(x), np.nan) for x in each]
    colors = [palette.BLACK, palette.ORANGE]
    return CurvePanel(
        "image error", "px", ["this", "second"], colors, np.column_stack(largest), True
    )


def build_joint_panels(run: RunVariables) -> list[CurvePanel]:
    """Return the panels of the velocities of the joints and of their torques, if there are any.

    The velocities are commands, except if torques are commanded.
    """
    names = run["velocity"].values.tolist()
    colors = [palette.cycle_color(i) for i in range(len(names))]
    torques = _build_torque_panels(run, colors)
    shown = {"qd": "joint velocities"}
    if _get_unit(run, "qd").startswith("N"):
        shown = {"qd_actual": "joint velocities", "qd": "commanded torques"}
    panels = [
        CurvePanel(title, _get_unit(run, name), names, colors, run[name].values)
        for name, title in shown.items()
        if name in run
    ]
    return [*panels, *torques]


def _get_unit(run: RunVariables, name: str) -> str:
    """Return the unit of a variable of a run."""
    return str(run[name].attrs.get("units", ""))


def _build_torque_panels(run: RunVariables, colors: list[str]) -> list[CurvePanel]:
    """Return the panel of the torques of the driven joints; none without a drive.

    Each joint has its colour among all velocities.
    """
    if "torque" not in run:
        return []
    joints = np.flatnonzero(~np.isnan(run["torque_limit"].values))
    names, own = run["velocity"].values[joints].tolist(), [colors[i] for i in joints]
    limited = (run["saturation"].values[:, joints] > 0.0).astype(np.uint32)
    unit, torques = str(run["torque"].attrs.get("units", "")), run["torque"].values[:, joints]
    return [CurvePanel("drive torques", unit, names, own, torques, limited=limited)]


def list_run_events(run: xr.Dataset) -> list[Entry]:
    """Return the events of a run: its end, with the outcome."""
    end = float(run["end_time"])
    return [{"time": end, "text": run_data.describe_ending(run)}] if np.isfinite(end) else []
