"""Compilation of the kernels that draw, in a second process while the first one simulates.

From a copy of the repository, the first run on a machine compiles the stages of the simulation and
then the kernels of figures and pictures. The second process compiles the latter in the meantime;
the first process waits for their files if it needs them earlier.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from subprocess import Popen

    from robsim.run.experiment import Experiment

KERNELS = "painter_order.arrange_faces", "picture.draw_pictures"  # of a figure, and of a page
COMMAND = [sys.executable, "-P", "-m", "robsim.cli.figure_kernels"]  # reads a pickle


@contextmanager
def compile_figure_kernels(scenario: Experiment, figures: bool, page: bool) -> Iterator[None]:
    """Compile the kernels that draw a scenario in another process while the block runs.

    Nothing happens if these kernels are compiled already, if the cache is not writable, or if only
    one processor is available. The other process ends with the block.
    """
    process = _start_process(scenario, page) if _is_useful([figures, page]) else None
    try:
        yield
    finally:
        if process is not None:
            process.kill()
            process.wait()


def _is_useful(needed: list[bool]) -> bool:
    """Return whether a needed kernel has no code yet, and another process can store it."""
    from itertools import compress

    from robsim.base.processors import count_processors
    from robsim.kernels.machine import cache_files
    from robsim.kernels.machine.machine_code import PACKAGE_CODE

    if PACKAGE_CODE.objects or PACKAGE_CODE.is_bitcode_readable or count_processors() == 1:
        return False
    absent = [not any(cache_files.CACHE.glob(f"{each}-*.nbc")) for each in KERNELS]
    return any(compress(absent, needed)) and cache_files.is_cache_writable()


def _start_process(scenario: Experiment, page: bool) -> Popen[bytes] | None:
    """Start the process that draws the scenario; return None if the scenario has no pickle.

    Its own session keeps Ctrl-C of a terminal away from it.
    """
    import pickle
    from subprocess import DEVNULL, Popen
    from tempfile import TemporaryFile

    with TemporaryFile() as file:
        try:
            pickle.dump((scenario, page), file)
            file.seek(0)
            return Popen(
                COMMAND, stdin=file, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True
            )
        except Exception:  # noqa: BLE001  objects of users may raise any exception
            return None


def draw_start(file: IO[bytes]) -> None:
    """Draw the scene of a pickle and, for a page, its pictures; this compiles the kernels."""
    import pickle
    from io import BytesIO

    from robsim import plot

    scenario, page = pickle.load(file)
    scene = scenario.scene
    plot.scene(scene).savefig(BytesIO())
    for each in scene.cameras if page else ():
        if each.camera.size is not None:
            scene.picture(scene.home, each.name)


if __name__ == "__main__":
    draw_start(sys.stdin.buffer)
