"""The command `robsim`, which is also `python -m robsim`."""

import sys

from robsim.base import interrupt


def main() -> None:
    """Run the command line, which hears what would end it from here on."""
    with interrupt.listening():
        try:
            from robsim.cli import main as command

            command()
        except KeyboardInterrupt:  # before the command could take it
            sys.exit(interrupt.status())


if __name__ == "__main__":
    main()
