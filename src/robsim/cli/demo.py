"""The command `demo`: simulate the experiment of the chapter, and show it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.cli.files import results_folder
from robsim.cli.options import output
from robsim.cli.run import FILES, simulate_into
from robsim.cli.scenarios import load
from robsim.cli.studio import no_open as no_open_option
from robsim.cli.studio import serve
from robsim.cli.tell import tell
from robsim.cli.views import PAGE
from robsim.files import examples

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


@click.command("demo")
@output
@no_open_option
def command(output: Path | None, force: bool, no_figures: bool, no_open: bool) -> None:
    """Run the chapter's section 6.1: a Rhino XR-4 servoing on a cube, and see it move.

    Where there is a browser it opens a page of the live simulation, until that is closed.
    """
    scenario = load(examples.path("chapter_6_1"), ())
    views = () if no_figures else (PAGE,)
    with results_folder(output, "robsim-demo", force, FILES) as folder:
        simulate_into(scenario, folder, not no_figures, views=views)
    if views:
        _show(scenario, folder / PAGE, no_open)


def _show(scenario: Experiment, page: Path, no_open: bool) -> None:
    """Show the simulation where a person would see it; else say how to see its page."""
    from robsim.page.export import has_browser

    if no_open or not has_browser():
        tell(f"see it move  open {page} in any browser")
    else:
        serve(scenario, once=True)
