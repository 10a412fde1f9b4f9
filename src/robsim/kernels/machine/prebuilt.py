"""Precompiled machine code of the package: its processor levels and versions.

The code is used if Numba, llvmlite and Python have the versions of the build and the processor has
the features of a level. The name of the processor and the path of the package do not matter. If the
sources of a kernel differ from the build, the kernel is compiled on this machine.
"""

import platform
from pathlib import Path

from llvmlite import binding as llvm

from robsim.kernels.machine.cache_files import KERNEL_HASH, VERSIONS

ROOT = Path(__file__).parents[1] / "_prebuilt"
MADE_WITH = "versions.txt"  # file in ROOT: versions of the build and hash of its kernels
_V3 = {"avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt"}
_V4 = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
LEVELS: dict[str, dict[str, set[str]]] = {  # machine: LLVM processor names, the best first
    "x86_64": {"x86-64-v4": _V4, "x86-64-v3": _V3},
    "aarch64": {"generic": set()},
    "arm64": {"generic": set()},
}


def levels() -> list[str]:
    """Return the levels that this processor can run, the best first."""
    machine = platform.machine().lower().replace("amd64", "x86_64")
    try:
        have = {name for name, present in llvm.get_host_cpu_features().items() if present}
    except RuntimeError:  # LLVM does not report features on this system
        have = set()
    return [level for level, needs in LEVELS.get(machine, {}).items() if needs <= have]


def read_build_versions() -> list[str]:
    """Return the versions and the kernel hash of the build; [] without precompiled code."""
    try:
        return (ROOT / MADE_WITH).read_text(encoding="utf-8").splitlines()
    except OSError:
        return []


def _find_prebuilt_folder() -> tuple[Path | None, str]:
    """Return the folder and the name of the best precompiled level for this processor."""
    if read_build_versions()[:1] != [VERSIONS]:
        return None, ""
    level = next((level for level in levels() if (ROOT / level).is_dir()), "")
    return (ROOT / level if level else None), level


FOLDER, LEVEL = _find_prebuilt_folder()


def explain_mismatch() -> str:
    """Return why the precompiled code is unusable; "" if it is usable or the package has none."""
    if not (build := read_build_versions()):
        return ""
    versions, kernels = build
    if versions != VERSIONS:
        return f"the precompiled kernels are for {versions}, this is {VERSIONS}"
    if kernels != KERNEL_HASH:
        return "the precompiled kernels are of other sources"
    return "" if FOLDER else "the precompiled kernels are for other processors"
