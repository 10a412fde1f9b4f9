"""The command line."""

import sys

from robsim.base import interrupt


def main() -> None:
    """Run the command line; exit status 0 when a simulation ran, 2 for bad input.

    What would end the process is heard from here on, before all that takes time to import.
    """
    with interrupt.listen_for_stops():
        try:
            from robsim.cli.commands import run_command_line

            interrupt.raise_pending_stop()
            run_command_line()
        except KeyboardInterrupt:  # before the command could take it
            sys.stderr.write("stopped\n")
            sys.exit(interrupt.get_exit_status())
