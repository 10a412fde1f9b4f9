"""The Dataset of a simulation: variables with names, units and provenance."""

from __future__ import annotations

import platform
from collections.abc import Callable, Hashable, Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from robsim.files.flat_table import RunDataset
from robsim.files.run_schema import RUN
from robsim.kernels.machine.cache_files import KERNEL_HASH, find_version
from robsim.run.simulation_variables import SimulationVariables
from robsim.servo.camera_target import CameraTarget
from robsim.servo.goals.goal import GoalFeatures, GoalPose
from robsim.servo.tasks.task import ServoTask
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.engine.loop import Loop

VERSION = version("robsim")  # of the installed package


def make_dataset(loop: Loop, of: Any, origin: Callable[[], Mapping[str, str]]) -> RunDataset:
    """Return the record of a simulation as a Dataset that is computed when it is read.

    `of` is the experiment, and `origin` returns the attributes with its text. The representations
    of a user's objects are stored now, because the objects may change.
    """
    provenance = _make_provenance(loop, of)
    variables = SimulationVariables(loop, of.scene, of.varied)
    return RunDataset.of(variables.dataset, lambda: {**provenance, **origin()}, variables.single)


def make_plain_variables(loop: Loop, scene: Scene) -> dict[Hashable, xr.Variable]:
    """Return the variables of a simulation by name, coordinates included, without a Dataset."""
    return SimulationVariables(loop, scene, {}).list_all()


def _make_provenance(loop: Loop, of: Any) -> dict[str, Any]:
    """Return the attributes with the versions, the settings and the scheme of a run."""
    task = of.task
    return {
        "title": RUN,
        "robsim": VERSION,
        "kernel_hash": KERNEL_HASH,
        "numpy": np.__version__,
        "numba": find_version("numba"),
        "machine": platform.machine(),
        "dt": loop.dt,
        "duration": loop.steps * loop.dt,
        "seed": str(loop.seed),  # may exceed the integers of a file
        "hold": int(loop.hold),
        "record": loop.record,
        "task": type(task).__name__,
        **(_describe_scheme(task, of) if isinstance(task, ServoTask) else {}),
        "tolerance": loop.controller.tolerance,
        **_make_image_attributes(loop.controller.sights),
        "sensing": repr(of.sensing),
        "actuation": repr(of.actuation),
        "single": int(loop.single),
        **({"varied": " ".join(of.varied)} if of.varied else {}),
    }


def _describe_scheme(task: ServoTask, of: Any) -> dict[str, Any]:
    kinds = {GoalPose: "computed", GoalFeatures: "given"}
    by_name = isinstance(task.interaction, str)
    return {
        "goal": kinds.get(type(task.goal), "shown"),
        "belief": _list_wrong_beliefs(task.belief, of),
        "law": repr(task.law),
        "inverse": repr(task.inverse),
        "interaction": task.interaction if by_name else type(task.interaction).__name__,
    }


def _list_wrong_beliefs(belief: Scene | None, of: Any) -> str:
    """Return a description of the believed scene: the names of the parts that are wrong."""
    truth = of.scene
    if any(name.startswith("belief.") for name in of.varied):
        return "differs from the truth, and from run to run"
    if belief is None or belief == truth:
        return "the truth"
    kinds = ("robots", "objects", "cameras", "motions")
    true = [part for kind in kinds for part in getattr(truth, kind)]
    wrong = [p.name for kind in kinds for p in getattr(belief, kind) if p not in true]
    return f"differs from the truth: {', '.join(wrong) or 'in the order of its parts'}"


def _make_image_attributes(sights: Sequence[CameraTarget]) -> dict[str, Any]:
    """Return size and centre of the images in pixels; the first camera has no suffix."""
    cameras = {sight.eye.name: sight.eye.camera for sight in sights}
    attributes: dict[str, Any] = {}
    for i, (name, camera) in enumerate(cameras.items()):
        suffix = f"_{name}" if i else ""
        if camera.size:
            attributes[f"image_size{suffix}"] = np.array(camera.size)
        K = np.atleast_3d(camera.K)[..., 0]  # of the first run, if runs differ
        attributes[f"image_centre{suffix}"] = K[:2, 2].copy()
    return attributes
