"""Command `examples`: list or copy the scenarios that come with RobSim."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.atomic_files import write_whole
from robsim.base.errors import FileError
from robsim.cli.console import print_text
from robsim.cli.options import force_option
from robsim.cli.output_files import choose_output_file, path_exists
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

    With NAME, the scenario with its picture and its JSON Schema are written, and a remark about it
    is printed.
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
    if picture := _copy_picture(source, target, force):
        print_text(f"wrote {picture}, which the scenario shows")
    if beside := write_schema_beside(target, force):
        print_text(f"wrote {beside}, the schema for editors that complete and check it")
    watch, *further = extract_remark(text).split("\n")
    print_text("\n".join([click.wrap_text(watch, WIDTH), *further]))


def _copy_picture(source: Path, target: Path, force: bool) -> Path | None:
    """Copy the picture of a scenario beside its copy and return its path; None without a picture.

    Raise FileError if another file has its name, unless `force`.
    """
    picture = source.with_suffix(".png")
    if not picture.exists():
        return None
    content, copy = picture.read_bytes(), target.parent / picture.name
    if path_exists(copy) and not force:
        if copy.read_bytes() == content:
            return None
        raise FileError(f"{copy} exists; overwrite it with --force")
    write_whole(copy, content)
    return copy
