"""What a recording says in curves, events and words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.page.recording_frames import Entry
from robsim.plot import palette, run_data
from robsim.run.experiment import Experiment
from robsim.run.simulation_dataset import compute_frame_motion
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class CurvePanel:
    """A panel of curves: values (T, n), one column for each name."""

    title: str
    unit: str
    names: list[str]
    colors: list[str]
    values: Array
    log: bool = False

    @property
    def entry(self) -> Entry:
        """The entry of the header, which names the array of the values."""
        told = {key: getattr(self, key) for key in ("title", "unit", "names", "colors", "log")}
        return {**told, "values": self.array}

    @property
    def array(self) -> str:
        """The name of the array of the values."""
        return f"curve {self.title}"


def build_curve_panels(
    run: xr.Dataset, scene: Scene, second: xr.Dataset | None = None
) -> list[CurvePanel]:
    """Return the panels of curves: the error, the velocity of what moves, and the joints.

    With a second run, the image errors of both stand beside each other.
    """
    whose, twist = _select_frame_twist(run, scene)
    vector = [color for color, _ in palette.COMPONENTS]
    error = np.column_stack([run["error_norm"].values, np.abs(run["error"].values)])
    names = ["|e|", *(f"|e{i}|" for i in range(error.shape[1] - 1))]
    units = sorted(set(run["feature_unit"].values.tolist()))
    unit = "" if units == ["1"] else ", ".join(units)
    grey = [palette.BLACK, *[palette.GREY] * (error.shape[1] - 1)]
    return [
        *([] if second is None else [_compare_image_errors(run, second)]),
        CurvePanel("error", unit, names, grey, error, True),
        CurvePanel(f"{whose} v", "m/s", [f"v{a}" for a in "xyz"], vector, twist[:, :3]),
        CurvePanel(f"{whose} ω", "rad/s", [f"ω{a}" for a in "xyz"], vector, twist[:, 3:]),
        *build_joint_panels(run),
    ]


def _select_frame_twist(run: xr.Dataset, scene: Scene) -> tuple[str, Array]:
    """Return the name of the frame that moves, in its own axes, and its twists (T, 6)."""
    given = "camera_velocity" if "camera_velocity" in run else "frame_velocity"
    frame = str(run[given].attrs.get("frame", ""))
    moved = str(run["goal_pose"].attrs.get("frame", frame)) if "goal_pose" in run else frame
    if moved == frame:
        return given.removesuffix("_velocity"), run[given].values
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values
    _, twists = compute_frame_motion(scene, moved, run["q"].values[None], rates[None])
    return moved, twists[0]


def _compare_image_errors(run: xr.Dataset, second: xr.Dataset) -> CurvePanel:
    """Return the largest distance of a mark from its goal in the image, for two schemes."""
    each = [np.linalg.norm(one["pixels"] - one["pixels_goal"], axis=-1) for one in (run, second)]
    largest = [x.max(axis=1) if x.shape[1] else np.full(len(x), np.nan) for x in each]
    colors = [palette.BLACK, palette.ORANGE]
    return CurvePanel(
        "image error", "px", ["this", "second"], colors, np.column_stack(largest), True
    )


def build_joint_panels(run: xr.Dataset) -> list[CurvePanel]:
    """Return the panel of the velocities that are commanded."""
    names = run["velocity"].values.tolist()
    colors = [palette.cycle_color(i) for i in range(len(names))]
    return [CurvePanel("joint velocities", "", names, colors, run["qd"].values)]


def list_run_events(run: xr.Dataset) -> list[Entry]:
    """Return what happened when: the end of the run, and its outcome."""
    end = float(run["end_time"])
    return [{"time": end, "text": run_data.describe_ending(run)}] if np.isfinite(end) else []


def collect_run_texts(run: xr.Dataset, experiment: Experiment, trials: bool) -> dict[str, str]:
    """Return the explanation and the text of the experiment, where there are such."""
    from robsim.analysis.explanation.explanation import explain

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
