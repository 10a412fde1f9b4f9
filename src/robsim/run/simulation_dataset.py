"""The Dataset of a simulation: variables with names, units and provenance."""

from __future__ import annotations

import platform
from collections.abc import Hashable, Mapping, Sequence
from functools import cache, partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from robsim.base.value import is_immutable
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


def make_dataset(loop: Loop, of: Any) -> RunDataset:
    """Return the record of a simulation of an experiment as a Dataset.

    The Dataset is computed when it is read. Only its attributes are computed now if the experiment
    has a user's objects, because these may change.
    """
    controller = loop.controller  # not kept, because it may hold numbers of many runs
    bound = {"tolerance": controller.tolerance, **_make_image_attributes(controller.sights)}
    attributes = cache(partial(_make_attributes, of, loop.steps, loop.single, bound))
    parts = of.task, of.sensing, of.actuation, of.endings
    if not (of.scene.tree.compiled and all(map(is_immutable, parts))):
        attributes()
    variables = SimulationVariables(loop, of.scene, of.varied)
    return RunDataset.of(variables.dataset, attributes, variables.single)


def make_plain_variables(loop: Loop, scene: Scene) -> dict[Hashable, xr.Variable]:
    """Return the variables of a simulation by name, coordinates included, without a Dataset."""
    return SimulationVariables(loop, scene, {}).list_all()


def _make_attributes(of: Any, steps: int, single: bool, bound: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes: the versions, the settings, the scheme and the text of a run.

    `bound` are the attributes of its controller.
    """
    task = of.task
    return {
        "title": RUN,
        "robsim": VERSION,
        "kernel_hash": KERNEL_HASH,
        "numpy": np.__version__,
        "numba": find_version("numba"),
        "machine": platform.machine(),
        "dt": of.dt,
        "duration": steps * of.dt,
        "seed": str(of.seed),  # may exceed the integers of a file
        "hold": int(of.hold),
        "record": of.record,
        "task": type(task).__name__,
        **(_describe_scheme(task, of) if isinstance(task, ServoTask) else {}),
        **bound,
        "sensing": repr(of.sensing),
        "actuation": repr(of.actuation),
        "single": int(single),
        **({"varied": " ".join(of.varied)} if of.varied else {}),
        **of.origin,
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
