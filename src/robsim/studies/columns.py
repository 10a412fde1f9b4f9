"""The columns of a study's table: what they mean, their units, and their places in memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robsim.engine.outcome import Outcome
from robsim.studies.facts import Columns
from robsim.studies.plan import Codes, Plan

if TYPE_CHECKING:
    import pandas as pd

MEANINGS = {
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
BYTES = 120  # of a run in memory: what came out of it
MORE_BYTES = 104  # likewise of its standard measures
TABLE_BYTES = 400  # likewise while its table is made


def varied(plan: Plan, runs: Codes) -> Columns:
    """Return a column of each varied number, or one of the labels of each varied value."""
    import pandas as pd

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


def nothing(plan: Plan) -> Columns:
    """Return the columns of no runs."""
    kinds = {"outcome": np.int8, "began": np.bool_, "start_tries": np.int64}
    gone = {"run", "draw", *(() if plan.start else ("start_tries",))}
    return {n: np.empty(0, dtype=kinds.get(n, np.float64)) for n in MEANINGS if n not in gone}


def frame(plan: Plan, runs: Codes, facts: Columns) -> pd.DataFrame:
    """Return the table of some runs, one row each."""
    import pandas as pd

    outcomes = [outcome.name for outcome in Outcome]
    places = np.array([int(outcome) for outcome in Outcome])
    codes = np.searchsorted(places, facts["outcome"])
    told = {**facts, "outcome": pd.Categorical.from_codes(codes, outcomes)}
    table = pd.DataFrame({"run": runs, "draw": runs // plan.cells, **varied(plan, runs), **told})
    table.attrs["units"] = {
        name: axis.unit
        for axis in plan.axes
        for name in table
        if str(name).split("[")[0] == axis.name
    }
    return table
