"""Paths that lead nowhere, numbers that cannot be, and rows of runs that do not fit."""

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.run.experiment_paths import find_path

NAMES = ("calibration_errors", "wrong_dh", "latency_and_gain")


@pytest.fixture(scope="module", params=NAMES)
def experiment(request):
    return rs.load_scenario(examples.path(request.param))


def paths_of(experiment):
    return [each.path for each in experiment.controls() if each.form in ("number", "numbers")]


def misspelt(path, rng):
    """The path with two letters of its last key changed places, or one of them gone."""
    head, dot, key = path.rpartition(".")
    at = int(rng.integers(max(len(key) - 1, 1)))
    swapped = key[:at] + key[at + 1 : at + 2] + key[at : at + 1] + key[at + 2 :]
    return head + dot + (swapped if swapped != key else key[:-1] + "x")


def test_a_path_that_does_not_exist_is_refused_with_a_suggestion(experiment):
    rng = np.random.default_rng(3)
    paths = paths_of(experiment)
    for path in paths[::29]:
        wrong = misspelt(path, rng)
        if wrong in paths or find_path(experiment, wrong):
            continue
        with pytest.raises(rs.errors.InputError) as error:
            experiment.at(wrong, 1.0)
        assert type(error.value) is rs.errors.InputError  # the file is not to blame
        message = str(error.value)
        assert any(word in message for word in ("did you mean", "keys:", "kinds:", "names")), wrong


@pytest.mark.parametrize(
    ("path", "nearest"),
    [
        ("tsk.gain", "task.gain"),
        ("cameras.camra.focal", "camera"),
        ("cameras.camera.fokal", "focal"),
        ("belief.cameras.camera.centre", "center"),
        ("belief.objects.square.positon", "position"),
        ("run.duratoin", "duration"),
        ("sensing.nois", "noise"),
    ],
)
def test_the_nearest_path_is_named(path, nearest):
    with pytest.raises(rs.errors.InputError, match=nearest) as error:
        rs.load_scenario(examples.path("calibration_errors")).at(path, 1.0)
    assert type(error.value) is rs.errors.InputError  # the file is not to blame


@pytest.mark.parametrize("path", ["", ".", "task.", ".gain", "task..gain", "a" * 5000, "task\x00"])
def test_an_invalid_path_is_one_clear_error(experiment, path):
    with pytest.raises(rs.RobSimError) as error:
        experiment.at(path, 1.0)
    assert str(error.value) and len(str(error.value)) < 3000


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, 10**400, "1e400 m", True, b"1"])
def test_a_number_that_cannot_be_is_refused_everywhere(experiment, value):
    for path in paths_of(experiment)[::11]:
        with pytest.raises(rs.RobSimError):
            experiment.at(path, value)


def test_rows_of_runs_of_the_wrong_shape_are_refused(experiment):
    for path in paths_of(experiment)[::19]:
        found = find_path(experiment, path)
        wrong = np.ones((2, 7, 5, 3))
        with pytest.raises(rs.RobSimError, match=r"expected shape|cannot differ|expected"):
            experiment.vary({path: wrong})
        if found is not None and found.leaf.stack is not None:
            with pytest.raises(rs.RobSimError, match="shape"):
                experiment.vary({path: np.empty((0, 3))})


def test_rows_of_unequal_length_are_refused(experiment):
    with pytest.raises(rs.errors.InputError, match="a number for each run"):
        experiment.vary({"sensing.outliers": [0.1, 0.2], "sensing.noise": [0.1, 0.2, 0.3]})
