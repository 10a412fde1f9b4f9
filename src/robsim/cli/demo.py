"""The command `demo`: simulate the experiment of the chapter, and show it."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.cli.files import results_folder
from robsim.cli.options import output
from robsim.cli.run import FILES, simulate_into
from robsim.cli.scenarios import load
from robsim.cli.tell import tell
from robsim.cli.views import PAGE
from robsim.files import examples


@click.command("demo")
@output
@click.option("--no-open", is_flag=True, help="Do not open the page in the browser.")
def command(output: Path | None, force: bool, no_figures: bool, no_open: bool) -> None:
    """Run the chapter's section 6.1: a Rhino XR-4 servoing on a cube, and see it move."""
    scenario = load(examples.path("chapter_6_1"), ())
    views = () if no_figures else (PAGE,)
    with results_folder(output, "robsim-demo", force, FILES) as folder:
        simulate_into(scenario, folder, not no_figures, views=views)
        if views:
            _show(folder / PAGE, no_open)


def _show(page: Path, no_open: bool) -> None:
    """Open the page where a person would see it; else say how to see it."""
    from robsim.page.export import has_browser, open_page

    if no_open or not has_browser():
        tell(f"see it move  open {page} in any browser")
    else:
        open_page(page)
