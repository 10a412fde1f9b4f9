"""The command `robots`: list or describe the robots that come with RobSim."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.errors import FileError
from robsim.cli.figures import save_figure
from robsim.cli.files import free_file
from robsim.cli.options import force
from robsim.cli.tell import tell
from robsim.files import robots


@click.command("robots")
@click.argument("name", required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Where to draw it.")
@force
def command(name: str | None, output: Path | None, force: bool) -> None:
    """List the robots of the library, or print the table of one and draw it."""
    from robsim.cli.robot_table import robot_table

    if name is None:
        if output or force:
            raise click.UsageError("-o and --force are for one robot: robsim robots NAME")
        for each in robots.names():
            links = ", ".join(link.name for link in robots.load(each).links)
            tell(f"{each:18} {robots.about(each)}\n{'':18} links: {links}")
        tell("print and draw one: robsim robots NAME")
        return
    tell(robot_table(name))
    target = free_file(output, f"{name}.png", force)
    _draw(name, target)
    tell(f"drawn at home: {target}")


def _draw(name: str, target: Path) -> None:
    from robsim import plot

    figure = plot.robot(robots.load(name))
    kinds = figure.canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in kinds:
        known = ", ".join(f".{kind}" for kind in sorted(kinds))
        raise FileError(f"{target}: the name of a figure ends in one of {known}")
    save_figure(figure, target)
