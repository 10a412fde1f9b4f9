"""Command `schema`: print the JSON Schema of scenario files and robot files."""

from __future__ import annotations

import json
from pathlib import Path

import click

from robsim.base.atomic_files import write_whole
from robsim.cli.console import print_text
from robsim.cli.output_files import path_exists

FILE = "robsim.schema.json"  # as in the first line of each example


@click.command("schema")
@click.option("--robot", is_flag=True, help="Print the schema of robot files.")
def print_schema(robot: bool) -> None:
    """Print the JSON Schema of scenario files or robot files.

    Redirect it to a file: robsim schema > robsim.schema.json. Editors that support JSON Schema for
    TOML, for instance by Taplo, then complete and check a file with the first line `#:schema
    robsim.schema.json`.
    """
    print_text(build_schema_text(robot), nl=False)


def build_schema_text(robot: bool = False) -> str:
    """Return the JSON Schema of scenario files, or of robot files."""
    from robsim.declare.schema import json_schema
    from robsim.files.toml import SCHEMA
    from robsim.robot.robot_table import RobotTable
    from robsim.run.experiment_text import ExperimentTable

    kind = RobotTable if robot else ExperimentTable
    return json.dumps(json_schema(kind, schema={"const": SCHEMA}), indent=1) + "\n"


def write_schema_beside(target: Path, force: bool) -> Path | None:
    """Write the schema beside a scenario file and return its path; None if it exists already."""
    path = target.parent / FILE
    if path_exists(path) and not force:
        return None
    write_whole(path, build_schema_text())
    return path
