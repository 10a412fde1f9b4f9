"""Types of the public API as a type checker infers them; mypy reads this file, nothing runs it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, assert_type

import numpy as np

import robsim as rs
from robsim.analysis.comparison import Comparison
from robsim.base.arrays import Array
from robsim.control import DriveCommand
from robsim.declare import Length, Number, Vector, fields_of
from robsim.declare.controls import Control
from robsim.declare.fields import DeclaredField
from robsim.endings import Ending
from robsim.engine.instant import Instant
from robsim.files.flat_table import RunDataset
from robsim.run.mission_run import MissionRun
from robsim.studies import StudyResult

if TYPE_CHECKING:
    import xarray as xr


def check_experiments(scene: rs.Scene, mission: rs.Mission) -> None:
    """An experiment is generic in its task, which determines the class of its run."""
    experiment = rs.Experiment(scene, rs.IBVS(gain=2.0), [0.0, 0.1], dt=0.02)
    assert_type(experiment, rs.Experiment[rs.IBVS])
    assert_type(experiment.task, rs.IBVS)
    assert_type(experiment.start, Array | None)
    assert_type(experiment.sensing, rs.Sensing)
    assert_type(experiment.actuation, rs.Actuation)
    assert_type(experiment.safety, rs.Safety | None)
    assert_type(experiment.endings, tuple[Ending, ...])
    assert_type(experiment.varied, Mapping[str, Array])
    assert_type(experiment.run(), RunDataset)
    assert_type(experiment.at("task.gain", 2.0), rs.Experiment[rs.IBVS])
    assert_type(experiment.vary({"task.gain": [1.0, 2.0]}), rs.Experiment[rs.IBVS])
    assert_type(experiment.of_run(0), rs.Experiment[rs.IBVS])
    assert_type(experiment.with_(dt=0.01), rs.Experiment[rs.IBVS])
    assert_type(experiment.with_(task=rs.PBVS()), rs.Experiment[rs.PBVS])
    assert_type(experiment.with_(task=mission).run(), MissionRun)
    assert_type(experiment.steps(), Iterator[Instant])
    assert_type(experiment.controls(), list[Control])

    staged = rs.Experiment(scene, mission)
    assert_type(staged, rs.Experiment[rs.Mission])
    assert_type(staged.run(threads=1), MissionRun)
    assert_type(staged.run().legs[0].outcome, rs.Outcome)


def check_runs(scene: rs.Scene, path: Path) -> None:
    """Functions that return runs, and files with runs."""
    run = rs.simulate(scene, rs.PBVS(), {"arm": np.zeros(6)})
    assert_type(run, RunDataset)
    assert_type(rs.load_scenario(path).run(), RunDataset)
    assert_type(rs.save_run(run, path), Path)
    assert_type(rs.open_run(path), RunDataset)
    repeated = rs.replay(run)
    if TYPE_CHECKING:
        assert_type(repeated, xr.Dataset)
    assert_type(rs.Outcome(int(run.outcome)).message, str)


def check_controller(path: Path) -> None:
    """The controller of an experiment on its own."""
    controller = rs.Controller.from_file(path)
    command = controller.step({"plate": np.zeros((4, 2))}, [0.0] * 6, t=0.0)
    assert_type(command, DriveCommand)
    assert_type(command.velocities, Array)
    assert_type(command.health.limits, tuple[str, ...])
    controller.step(rs.control.Marks({0: (1.0, 2.0)}, t=0.0), {"arm": np.zeros(6)}, 0.04, run=True)


def check_geometry(arm: rs.Robot, camera: rs.Camera, pose: rs.Pose) -> None:
    """Poses, robots and cameras."""
    assert_type(pose @ pose, rs.Pose)
    assert_type(arm.fk(np.zeros(6)), Array)
    assert_type(arm.jacobian(np.zeros(6)), Array)
    assert_type(camera.project([[0.0, 0.0, 1.0]], np.eye(4)), Array)


def check_studies(path: Path) -> None:
    """Studies and comparisons of experiments."""
    experiment = rs.load_scenario(path)
    assert_type(rs.study(experiment, 10), StudyResult)
    assert_type(rs.compare(experiment.scene, {"a": rs.IBVS(), "b": rs.PBVS()}), Comparison)


def check_declarations() -> None:
    """Specs of declared fields."""
    assert_type(fields_of(rs.IBVS), tuple[DeclaredField, ...])
    assert_type(Number(above=0).words(), str)
    assert_type(Length(above=0.0, most=1.0).si_unit, str)
    assert_type(Vector(count=2).accepts(), str)
