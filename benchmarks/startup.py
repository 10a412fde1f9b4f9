"""How long the first and the next start take (see README.md)."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPEATS = 5
IMPORTS = [sys.executable, "-c", "import numba, xarray"]
DEMO = [sys.executable, "-m", "robsim", "demo", "--no-figures", "--force", "-o"]


def measured(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Seconds on the clock and of CPU that a command takes."""
    before, start = os.times(), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=environment)
    wall, after = time.perf_counter() - start, os.times()
    cpu = after.children_user + after.children_system
    return wall, cpu - before.children_user - before.children_system


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "ROBSIM_CACHE_DIR": str(Path(folder) / "cache")}
        demo = [*DEMO, str(Path(folder) / "run")]
        measured(IMPORTS, environment)  # fill the disk cache
        wall, cpu = measured(demo, environment)
        print(f"first run, empty kernel cache   {wall:6.2f} s, {cpu:6.2f} s of CPU")
        pairs = [
            (measured(demo, environment)[0], measured(IMPORTS, environment)[0])
            for _ in range(REPEATS)
        ]
        ours, theirs = (min(column) for column in zip(*pairs, strict=True))
        print(f"next runs                       {ours:6.2f} s")
        print(f"import numba, xarray  {theirs:6.2f} s")
        print(f"ratio                           {ours / theirs:6.2f}")


if __name__ == "__main__":
    main()
