"""Command `demo`: simulate the experiment of the chapter, and show it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.cli.console import print_text
from robsim.cli.options import output
from robsim.cli.output_files import claim_results_folder
from robsim.cli.page_and_films import PAGE
from robsim.cli.run_command import FILES, simulate_into_folder
from robsim.cli.scenarios import load_with_changes
from robsim.cli.studio_command import no_open_option, serve_studio
from robsim.files import examples

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


@click.command("demo")
@output
@no_open_option
def run_demo(output: Path | None, force: bool, no_figures: bool, no_open: bool) -> None:
    """Run the experiment of the chapter and show it in motion.

    The experiment is from section 6.1 of the chapter: a camera guides a Rhino XR-4 to a cube. If a
    browser is available, a page of the live simulation opens, and the command ends when the page
    is closed.
    """
    scenario = load_with_changes(examples.path("chapter_6_1"), ())
    views = () if no_figures else (PAGE,)
    with claim_results_folder(output, "robsim-demo", force, FILES) as folder:
        simulate_into_folder(scenario, folder, not no_figures, views=views)
    if views:
        _show_demo(scenario, folder / PAGE, no_open)


def _show_demo(scenario: Experiment, page: Path, no_open: bool) -> None:
    """Show the simulation in a browser; without a browser print the path of its page."""
    from robsim.page.export import has_browser

    if no_open or not has_browser():
        print_text(f"see it move  open {page} in any browser")
    else:
        serve_studio(scenario, once=True)
