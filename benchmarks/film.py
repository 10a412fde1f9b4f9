"""The time of a frame of a film, against drawing the same figure anew (see README.md)."""

import os
import tempfile
import time
from pathlib import Path

import numpy as np

import robsim as rs

FILMS = (
    "eye_in_hand",
    "chapter_6_1",
    "visp_tutorial",
    "differential_drive",
    "stereo_in_hand",
    "inspection_a",
)
TURNS = 3


def time_frames(run, path: Path) -> float:
    """Median of the seconds between two frames of a film, drawing and encoding included."""
    told: list[float] = []
    rs.plot.save_film(run, path, progress=lambda share: told.append(time.perf_counter()))
    return float(np.median(np.diff(told)))


def anew(run, scene) -> float:
    """Seconds that `plot.run` takes to draw the figure of a run as pixels."""
    start = time.perf_counter()
    figure = rs.plot.run(run, scene)
    figure.savefig(os.devnull, format="rgba", dpi=100)
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    print(f"{'':20} {'a frame':>10} {'anew':>10} {'ratio':>7} {'size':>10}")
    with tempfile.TemporaryDirectory() as folder:
        for name in FILMS:
            experiment = rs.load_scenario(rs.examples.path(name))
            run, path = experiment.run(), Path(folder) / "run.gif"
            frame = min(time_frames(run, path) for _ in range(TURNS))
            line = f"{name:20} {frame:8.4f} s "
            if not isinstance(run, rs.tasks.MissionRun):
                again = min(anew(run, experiment.scene) for _ in range(TURNS))
                line += f"{again:8.4f} s {again / frame:7.1f}"
            else:
                line += 18 * " "
            print(f"{line} {path.stat().st_size / 1e6:7.2f} MB")


if __name__ == "__main__":
    main()
