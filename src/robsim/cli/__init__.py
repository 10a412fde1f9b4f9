"""The command line."""

import sys

from robsim.base import interrupt


def main() -> None:
    """Run the command line; exit status 0 when a simulation ran, 2 for bad input.

    What would end the process is heard from here on, before all that takes time to import.
    """
    with interrupt.listening():
        try:
            from robsim.cli.commands import run_command

            interrupt.look()
            run_command()
        except KeyboardInterrupt:  # before the command could take it
            sys.stderr.write("stopped\n")
            sys.exit(interrupt.status())
