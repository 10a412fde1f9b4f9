"""Messages of the kernel cache to the user on stderr."""

import os
import sys

_has_reported = False  # whether `report_uncached_kernels` has written its line


def is_quiet() -> bool:
    """Return whether messages are suppressed: `ROBSIM_QUIET` is set, or a test runs."""
    return bool(os.environ.get("ROBSIM_QUIET") or os.environ.get("PYTEST_CURRENT_TEST"))


def write_stderr(text: str) -> None:
    """Write a text and flush it. A program without a console has no stderr."""
    if sys.stderr:
        sys.stderr.write(text)
        sys.stderr.flush()


def report_uncached_kernels(why: str) -> None:
    """Report once in a process that its kernels are not cached, unless messages are suppressed."""
    global _has_reported  # noqa: PLW0603
    if not _has_reported and not is_quiet():
        _has_reported = True
        write_stderr(f"robsim: compiling kernels, in each process anew: {why}\n")
