"""Command `examples`: list or copy the scenarios that come with RobSim."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.atomic_files import write_whole
from robsim.cli.console import print_text
from robsim.cli.options import force_option
from robsim.cli.output_files import choose_output_file
from robsim.cli.schema_command import write_schema_beside
from robsim.files import examples

WIDTH = 100  # largest width of a line of the remark, characters


@click.command("examples")
@click.argument("name", required=False)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File or folder for the copy."
)
@force_option
def copy_example(name: str | None, output: Path | None, force: bool) -> None:
    """List the example scenarios, or copy one to a file.

    With NAME, the scenario and its JSON Schema are written, and a remark about it is printed.
    """
    from robsim.files.scenario_remark import extract_remark
    from robsim.run.experiment import load_scenario

    if name is None:
        width = max(map(len, examples.names()))
        for each in examples.names():
            print_text(f"{each:{width}}  {load_scenario(examples.path(each)).title}")
        print_text("copy one to a file: robsim examples NAME")
        return
    source, target = examples.path(name), choose_output_file(output, f"{name}.toml", force)
    text = source.read_text(encoding="utf-8")
    write_whole(target, text)
    print_text(f"wrote {target}; run it with: robsim run {target}")
    if beside := write_schema_beside(target, force):
        print_text(f"wrote {beside}, the schema for editors that complete and check it")
    watch, *further = extract_remark(text).split("\n")
    print_text("\n".join([click.wrap_text(watch, WIDTH), *further]))
