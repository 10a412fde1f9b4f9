"""What a study keeps of the runs of a loop: their ends, and on request their ways."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.analysis.measures import MEASURES
from robsim.analysis.recorded import runs_in_a_block
from robsim.analysis.scheme import measured
from robsim.base.arrays import runs_last
from robsim.engine.loop import Loop
from robsim.run import ends
from robsim.run.checks import whole_periods
from robsim.run.error import error_variables
from robsim.run.experiment import Experiment
from robsim.run.paths import is_true

Columns = dict[str, Any]
OWN = ("time", "pixel_error", "distance_to_goal", "angle_to_goal", "path_length")  # in all tables


def facts(loop: Loop) -> Columns:
    """Return a column (runs,) of each fact about the start and the end of the runs."""
    found, controller = ends.variables(loop), loop.controller
    q0, s_goal = runs_last(loop.q0, 1), controller.s_goal.T[:, None]
    with np.errstate(all="ignore"):  # a run that went wrong is data
        _, away, turn = ends.off_goal(controller, q0, loop.q0)
        place = ends.pose_of(ends.regarded(controller), q0)[:, 3]
        error = error_variables(loop.recorder.last, s_goal)["error_norm"][:, 0]
    return {
        **{f"start_{axis}": place[i].copy() for i, axis in enumerate("xyz")},
        "start_distance": away,
        "start_angle": turn,
        "outcome": found["outcome"],
        "began": ends.began(found["outcome"], found["end_time"]),
        "end_time": found["end_time"],
        "error_norm": error,
        **{name: found[name] for name in OWN if name in found},
    }


def tracks(loop: Loop, every: int) -> Columns:
    """Return coordinates, velocities and length of the error (runs, instants, ...) of the runs."""
    own = loop.recorder.every or 1
    series = type(loop.recorder.series)(*(x[:, :: every // own] for x in loop.recorder.series))
    with np.errstate(all="ignore"):
        error = error_variables(series, loop.controller.s_goal.T[:, None])["error_norm"]
    return {"q": series.q, "qd": series.qd, "error_norm": error}


def block(experiment: Experiment) -> int:
    """Return how many runs are measured at a time; one where the scene differs between them."""
    if any(map(is_true, experiment.varied)):
        return 1
    return runs_in_a_block(whole_periods(experiment.dt, experiment.duration) + 1)


def measures(experiment: Experiment, loop: Loop) -> Columns:
    """Return the standard measures (runs,) of runs with all instants, but for `OWN`."""
    true = experiment.of_run(0) if experiment.varied else experiment
    found = measured(true.scene, experiment.dataset(loop))
    return {name: found[name] for name in MEASURES if name not in OWN}
