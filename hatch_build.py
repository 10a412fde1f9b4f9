"""Build hook that adds machine code to a wheel if ROBSIM_MACHINE_CODE=1.

`tools/machine_code/build.py` writes the archives from the sources. The wheel stays pure: bitcode
serves every system, processor and version of Python. Without the variable the hook does nothing,
and the kernels are compiled where they are used.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

IS_ENABLED = os.environ.get("ROBSIM_MACHINE_CODE") == "1"
TARGET = "robsim/kernels/_machine_code"
COMPILERS = ["numba==0.61.2", "llvmlite==0.44.0", "numpy>=2,<2.3"]  # LLVM 15: the oldest served


class MachineCode(BuildHookInterface):
    """Hatchling build hook that writes machine code and includes it in the wheel."""

    folder = None

    def dependencies(self):
        """Return the packages that compile the kernels; they need Python 3.11 to 3.13."""
        return COMPILERS if IS_ENABLED else []

    def initialize(self, version, build_data):
        """Write the archives, and add them to `build_data`."""
        if not IS_ENABLED or version == "editable":
            return
        self.folder = Path(tempfile.mkdtemp(prefix="robsim-"))
        root = Path(self.root)
        command = [sys.executable, str(root / "tools/machine_code/build.py"), str(self.folder)]
        plain = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")}
        environment = {**plain, "PYTHONPATH": str(root / "src"), "PYTHONHASHSEED": "0"}
        environment |= {"ROBSIM_USE_NUMBA": "1", "ROBSIM_QUIET": "1"}
        subprocess.run(command, check=True, env=environment)
        for file in self.folder.iterdir():
            build_data["force_include"][str(file)] = f"{TARGET}/{file.name}"

    def finalize(self, version, build_data, artifact_path):
        """Delete the temporary folder, after its files were copied into the wheel."""
        if self.folder:
            shutil.rmtree(self.folder)
