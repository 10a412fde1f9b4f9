"""What kernels say to the user, on stderr."""

import os
import sys

_said = False  # whether `unkept` has said it


def quiet() -> bool:
    """Return whether nothing is to be said: `ROBSIM_QUIET` is set, or a test runs."""
    return bool(os.environ.get("ROBSIM_QUIET") or os.environ.get("PYTEST_CURRENT_TEST"))


def write(text: str) -> None:
    """Write a text now, where there is a stderr: a program without a console has none."""
    if sys.stderr:
        sys.stderr.write(text)
        sys.stderr.flush()


def unkept(why: str) -> None:
    """Say once in a process that its kernels are not kept, unless nothing is to be said."""
    global _said  # noqa: PLW0603
    if not _said and not quiet():
        _said = True
        write(f"robsim: compiling kernels, in each process anew: {why}\n")
