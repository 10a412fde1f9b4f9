"""Kernels compiled in advance, in a wheel that is built with ROBSIM_PREBUILT=1.

For each level of processors that this machine can run, `robsim warm` of the sources compiles what
users need; the package finds it by `robsim.kernels.machine.prebuilt`. Such a wheel is for one
platform and version of Python. Without the variable the wheel is of pure
Python, and needs nothing here.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ASKED = os.environ.get("ROBSIM_PREBUILT") == "1"
TARGET = "robsim/kernels/_prebuilt"
ABOUT = """
from robsim.kernels.machine import cache_files as files
from robsim.kernels.machine import prebuilt
print(files.CACHE.name, prebuilt.MADE_WITH, files.VERSIONS, files.KERNEL_HASH, sep="\\n")
print(*prebuilt.levels(), sep="\\n")
"""


class PrebuiltKernels(BuildHookInterface):
    """Adds machine code to a wheel."""

    folder = None

    def dependencies(self):
        """Return what the build needs beyond its own tools: all that RobSim needs to run."""
        return self.metadata.core.dependencies if ASKED else []

    def initialize(self, version, build_data):
        """Compile, and tell which files go where."""
        if not ASKED or version == "editable":
            return
        self.folder = Path(tempfile.mkdtemp(prefix="robsim-"))
        name, made_with, versions, kernels, *levels = self._python("-c", ABOUT).splitlines()
        if not levels:
            raise RuntimeError("no kernels can be compiled in advance for this processor")
        include = build_data["force_include"]
        for level in levels:
            self._warm(level)
            include[str(self.folder / level / name)] = f"{TARGET}/{level}"
        (self.folder / made_with).write_text(f"{versions}\n{kernels}\n", encoding="utf-8")
        include[str(self.folder / made_with)] = f"{TARGET}/{made_with}"
        build_data |= {"pure_python": False, "infer_tag": True}

    def finalize(self, version, build_data, artifact_path):
        """Delete what was compiled, which the wheel holds now."""
        if self.folder:
            shutil.rmtree(self.folder)

    def _warm(self, level):
        """Compile for a level of processors."""
        self.app.display_info(f"compiling kernels for {level}")
        told = self._python(
            *("-m", "robsim", "warm"),
            NUMBA_CPU_NAME=level,
            NUMBA_CPU_FEATURES="",  # those of the level, not of this machine
            NUMBA_DISABLE_INTEL_SVML="1",  # a library that users need not have
            ROBSIM_CACHE_DIR=str(self.folder / level),
        )
        self.app.display_info(told)

    def _python(self, *arguments, **environment):
        """Return what Python prints that imports RobSim from the sources."""
        environment = {**os.environ, "PYTHONPATH": str(Path(self.root) / "src"), **environment}
        command = [sys.executable, *arguments]
        done = subprocess.run(
            command, check=True, env=environment, stdout=subprocess.PIPE, text=True
        )
        return done.stdout.strip()
