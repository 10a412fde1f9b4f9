"""The columns of a study's table: what is kept of each run, what it means, its place in memory."""

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
    "draw": "number of the draw; runs of one draw have the same start and drawn numbers",
    "start_x": "where the frame that moves was at the start, in the world (m)",
    "start_y": "likewise (m)",
    "start_z": "likewise (m)",
    "start_distance": "from there to its goal (m)",
    "start_angle": "from its orientation at the start to that at its goal (rad)",
    "start_tries": "how many starts were drawn until one would do",
    "outcome": "why the run ended, see robsim.Outcome",
    "began": "whether the start was in sight and within the limits, so that there is a run",
    "end_time": "when the run ended (s)",
    "error_norm": "length of the error at the end, in the units of the features",
    "pixel_error": "largest distance of a mark from its goal in the image at the end (px)",
    "distance_to_goal": "from where the frame ended to its goal (m)",
    "angle_to_goal": "from its orientation at the end to that at its goal (rad)",
    "path_length": "way of the frame (m)",
}
RUN_BYTES = 120  # of a run in memory: what came out of it
MEASURE_BYTES = 104  # likewise of its standard measures
TABLE_BYTES = 400  # likewise while its table is made
Columns = dict[str, Any]
COMMON_MEASURES = (
    "time",
    "pixel_error",
    "distance_to_goal",
    "angle_to_goal",
    "path_length",
)  # in all tables


def varied_columns(plan: Plan, runs: Codes) -> Columns:
    """Return a column of each varied number, or one of the labels of each varied value."""
    made: Columns = {}
    for axis in plan.axes:
        if not axis.is_number:
            made[axis.name] = pd.Categorical.from_codes(plan.codes(axis, runs), axis.labels)
            continue
        numbers = plan.numbers(axis, runs)
        if numbers.ndim == 1:
            made[axis.name] = numbers
            continue
        for place in np.ndindex(*numbers.shape[1:]):
            index = ",".join(map(str, place))
            made[f"{axis.name}[{index}]"] = numbers[(slice(None), *place)]
    return made


def empty_columns(plan: Plan) -> Columns:
    """Return the columns of no runs."""
    kinds = {"outcome": np.int8, "began": np.bool_, "start_tries": np.int64}
    gone = {"run", "draw", *(() if plan.start else ("start_tries",))}
    return {
        n: np.empty(0, dtype=kinds.get(n, np.float64)) for n in COLUMN_MEANINGS if n not in gone
    }


def make_table(plan: Plan, runs: Codes, facts: Columns) -> pd.DataFrame:
    """Return the table of some runs, one row each."""
    outcomes = [outcome.name for outcome in Outcome]
    places = np.array([int(outcome) for outcome in Outcome])
    codes = np.searchsorted(places, facts["outcome"])
    told = {**facts, "outcome": pd.Categorical.from_codes(codes, outcomes)}
    table = pd.DataFrame(
        {"run": runs, "draw": runs // plan.cells, **varied_columns(plan, runs), **told}
    )
    table.attrs["units"] = {
        name: axis.unit
        for axis in plan.axes
        for name in table
        if str(name).split("[")[0] == axis.name
    }
    return table


def collect_facts(loop: Loop) -> Columns:
    """Return a column (runs,) of each fact about the start and the end of the runs."""
    found, controller = end_variables.make_end_variables(loop), loop.controller
    q0, s_goal = move_runs_last(loop.q0, 1), controller.s_goal.T[:, None]
    with np.errstate(all="ignore"):  # a run that went wrong is data
        _, away, turn = end_variables.measure_goal_offset(controller, q0, loop.q0)
        place = end_variables.compute_moving_pose(
            end_variables.select_goal_controller(controller), q0
        )[:, 3]
        error = make_error_variables(loop.recorder.last, s_goal)["error_norm"][:, 0]
    return {
        **{f"start_{axis}": place[i].copy() for i, axis in enumerate("xyz")},
        "start_distance": away,
        "start_angle": turn,
        "outcome": found["outcome"],
        "began": end_variables.is_valid_start(found["outcome"], found["end_time"]),
        "end_time": found["end_time"],
        "error_norm": error,
        **{name: found[name] for name in COMMON_MEASURES if name in found},
    }


def collect_trajectories(loop: Loop, every: int) -> Columns:
    """Return coordinates, velocities and length of the error (runs, instants, ...) of the runs."""
    own = loop.recorder.every or 1
    series = type(loop.recorder.series)(*(x[:, :: every // own] for x in loop.recorder.series))
    with np.errstate(all="ignore"):
        error = make_error_variables(series, loop.controller.s_goal.T[:, None])["error_norm"]
    return {"q": series.q, "qd": series.qd, "error_norm": error}


def choose_block_size(experiment: Experiment) -> int:
    """Return how many runs are measured at a time; one where the scene differs between them."""
    if any(map(is_true_scene_name, experiment.varied)):
        return 1
    return count_block_runs(count_periods(experiment.dt, experiment.duration) + 1)


def collect_measures(experiment: Experiment, loop: Loop) -> Columns:
    """Return the standard measures (runs,) of runs with all instants, but for `COMMON_MEASURES`."""
    true = experiment.of_run(0) if experiment.varied else experiment
    found = measure_run(true.scene, experiment.dataset(loop))
    return {name: found[name] for name in MEASURES if name not in COMMON_MEASURES}
