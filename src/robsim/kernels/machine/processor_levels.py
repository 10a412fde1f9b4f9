"""The processor, and the levels of processors for which the package has machine code."""

import platform
import sys

_V3 = {"avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt"}
_V4 = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
LEVELS = {"x86-64-v4": _V4, "x86-64-v3": _V3}  # LLVM's name: features; the best first
OBJECTS_FOR = ("linux", "x86_64")  # system and machine of the machine code


def find_levels() -> list[str]:
    """Return the levels that this machine can run, the best first."""
    if (sys.platform, platform.machine().lower()) != OBJECTS_FOR:
        return []
    have = _list_features()
    return [level for level, needs in LEVELS.items() if needs <= have]


def find_processor_name() -> str:
    """Return the name that LLVM gives to this processor, after the kind of machine."""
    from llvmlite import binding  # late: it loads LLVM

    return f"{platform.machine()} {binding.get_host_cpu_name()}"


def _list_features() -> set[str]:
    """Return the names that LLVM gives to the features of this processor."""
    from llvmlite import binding  # late: it loads LLVM

    try:
        return {name for name, present in binding.get_host_cpu_features().items() if present}
    except RuntimeError:  # LLVM does not report features on this system
        return set()
