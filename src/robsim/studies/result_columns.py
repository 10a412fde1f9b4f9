"""The columns of a study's table: their meanings, their values, and their size in memory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from robsim.analysis.compared_scheme import measure_run
from robsim.analysis.measures import MEASURES
from robsim.analysis.run_arrays import count_block_runs
from robsim.base.arrays import move_runs_last
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run import end_variables
from robsim.run.experiment import Experiment
from robsim.run.experiment_paths import is_true_scene_name
from robsim.run.run_checks import count_periods
from robsim.run.task_error import make_error_variables
from robsim.studies.study_plan import Codes, Plan

COLUMN_MEANINGS = {
    "run": "number of the run",
    "draw": "number of the draw; runs of one draw share their start and their samples",
    "start_x": "x of the moving frame at the start, in the world (m)",
    "start_y": "y of the moving frame at the start, in the world (m)",
    "start_z": "z of the moving frame at the start, in the world (m)",
    "start_distance": "distance of the moving frame from its goal at the start (m)",
    "start_angle": "angle between the moving frame and its goal at the start (rad)",
    "start_tries": "number of attempts for the start",
    "outcome": "outcome of the run, see robsim.Outcome",
    "began": "whether the start sees its target and is within the limits",
    "end_time": "time of the end of the run (s)",
    "error_norm": "length of the error at the end, in the units of the features",
    "pixel_error": "largest distance of a mark from its goal in the image at the end (px)",
    "distance_to_goal": "distance of the moving frame from its goal at the end (m)",
    "angle_to_goal": "angle between the moving frame and its goal at the end (rad)",
    "path_length": "length of the path of the moving frame (m)",
}
RUN_BYTES = 120  # memory of the results of a run
MEASURE_BYTES = 104  # memory of the standard measures of a run
TABLE_BYTES = 400  # memory of a run while the table is made
Columns = dict[str, Any]
# measures in all tables
COMMON_MEASURES = ("time", "pixel_error", "distance_to_goal", "angle_to_goal", "path_length")


def varied_columns(plan: Plan, runs: Codes) -> Columns:
    """Return a column for each varied number, or a column of labels for each varied value."""
    columns: Columns = {}
    for axis in plan.axes:
        if not axis.is_number:
            columns[axis.name] = pd.Categorical.from_codes(plan.codes(axis, runs), axis.labels)
            continue
        numbers = plan.numbers(axis, runs)
        if numbers.ndim == 1:
            columns[axis.name] = numbers
            continue
        for index_of_number in np.ndindex(*numbers.shape[1:]):
            index = ",".join(map(str, index_of_number))
            columns[f"{axis.name}[{index}]"] = numbers[(slice(None), *index_of_number)]
    return columns


def empty_columns(plan: Plan) -> Columns:
    """Return the result columns of a study without finished runs."""
    kinds = {"outcome": np.int8, "began": np.bool_, "start_tries": np.int64}
    absent = {"run", "draw", *(() if plan.start else ("start_tries",))}
    return {
        n: np.empty(0, dtype=kinds.get(n, np.float64)) for n in COLUMN_MEANINGS if n not in absent
    }


def make_table(plan: Plan, runs: Codes, facts: Columns) -> pd.DataFrame:
    """Return the table of some runs with one row each."""
    outcomes = [outcome.name for outcome in Outcome]
    places = np.array([int(outcome) for outcome in Outcome])
    codes = np.searchsorted(places, facts["outcome"])
    columns = {**facts, "outcome": pd.Categorical.from_codes(codes, outcomes)}
    table = pd.DataFrame(
        {"run": runs, "draw": runs // plan.cells, **varied_columns(plan, runs), **columns}
    )
    table.attrs["units"] = {
        name: axis.unit
        for axis in plan.axes
        for name in table
        if str(name).split("[")[0] == axis.name
    }
    return table


def collect_facts(loop: Loop) -> Columns:
    """Return the results (runs,) of a simulation: quantities of the starts and of the ends."""
    results, controller = end_variables.list_end_variables(loop), loop.controller
    outcome, end_time = results["outcome"](), results["end_time"]()
    q0, s_goal = move_runs_last(loop.q0, 1), controller.s_goal.T[:, None]
    with np.errstate(all="ignore"):  # failed runs
        _, distance, angle = end_variables.measure_goal_offset(controller, q0, loop.q0)
        position = end_variables.compute_moving_pose(
            end_variables.select_goal_controller(controller), q0
        )[:, 3]
        error = make_error_variables(loop.recorder.last, s_goal)["error_norm"][:, 0]
    return {
        **{f"start_{axis}": position[i].copy() for i, axis in enumerate("xyz")},
        "start_distance": distance,
        "start_angle": angle,
        "outcome": outcome,
        "began": end_variables.is_valid_start(outcome, end_time),
        "end_time": end_time,
        "error_norm": error,
        **{name: results[name]() for name in COMMON_MEASURES if name in results},
    }


def collect_trajectories(loop: Loop, every: int) -> Columns:
    """Return coordinates, velocities and error norms (runs, instants, ...) of the runs."""
    own = loop.recorder.every or 1
    series = type(loop.recorder.series)(*(x[:, :: every // own] for x in loop.recorder.series))
    with np.errstate(all="ignore"):
        error = make_error_variables(series, loop.controller.s_goal.T[:, None])["error_norm"]
    return {"q": series.q, "qd": series.qd, "error_norm": error}


def choose_block_size(experiment: Experiment) -> int:
    """Return the number of runs that are measured at a time; 1 if their scenes differ."""
    if any(map(is_true_scene_name, experiment.varied)):
        return 1
    return count_block_runs(count_periods(experiment.dt, experiment.duration) + 1)


def collect_measures(experiment: Experiment, loop: Loop) -> Columns:
    """Return the standard measures (runs,) of runs with all instants, except `COMMON_MEASURES`."""
    true = experiment.of_run(0) if experiment.varied else experiment
    values = measure_run(true.scene, experiment.dataset(loop))
    return {name: values[name] for name in MEASURES if name not in COMMON_MEASURES}
