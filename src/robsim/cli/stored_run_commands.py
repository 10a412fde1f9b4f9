"""Commands of stored runs: `export` writes pages and films, `explain` prints a cause."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from robsim.base.errors import InputError, raise_file_errors
from robsim.cli.console import print_text
from robsim.cli.options import force_option
from robsim.cli.output_files import choose_output_file, find_run_file, is_bag
from robsim.cli.progress import progress_bar

if TYPE_CHECKING:
    import xarray as xr

    from robsim.robot.robot import Robot
    from robsim.run.experiment import Experiment

FILMS = (".mp4", ".gif")


@click.command("export")
@click.argument("shown", metavar="RUN", type=click.Path(path_type=Path))
@click.argument("output", metavar="[FILE]", required=False, type=click.Path(path_type=Path))
@click.option("--camera", metavar="NAME", help="Camera whose pictures a film shows.")
@force_option
def export_page(shown: Path, output: Path | None, camera: str | None, force: bool) -> None:
    """Write a run, a scenario or a robot as one HTML page, or a run as a film.

    RUN is a run.nc or its folder, a scenario (.toml), or a robot (.urdf). Scenarios and robots are
    shown at their start. FILE is the file to write: a page, or a film of a run if it ends in .mp4
    or .gif. Any browser shows the page, without a network.
    """
    from robsim.page.export import export_html

    path = find_run_file(shown)
    target = choose_output_file(output, f"{shown.stem}.html", force)
    if target.suffix.lower() in FILMS:
        _export_film(path, target, camera)
        return
    if camera is not None:
        raise InputError(f"--camera is for films, and {target} is a page: name a .mp4 or a .gif")
    with raise_file_errors(path):
        export_html(_load_shown_object(path), target)
    print_text(f"open {target} in any browser")


def _export_film(path: Path, target: Path, camera: str | None) -> None:
    """Write a film of a stored run, or of the pictures of its camera."""
    from robsim.plot.film.animation import check_film_path, save_film

    check_film_path(target)
    with raise_file_errors(path), progress_bar(f"drawing {target}") as progress:
        run = cast("xr.Dataset", _load_shown_object(path))  # save_film refuses other objects
        save_film(run, target, camera=camera, progress=progress)
    print_text(f"wrote {target}")


def _load_shown_object(path: Path) -> xr.Dataset | Experiment | Robot:
    """Return the run, experiment or robot in a file, by its suffix."""
    if path.suffix == ".toml":
        from robsim.run.experiment import load_scenario

        return load_scenario(path)
    if path.suffix == ".urdf":
        from robsim.robot.robot import Robot

        return Robot.from_urdf(path)
    from robsim.files.netcdf import open_run

    return open_run(path)


@click.command("explain")
@click.argument("run", type=click.Path(path_type=Path))
@click.argument("scenario", required=False, type=click.Path(path_type=Path))
@click.option("--no-trials", is_flag=True, help="Do not simulate the suggested changes.")
@click.option("--unsealed", is_flag=True, help="Accept a RUN without a valid seal.")
def explain_run_file(run: Path, scenario: Path | None, no_trials: bool, unsealed: bool) -> None:
    """Explain the outcome of a run, and suggest changes.

    RUN is a run.nc or its folder, or a bag of ROS 2. SCENARIO is the experiment that the robot of a
    bag was meant to perform, if the bag does not contain it. The explanation names the cause and
    suggests changes of the experiment. The changes are tried by simulation, unless --no-trials is
    given.
    """
    from robsim.analysis.explanation.explanation import explain

    path = find_run_file(run)
    if is_bag(path):
        result = _read_bag_of_scenario(path, scenario)
    elif scenario is not None:
        raise InputError(f"a SCENARIO is for a bag, and {path} stores its experiment: leave it out")
    else:
        from robsim.files.netcdf import open_run

        result = open_run(path, unsealed=unsealed)
    with raise_file_errors(path):
        explanation = explain(result, trials=not no_trials)
    print_text(explanation)


def _read_bag_of_scenario(path: Path, scenario: Path | None) -> xr.Dataset:
    """Return the run in a bag, of a scenario file or of the experiment in the bag."""
    from robsim.logs.bag_reader import read_bag
    from robsim.run.experiment import load_scenario

    return read_bag(path, None if scenario is None else load_scenario(scenario))
