"""The commands, each of which has a file, and how they end."""

from __future__ import annotations

import gc
import sys

import click

from robsim import __version__
from robsim.base import interrupt
from robsim.base.errors import Interrupted, RobSimError
from robsim.cli import (
    bench_command,
    check_command,
    compare_command,
    demo_command,
    examples_command,
    explain_command,
    export_command,
    robots_command,
    run_command,
    schema_command,
    studio_command,
    study_command,
    warm_command,
)
from robsim.cli.console import print_text

BAD_INPUT = 2  # exit status
NEW_OBJECTS = 100_000  # between looks for garbage, which at Python's 700 take a sixth of a start


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="robsim")
def cli() -> None:
    """Model, simulate and see robots that are guided by cameras."""


for _each in (
    *(
        demo_command,
        run_command,
        compare_command,
        study_command,
        bench_command,
        check_command,
        explain_command,
        export_command,
        examples_command,
        robots_command,
        schema_command,
        studio_command,
    ),
    warm_command,
):
    cli.add_command(_each.command)


def run_command_line() -> None:
    """Run the command that the arguments name; exit status 0 when it is done, 2 for bad input."""
    gc.set_threshold(NEW_OBJECTS)
    try:
        cli(standalone_mode=False)
    except (click.Abort, KeyboardInterrupt, Interrupted):  # the last of what is not to be saved
        print_text("stopped", err=True)
        sys.exit(interrupt.get_exit_status())
    except RobSimError as error:
        print_text(f"error: {error}", err=True)
        sys.exit(BAD_INPUT)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        sys.stderr.close()
