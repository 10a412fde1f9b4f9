"""Build hook that adds precompiled kernels to a wheel if ROBSIM_PREBUILT=1.

For each processor level that this machine can run, `python -m robsim warm` compiles the kernels
from the sources. The installed package loads them by `robsim.kernels.machine.prebuilt`. The wheel
is then specific to a platform and a version of Python. Without the variable the hook does nothing,
and the wheel contains pure Python.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

IS_ENABLED = os.environ.get("ROBSIM_PREBUILT") == "1"
TARGET = "robsim/kernels/_prebuilt"
REPORT_SCRIPT = """
from robsim.kernels.machine import cache_files as files
from robsim.kernels.machine import prebuilt
print(files.CACHE.name, prebuilt.MADE_WITH, files.VERSIONS, files.KERNEL_HASH, sep="\\n")
print(*prebuilt.levels(), sep="\\n")
"""


class PrebuiltKernels(BuildHookInterface):
    """Hatchling build hook that compiles kernels and includes them in the wheel."""

    folder = None

    def dependencies(self):
        """Return the dependencies of RobSim, which the compilation of kernels requires."""
        return self.metadata.core.dependencies if IS_ENABLED else []

    def initialize(self, version, build_data):
        """Compile the kernels, and add the files to `build_data`."""
        if not IS_ENABLED or version == "editable":
            return
        self.folder = Path(tempfile.mkdtemp(prefix="robsim-"))
        name, made_with, versions, kernels, *levels = self._python("-c", REPORT_SCRIPT).splitlines()
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
        """Delete the temporary folder, after its files were copied into the wheel."""
        if self.folder:
            shutil.rmtree(self.folder)

    def _warm(self, level):
        """Compile the kernels for a processor level."""
        self.app.display_info(f"compiling kernels for {level}")
        output = self._python(
            *("-m", "robsim", "warm"),
            NUMBA_CPU_NAME=level,
            NUMBA_CPU_FEATURES="",  # no features beyond the level
            NUMBA_DISABLE_INTEL_SVML="1",  # users may lack this library
            ROBSIM_CACHE_DIR=str(self.folder / level),
        )
        self.app.display_info(output)

    def _python(self, *arguments, **environment):
        """Run Python with RobSim from the sources, and return its output."""
        environment = {**os.environ, "PYTHONPATH": str(Path(self.root) / "src"), **environment}
        command = [sys.executable, *arguments]
        process = subprocess.run(
            command, check=True, env=environment, stdout=subprocess.PIPE, text=True
        )
        return process.stdout.strip()
