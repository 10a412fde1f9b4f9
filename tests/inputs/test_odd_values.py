"""Whatever Python value is put in a place of an experiment: it fits, or it is one clear error."""

import numpy as np
import pytest

import robsim as rs
from robsim.declare.name_lookup import yield_dotted_names
from robsim.run.experiment_text import make_task_table

ODD = [
    *(None, object(), np.nan, np.inf, {1, 2}, len, range(3), b"x", 1 + 2j, 10**400, 1e308, 3, -1),
    *("x", "", "3", "\x00", True, {}, {"a": 1}, {"kind": "ibvs"}, [], [None], [1, "2 m"]),
    *(np.zeros((2, 2)), np.array("x"), [[1, 2], [3]], rs.Pose.at(0, 0, 1), rs.IBVS(), rs.IBVS),
    rs.Sensing(),
]


@pytest.mark.filterwarnings("ignore::robsim.errors.UnitWarning")
@pytest.mark.parametrize("every", [20, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.parametrize("example", ["wrong_dh", "inspection_a", "latency_and_gain", "chapter_6_2"])
def test_an_odd_value_fits_or_is_one_clear_error(example, every):
    experiment = rs.load_scenario(rs.examples.path(example))
    rng = np.random.default_rng(5)
    every_name = [
        *yield_dotted_names(make_task_table(experiment)),
        *yield_dotted_names(experiment.scene),
    ]
    refused, paths = 0, every_name[::every]
    for path in paths:
        value = ODD[rng.integers(len(ODD))]
        try:
            _ = experiment.at(path, value).hash
        except rs.errors.InputError as error:
            refused += 1
            assert str(error), (path, value)
    assert refused > len(paths) / 8
