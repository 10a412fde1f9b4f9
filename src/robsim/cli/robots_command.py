"""Command `robots`: list or describe the robots that come with RobSim."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.errors import FileError
from robsim.cli.console import print_text
from robsim.cli.figure_files import save_figure
from robsim.cli.options import force_option
from robsim.cli.output_files import choose_output_file
from robsim.files import robots


@click.command("robots")
@click.argument("name", required=False)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File or folder for the figure."
)
@force_option
def describe_robots(name: str | None, output: Path | None, force: bool) -> None:
    """List the robots of the library, or describe and draw one.

    With NAME, the joints, tip and sources of the robot are printed, and its figure is written.
    """
    from robsim.cli.robot_description import format_robot

    if name is None:
        if output or force:
            raise click.UsageError("-o and --force need a robot: robsim robots NAME")
        for each in robots.names():
            links = ", ".join(link.name for link in robots.load(each).links)
            print_text(f"{each:18} {robots.about(each)}\n{'':18} links: {links}")
        print_text("print and draw one: robsim robots NAME")
        return
    print_text(format_robot(name))
    target = choose_output_file(output, f"{name}.png", force)
    _draw_robot_file(name, target)
    print_text(f"figure at home: {target}")


def _draw_robot_file(name: str, target: Path) -> None:
    """Write the figure of a robot at home; raise FileError for an unknown format."""
    from robsim import plot

    figure = plot.robot(robots.load(name))
    kinds = figure.canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in kinds:
        supported = ", ".join(f".{kind}" for kind in sorted(kinds))
        raise FileError(f"{target}: the name of a figure ends in one of {supported}")
    save_figure(figure, target)
