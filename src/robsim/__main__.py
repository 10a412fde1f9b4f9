"""Run the command `robsim` by `python -m robsim`."""

from robsim.cli import main

if __name__ == "__main__":
    main()
