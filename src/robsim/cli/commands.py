"""The commands, each of which has a file, and how they end."""

from __future__ import annotations

import gc
import sys

import click

from robsim import __version__
from robsim.base import interrupt
from robsim.base.errors import Interrupted, RobSimError
from robsim.cli import (
    bench,
    check,
    compare,
    demo,
    examples,
    explain,
    export,
    robots,
    run,
    schema,
    studio,
    study,
    warm,
)
from robsim.cli.tell import tell

BAD_INPUT = 2  # exit status
NEW_OBJECTS = 100_000  # between looks for garbage, which at Python's 700 take a sixth of a start


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="robsim")
def cli() -> None:
    """Model, simulate and see robots that are guided by cameras."""


for _each in (
    *(demo, run, compare, study, bench, check, explain, export, examples, robots, schema, studio),
    warm,
):
    cli.add_command(_each.command)


def run_command() -> None:
    """Run the command that the arguments name; exit status 0 when it is done, 2 for bad input."""
    gc.set_threshold(NEW_OBJECTS)
    try:
        cli(standalone_mode=False)
    except (click.Abort, KeyboardInterrupt, Interrupted):  # the last of what is not to be saved
        tell("stopped", err=True)
        sys.exit(interrupt.status())
    except RobSimError as error:
        tell(f"error: {error}", err=True)
        sys.exit(BAD_INPUT)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        sys.stderr.close()
