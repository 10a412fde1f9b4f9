"""The page and the films that show a run in motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robsim.base.errors import InputError
from robsim.cli.progress import progress_bar

if TYPE_CHECKING:
    import xarray as xr

    from robsim.run.experiment import Experiment
    from robsim.run.mission_run import MissionRun

PAGE = "run.html"
VIEWS = (PAGE, "run.gif", "run.mp4")


def check_views(scenario: Experiment, names: tuple[str, ...], camera: str | None = None) -> None:
    """Raise InputError if the files cannot show the run of a scenario, or a camera of it."""
    from robsim.plot.film.animation import check_film_path
    from robsim.world.mounted_camera import get_picture_size

    if camera is not None:
        get_picture_size(scenario.scene.camera(camera))
    for name in names:
        if name != PAGE:
            check_film_path(name)
        start = scenario.start
        runs = len(start) if start is not None and start.ndim > 1 else 1
        if runs != 1:
            raise InputError(f"{name} shows one run, and {scenario.source} has {runs} starts")
        if scenario.record == "summary":
            raise InputError(
                f"{name} shows all instants of a run: set record = all instead of summary"
            )


def write_views(
    result: xr.Dataset | MissionRun,
    scenario: Experiment,
    folder: Path,
    names: tuple[str, ...],
    camera: str | None = None,
) -> None:
    """Write the page and the films of a run; the films show the pictures of a camera if named."""
    from robsim.page.export import export_html
    from robsim.plot.film.animation import save_film

    for name in names:
        if name == PAGE:
            export_html(result, folder / name, scenario)
        else:
            with progress_bar(f"drawing {name}") as progress:
                save_film(result, folder / name, scenario, camera=camera, progress=progress)
