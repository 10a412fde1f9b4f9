"""The command line of RobSim."""

import gc
import sys

from robsim.base import interrupt


def main() -> None:
    """Run the command line; exit with status 0 after success, 2 for bad input.

    Interrupts are handled from here on, also during the import of the commands, which takes time.
    """
    with interrupt.listen_for_stops():
        try:
            from robsim.cli.commands import run_command_line

            interrupt.raise_pending_stop()
            run_command_line()
        except KeyboardInterrupt:  # an interrupt before the command handles it
            sys.stderr.write("stopped\n")
            sys.exit(interrupt.get_exit_status())
        finally:
            gc.freeze()  # Python's last collection would visit all objects, which takes seconds
