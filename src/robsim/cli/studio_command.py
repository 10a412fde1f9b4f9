"""Command `studio`: a live simulation in the browser."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.base import interrupt
from robsim.cli.console import print_text
from robsim.cli.output_files import find_run_file, path_exists

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment
    from robsim.studies.study_result import StudyResult
    from robsim.studio.scenario_shelf import ScenarioShelf

LOOK = 0.2  # interval between checks for an interrupt, seconds
LATE = 60.0  # longest time until a browser opens the page, seconds
GONE = 5.0  # time without a page after which it counts as closed, seconds
FIRST = "eye_in_hand"  # default scenario of a studio

no_open_option = click.option("--no-open", is_flag=True, help="Do not open a browser.")


@click.command("studio")
@click.argument(
    "shown", metavar="[FILE|RUN|FOLDER]", required=False, type=click.Path(path_type=Path)
)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address of the server.")
@click.option(
    "--port",
    default=0,
    type=click.IntRange(0, 65535),
    help="Port of the server; 0 is any free port.",
)
@click.option("--allow-remote", is_flag=True, help="Permit a host that other machines can reach.")
@no_open_option
def open_studio(
    shown: Path | None, host: str, port: int, allow_remote: bool, no_open: bool
) -> None:
    """Show and change a running simulation in the browser.

    FILE is a scenario, and RUN a run.nc or its folder. FOLDER has scenarios to choose from, or the
    results of a study: a map opens any of its runs. Ctrl-C ends the studio.
    """
    serve_studio(*_load_shown(shown), host, port, allow_remote, no_open)


def serve_studio(
    shown: Experiment | StudyResult,
    shelf: ScenarioShelf | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    allow_remote: bool = False,
    no_open: bool = False,
    once: bool = False,
) -> None:
    """Serve a studio until an interrupt, and open it in a browser if there is one.

    If `once`, the studio also ends when its page is closed.
    """
    from robsim.page.export import open_in_browser
    from robsim.studio.studio import studio

    with (
        interrupt.defer_stops() as stops,
        studio(shown, shelf, host=host, port=port, allow_remote=allow_remote) as server,
    ):
        if server.exposed:
            print_text(server.exposed, err=True)
        if no_open or not open_in_browser(server.address):
            print_text(f"open {server.address} in a browser; Ctrl-C ends it")
        else:
            print_text(f"the studio is open at {server.address}; Ctrl-C ends it")
        began, last_page = time.monotonic(), None  # last time with a page
        while not stops and not server.wait(LOOK):
            now = time.monotonic()
            last_page = now if server.pages else last_page
            if once and now - (last_page or began + LATE) > GONE:
                break


def _load_shown(shown: Path | None) -> tuple[Experiment | StudyResult, ScenarioShelf | None]:
    """Return the study or experiment at a path, and the scenarios to choose from, if any."""
    from robsim.files import examples
    from robsim.run.experiment import Experiment, load_scenario
    from robsim.studies.study_store import ABOUT
    from robsim.studio.scenario_shelf import ScenarioShelf

    if shown is None:
        return load_scenario(examples.path(FIRST)), None
    path = find_run_file(shown) if path_exists(shown / "run.nc") else shown
    if path_exists(path / ABOUT) or any(
        path.glob("rows-*.parquet")
    ):  # a damaged study raises its own error
        from robsim.studies.api import open_study

        return open_study(path), None
    if path_exists(path) and path.is_dir():
        shelf = ScenarioShelf.of(path)
        return shelf.first(), shelf
    if path.suffix == ".nc":
        from robsim.files.netcdf import open_run

        return Experiment.of(open_run(path)), None
    return load_scenario(path), ScenarioShelf(
        [path, *(Path(examples.path(n)) for n in examples.names())]
    )
