"""Environment variables of libraries, with values that these libraries do not survive."""

import os
import re

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
        refuse_variable("NUMBA_NUM_THREADS", threads, "a number of threads, at least 1")
    features = os.environ.get("NUMBA_CPU_FEATURES", "")
    if not _FEATURES.fullmatch(features):
        refuse_variable(
            "NUMBA_CPU_FEATURES", features, 'features with a sign, such as "+avx2,-avx512f"'
        )


def refuse_variable(variable: str, value: str, expected: str) -> None:
    """Raise InputError for the value of an environment variable."""
    raise InputError(
        f"environment variable {variable}: expected {expected}, got {format_value(value)}"
    ) from None
