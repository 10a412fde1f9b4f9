"""`python -m robsim` is the command `robsim`."""

from robsim.cli import main

if __name__ == "__main__":
    main()
