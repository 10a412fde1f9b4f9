"""The group of all commands, and their exit status."""

from __future__ import annotations

import errno
import gc
import os
import sys

import click

from robsim import __version__
from robsim.base import environment, interrupt
from robsim.base.errors import Interrupted, RobSimError
from robsim.cli.bench_command import compare_suites
from robsim.cli.check_command import check_scenario
from robsim.cli.compare_command import compare_scenarios
from robsim.cli.console import print_text
from robsim.cli.demo_command import run_demo
from robsim.cli.examples_command import copy_example
from robsim.cli.robots_command import describe_robots
from robsim.cli.ros2_command import serve_ros2
from robsim.cli.run_command import simulate_scenario
from robsim.cli.schema_command import print_schema
from robsim.cli.stored_run_commands import explain_run_file, export_page
from robsim.cli.studio_command import open_studio
from robsim.cli.study_command import run_study_file
from robsim.cli.warm_command import compile_kernels

BAD_INPUT = 2  # exit status
NEW_OBJECTS = 100_000  # between garbage collections; the default of Python slows the start


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="robsim")
def cli() -> None:
    """Model, simulate and visualise robots that are guided by cameras."""


for _command in (
    run_demo,
    simulate_scenario,
    compare_scenarios,
    run_study_file,
    compare_suites,
    check_scenario,
    explain_run_file,
    export_page,
    copy_example,
    describe_robots,
    serve_ros2,
    print_schema,
    open_studio,
    compile_kernels,
):
    cli.add_command(_command)


def run_command_line() -> None:
    """Run the command in the arguments; exit with status 0 after success, 2 for bad input."""
    gc.set_threshold(NEW_OBJECTS)
    try:
        environment.check_numba_variables()
        cli(standalone_mode=False)
    except (click.Abort, KeyboardInterrupt, Interrupted):  # nothing is left to save
        print_text("stopped", err=True)
        sys.exit(interrupt.get_exit_status())
    except RobSimError as error:
        print_text(f"error: {error}", err=True)
        sys.exit(BAD_INPUT)
    except click.ClickException as error:
        error.show()
        if hint := _suggest_quotes(error.message, sys.argv):
            print_text(hint, err=True)
        sys.exit(BAD_INPUT)
    except BrokenPipeError:  # the reader has closed the output, as `head` does
        sys.stderr.close()
    except OSError as error:
        if error.filename is not None or error.errno != errno.ENOSPC:
            raise
        print_text(f"error: cannot write the output: {error.strerror}", err=True)
        with open(os.devnull, "w") as nowhere:  # for the rest of the output, written at the exit
            os.dup2(nowhere.fileno(), sys.stdout.fileno())
        sys.exit(BAD_INPUT)


def _suggest_quotes(message: str, arguments: list[str]) -> str:
    """Return the quoted change if an unexpected argument is the unit of a change before it."""
    for key, change, unit in zip(arguments, arguments[1:], arguments[2:], strict=False):
        if key == "--set" and "=" in change and f"extra argument ({unit})" in message:
            return f"a value with a space needs quotes: --set '{change} {unit}'"
    return ""
