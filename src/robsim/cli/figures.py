"""The figures of one run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robsim.cli.files import writing

if TYPE_CHECKING:
    import xarray as xr

    from robsim.run.experiment import Experiment
    from robsim.run.mission_run import MissionRun


def draw(result: xr.Dataset, scenario: Experiment, folder: Path) -> None:
    """Write the figures of a run: all of a single run, images of a batch, none of a summary."""
    from robsim import plot

    if "time" not in result.dims:
        return  # a summary has nothing to draw
    cameras = list(dict.fromkeys(result.mark_camera.values.tolist()))
    names = [f"image_{camera}" if i else "image" for i, camera in enumerate(cameras)]
    scene, task = scenario.scene, scenario.task
    pairs = zip(names, cameras, strict=True)
    figures = {name: plot.image(result, each, scene) for name, each in pairs}
    if "run" not in result.dims:
        figures |= {
            "scene": plot.scene(scene, run=result, goal=task),
            "velocity": plot.velocity(result, scene, _moving_frame(result, scenario)),
        }
    for name, figure in figures.items():
        with writing(folder / f"{name}.png") as path:
            figure.savefig(path, dpi=200)


def draw_mission(result: MissionRun, scenario: Experiment, folder: Path) -> None:
    """The scene where the mission ended."""
    from robsim import plot

    last = result.legs[-1]
    with writing(folder / "scene.png") as path:
        plot.scene(last.scene, last.q_end).savefig(path, dpi=200)


def _moving_frame(result: xr.Dataset, scenario: Experiment) -> str | None:
    """Return the frame whose velocity is drawn; None for the camera.

    Where the camera stands still, it is the frame that carries the target.
    """
    if not result.sizes["mark"]:
        return None
    scene, target = scenario.scene, str(result.mark_target.values[0])
    stands = not scene.tree.carries(str(result.mark_camera.values[0])).any()
    return scene.object(target).on if stands else None
