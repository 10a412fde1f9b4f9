"""Command `studio`: a live simulation in the browser."""

from __future__ import annotations

import difflib
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.base import interrupt
from robsim.base.errors import FileError
from robsim.cli.console import print_text
from robsim.cli.output_files import find_run_file, path_exists

if TYPE_CHECKING:
    from robsim.robot.robot import Robot
    from robsim.run.experiment import Experiment
    from robsim.studies.study_result import StudyResult
    from robsim.studio.scenario_shelf import ScenarioShelf

LOOK = 0.2  # interval between checks for an interrupt, seconds
LATE = 60.0  # longest time until a browser opens the page, seconds
GONE = 5.0  # time without a page after which it counts as closed, seconds
DESCRIPTIONS = (".urdf", ".xacro", ".xml")  # suffixes of robot descriptions
FIRST = "eye_in_hand"  # default scenario of a studio

no_open_option = click.option("--no-open", is_flag=True, help="Do not open a browser.")


@click.command("studio")
@click.argument(
    "shown", metavar="[FILE|RUN|FOLDER|ROBOT]", required=False, type=click.Path(path_type=Path)
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
    results of a study: a map opens any of its runs. ROBOT is a URDF file or a robot of the library,
    such as panda: a teach pendant moves it and records poses. Ctrl-C ends the studio.
    """
    serve_studio(*_load_shown(shown), host, port, allow_remote, no_open)


def serve_studio(
    shown: Experiment | StudyResult | Robot,
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


def _load_shown(
    shown: Path | None,
) -> tuple[Experiment | StudyResult | Robot, ScenarioShelf | None]:
    """Return the study, experiment or robot of a path or name, and the scenarios to choose from."""
    from robsim.files import examples
    from robsim.run.experiment import Experiment, load_scenario
    from robsim.studies.study_store import ABOUT
    from robsim.studio.scenario_shelf import ScenarioShelf

    if shown is None:
        return load_scenario(examples.path(FIRST)), None
    if (robot := _load_robot(shown)) is not None:
        return robot, None
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


def _load_robot(shown: Path) -> Robot | None:
    """Return the robot of a URDF file or of the library, or None for other files and folders.

    A file or folder has priority over a robot of the same name. Raise FileError if a name without
    a suffix is neither.
    """
    from robsim.files import robots
    from robsim.robot.robot import Robot

    if shown.suffix.lower() in DESCRIPTIONS:
        return Robot.from_urdf(shown)
    if path_exists(shown) or shown.suffix or len(shown.parts) != 1:
        return None
    if shown.name in robots.names():
        return robots.load(shown.name)
    nearby = [path.name for path in Path().iterdir() if path.suffix in (".toml", ".nc", ".urdf")]
    near = difflib.get_close_matches(shown.name, [*robots.names(), *nearby], n=1, cutoff=0.5)
    guess = f"did you mean '{near[0]}'? " if near else ""
    raise FileError(
        f"no file, folder or robot '{shown.name}'; {guess}robots: {', '.join(robots.names())}"
    )
