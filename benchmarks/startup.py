"""How long the first and the next start take (see README.md)."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

REPEATS = 5
IMPORTS = [sys.executable, "-c", "import numba, xarray"]
CLICK = [sys.executable, "-c", "import click"]
HELP = [sys.executable, "-m", "robsim", "--help"]
DEMO = [sys.executable, "-m", "robsim", "demo", "--no-figures", "--force", "-o"]


def measured(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Seconds on the clock and of CPU that a command takes."""
    before, start = os.times(), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=environment)
    wall, after = time.perf_counter() - start, os.times()
    cpu = after.children_user + after.children_system
    return wall, cpu - before.children_user - before.children_system


def best(pair: tuple[list[str], list[str]], environment: dict[str, str]) -> list[float]:
    """Seconds of CPU of two commands, the least of some turns each."""
    turns = [[measured(each, environment)[1] for each in pair] for _ in range(REPEATS)]
    return [min(column) for column in zip(*turns, strict=True)]


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "ROBSIM_CACHE_DIR": str(Path(folder) / "cache")}
        demo = [*DEMO, str(Path(folder) / "run")]
        measured(IMPORTS, environment)  # fill the disk cache
        wall, cpu = measured(demo, environment)
        print(f"first run, empty kernel cache   {wall:6.2f} s, {cpu:6.2f} s of CPU")
        print("CPU, best of several            ours   imports alone   ratio")
        figures = [each for each in demo if each != "--no-figures"]
        plots = [*IMPORTS[:-1], f"{IMPORTS[-1]}, matplotlib.pyplot"]
        rows = {"help": (HELP, CLICK), "demo": (demo, IMPORTS), "with figures": (figures, plots)}
        for name, pair in rows.items():
            ours, theirs = best(pair, environment)
            print(f"{name:28} {ours:7.2f} s {theirs:13.2f} s {ours / theirs:7.2f}")


if __name__ == "__main__":
    main()
