"""The command `demo`: simulate the experiment of the chapter."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.cli.files import results_folder
from robsim.cli.options import output
from robsim.cli.run import FILES, simulate_into
from robsim.cli.scenarios import load
from robsim.files import examples


@click.command("demo")
@output
def command(output: Path | None, force: bool, no_figures: bool) -> None:
    """Run the chapter's section 6.1: a Rhino XR-4 servoing on a cube."""
    scenario = load(examples.path("chapter_6_1"), ())
    with results_folder(output, "robsim-demo", force, FILES) as folder:
        simulate_into(scenario, folder, not no_figures)
