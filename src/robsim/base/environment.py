"""Environment variables of Numba and Matplotlib with values that these libraries do not survive."""

import os
import re
import sys

from robsim.base.errors import InputError, format_value

_FEATURES = re.compile(r"([+-][^,]+(,[+-][^,]+)*)?")  # of NUMBA_CPU_FEATURES; LLVM aborts otherwise


def check_numba_variables() -> None:
    """Raise InputError if a variable of Numba makes compiled kernels impossible.

    Numba warns of other invalid values and ignores them.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "").strip() not in ("", "0"):
        raise InputError(
            "environment variable NUMBA_DISABLE_JIT: RobSim's kernels require Numba's compiler: "
            "unset it"
        )
    threads = os.environ.get("NUMBA_NUM_THREADS", "").strip()
    if re.fullmatch(r"0+|-\d+", threads):
        _refuse("NUMBA_NUM_THREADS", threads, "a number of threads, at least 1")
    features = os.environ.get("NUMBA_CPU_FEATURES", "")
    if not _FEATURES.fullmatch(features):
        _refuse("NUMBA_CPU_FEATURES", features, 'features with a sign, such as "+avx2,-avx512f"')


def check_matplotlib_backend() -> None:
    """Raise InputError if Matplotlib does not know the backend of the variable MPLBACKEND."""
    backend = os.environ.get("MPLBACKEND", "agg")
    if backend.lower() == "agg" or "matplotlib" in sys.modules:
        return
    try:
        import matplotlib  # noqa: F401  it checks the variable
    except ValueError as reason:
        _refuse("MPLBACKEND", backend, str(reason).partition("supported values are ")[2])


def _refuse(variable: str, value: str, expected: str) -> None:
    """Raise InputError for the value of an environment variable."""
    raise InputError(
        f"environment variable {variable}: expected {expected}, got {format_value(value)}"
    ) from None
