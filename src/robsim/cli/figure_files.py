"""Writing of the figures of a run."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robsim.base.atomic_files import write_whole

if TYPE_CHECKING:
    import xarray as xr

    from robsim.run.experiment import Experiment
    from robsim.run.mission_run import MissionRun


def write_run_figures(result: xr.Dataset, scenario: Experiment, folder: Path) -> None:
    """Write the figures of a run: for a batch only images, for a summary none."""
    from robsim import plot
    from robsim.plot import run_data

    if "time" not in result.dims:
        return  # a summary
    cameras = run_data.list_run_cameras(result)
    names = [f"image_{camera}" if i else "image" for i, camera in enumerate(cameras)]
    scene, task = scenario.scene, scenario.task
    pairs = zip(names, cameras, strict=True)
    figures = {name: plot.image(result, each, scene) for name, each in pairs}
    if "run" not in result.dims:
        figures |= {
            "scene": plot.scene(scene, run=result, goal=task),
            "velocity": plot.velocity(result, scene, run_data.find_moving_frame(result, scene)),
        }
        if "torque" in result:
            figures["torques"] = plot.torques(result)
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png")


def write_mission_figure(result: MissionRun, scenario: Experiment, folder: Path) -> None:
    """Write a figure of the scene at the end of a mission."""
    from robsim import plot

    last = result.legs[-1]
    save_figure(plot.scene(last.scene, last.q_end), folder / "scene.png")


def save_figure(figure: Any, path: Path) -> None:  # Any: only plot imports Matplotlib
    """Write a figure in the format of the suffix of the path."""
    image = BytesIO()
    figure.savefig(image, format=path.suffix[1:].lower(), dpi=200)
    with image.getbuffer() as content:
        write_whole(path, content)
