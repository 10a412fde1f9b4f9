"""The command `examples`: list or copy the scenarios that come with RobSim."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.output import write_whole
from robsim.cli.files import free_file
from robsim.cli.options import force
from robsim.cli.schema import write_beside
from robsim.cli.tell import tell
from robsim.files import examples

WIDTH = 100  # characters of a line of the remark


@click.command("examples")
@click.argument("name", required=False)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Where to copy it.")
@force
def command(name: str | None, output: Path | None, force: bool) -> None:
    """List the example scenarios, or copy one out and say what to watch for in it."""
    from robsim.run.experiment import load_scenario
    from robsim.studio.gallery import remark

    if name is None:
        for each in examples.names():
            tell(f"{each:20} {load_scenario(examples.path(each)).title}")
        tell("copy one out: robsim examples NAME")
        return
    source, target = examples.path(name), free_file(output, f"{name}.toml", force)
    text = source.read_text(encoding="utf-8")
    write_whole(target, text)
    tell(f"wrote {target}; run it with: robsim run {target}")
    if beside := write_beside(target, force):
        tell(f"wrote {beside}, by which editors complete and check it")
    watch, *further = remark(text).split("\n")
    tell("\n".join([click.wrap_text(watch, WIDTH), *further]))
