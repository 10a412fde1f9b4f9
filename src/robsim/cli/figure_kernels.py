"""Compilation of the kernels that draw, in a second process while the first one simulates.

From a copy of the repository, the first run on a machine compiles the stages of the simulation and
then the kernels of figures and pictures. The second process compiles the latter in the meantime;
the first process waits for their files if it needs them earlier.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from itertools import chain
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from subprocess import Popen

    from robsim.run.experiment import Experiment

FIGURE, PICTURES = "painter_order.arrange_faces", "picture.draw_pictures"  # as in the cache
COMMAND = [sys.executable, "-P", "-m", "robsim.cli.figure_kernels"]  # and names of kernels


@contextmanager
def compile_figure_kernels(scenario: Experiment, figures: bool, page: bool) -> Iterator[None]:
    """Compile the kernels that draw a scenario in another process while the block runs.

    Nothing happens if these kernels are compiled already, if the cache is not writable, or if only
    one processor is available. The other process ends with the block.
    """
    needed = {FIGURE} if figures else set()
    needed |= _list_picture_kernels(scenario) if page else set()
    absent = _list_absent(needed)
    process = _start_process(absent) if absent else None
    try:
        yield
    finally:
        if process is not None:
            process.kill()
            process.wait()


def _list_picture_kernels(scenario: Experiment) -> set[str]:
    """Return the names of the kernels that draw the pictures of a scenario."""
    from robsim.kernels.formulas.perspective import NO_LENS

    scene = scenario.scene
    shapes = [link.shapes for robot in scene.robots for link in robot.links]
    shapes += [thing.shapes for thing in scene.objects]
    has_pictures = any(each.face_pictures for each in chain(*shapes))
    numbers = {
        has_pictures + 2 * (each.camera.lens_kind != NO_LENS)  # of the types of `draw_pictures`
        for each in scene.cameras
        if each.camera.size is not None
    }
    return {f"{PICTURES}.{each}" if each else PICTURES for each in numbers}


def _list_absent(names: set[str]) -> list[str]:
    """Return the kernels that have no code yet, if another process can compile and store it."""
    from robsim.base.processors import count_processors
    from robsim.kernels.machine import cache_files
    from robsim.kernels.machine.machine_code import PACKAGE_CODE

    if PACKAGE_CODE.objects or PACKAGE_CODE.is_bitcode_readable or count_processors() == 1:
        return []
    absent = [each for each in sorted(names) if not any(cache_files.CACHE.glob(f"{each}-*.nbc"))]
    return absent if cache_files.is_cache_writable() else []


def _start_process(names: list[str]) -> Popen[bytes]:
    """Start the process that compiles kernels.

    Its own session keeps Ctrl-C of a terminal away from it.
    """
    from subprocess import DEVNULL, Popen

    command = [*COMMAND, *names]
    return Popen(command, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True)


def compile_kernels(names: Iterable[str]) -> list[int]:
    """Compile kernels that draw, and return the addresses of their code."""
    addresses = []
    for name in names:
        module, function, *number = name.split(".")
        kernel = getattr(import_module(f"robsim.kernels.raster.{module}"), function)
        addresses.append(kernel.variants[int(*number)].address)
    return addresses


if __name__ == "__main__":
    compile_kernels(sys.argv[1:])
