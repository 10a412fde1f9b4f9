"""The machine code that came with the package: for which processors, and whether it fits here.

It fits where Numba, llvmlite and Python are those of the build, and the processor has the features
of a level; its own name and the place of the package do not count. A kernel whose sources are not
those of the build is compiled here.
"""

import platform
from pathlib import Path

from llvmlite import binding as llvm

from robsim.kernels.machine.cache_files import KERNEL_HASH, VERSIONS

ROOT = Path(__file__).parents[1] / "_prebuilt"
MADE_WITH = "versions.txt"  # in ROOT: the versions of the build, and the hash of its kernels
_V3 = {"avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt"}
_V4 = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
LEVELS: dict[str, dict[str, set[str]]] = {  # by machine: names of LLVM, the best first
    "x86_64": {"x86-64-v4": _V4, "x86-64-v3": _V3},
    "aarch64": {"generic": set()},
    "arm64": {"generic": set()},
}


def levels() -> list[str]:
    """Return the levels that this processor can run, the best first."""
    machine = platform.machine().lower().replace("amd64", "x86_64")
    try:
        have = {name for name, there in llvm.get_host_cpu_features().items() if there}
    except RuntimeError:  # LLVM cannot tell on this system
        have = set()
    return [level for level, needs in LEVELS.get(machine, {}).items() if needs <= have]


def read_build_versions() -> list[str]:
    """Return the versions and the hash of kernels of the build; nothing if nothing came."""
    try:
        return (ROOT / MADE_WITH).read_text(encoding="utf-8").splitlines()
    except OSError:
        return []


def _find_prebuilt_folder() -> tuple[Path | None, str]:
    """Return the folder of the best level that came with the package, and its name."""
    if read_build_versions()[:1] != [VERSIONS]:
        return None, ""
    level = next((level for level in levels() if (ROOT / level).is_dir()), "")
    return (ROOT / level if level else None), level


FOLDER, LEVEL = _find_prebuilt_folder()


def explain_mismatch() -> str:
    """Return why what came with the package does not serve here; empty if nothing came, or does."""
    if not (made := read_build_versions()):
        return ""
    versions, kernels = made
    if versions != VERSIONS:
        return f"those that came with the package are for {versions}, this is {VERSIONS}"
    if kernels != KERNEL_HASH:
        return "those that came with the package are of other sources"
    return "" if FOLDER else "those that came with the package are for other processors"
