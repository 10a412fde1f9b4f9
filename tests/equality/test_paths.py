"""A path changes one number as its file would, with the refusals of a file, in few calls."""

import math
import sys

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.run.experiment_paths import (
    find_path,
    find_path_owner,
    is_numeric_value,
    replace_numbers,
)

FEW = {"adaptive_gain": 9, "calibration_errors": 11, "car": 17, "wrong_dh": 23}  # every so many
NAMES = sorted(examples.names())
PARTS = 8  # of the values of a number; an experiment tries one part, the next one another
EACH = [
    *[pytest.param(name, every, None, id=f"some of {name}") for name, every in FEW.items()],
    *[pytest.param(name, 1, i, id=name, marks=pytest.mark.full) for i, name in enumerate(NAMES)],
]
BAD = (0.0, -1.0, 1.0, -1e-9, 1e-12, 0.5, 7.0, 1e10, -1e10, math.nan, math.inf)
ROUNDED = "start.", "task.goal."  # the quaternion of a pose is known to rounding
LARGER = "eye_in_hand", "wrong_calibration"
AGREED = "puma560.links"  # this belief repeats some of the true numbers
DERIVED = "follows.length"  # a file without `at` derives this number, too


def controls(experiment):
    """The controls of numbers, with their paths: of bodies and links that are alike, the first."""
    kinds = {}
    for each in experiment.controls():
        if each.form in ("number", "whole", "numbers"):
            names = each.path.split(".")
            kinds.setdefault((names[0], len(names), names[-1]), each)
    return list(kinds.values())


def in_file(name, changes):
    """The experiment of the file with these changes, or None if it refuses them."""
    try:
        return rs.load_scenario(examples.path(name), changes)
    except rs.RobSimError:
        return None


def by_path(experiment, changes):
    """The experiment with these changes by their paths alone, or None if they are refused."""
    try:
        return replace_numbers(experiment, changes)
    except Exception:  # noqa: BLE001 - all of them lead to the way of a file
        return None


def list_other_values(control):
    """Values near the value of a control; some of them are valid."""
    if control.form == "whole":
        return [control.value + 1]
    value = np.asarray(control.value, dtype=float)
    return [(value * 1.01).tolist(), (value + 1e-3).tolist(), (value - 1e-3).tolist()]


def take_part(values, i, part):
    """Return the values that an experiment tries for its number i; all of them without a part."""
    return values if part is None else values[(i + part) % PARTS :: PARTS]


@pytest.mark.filterwarnings("ignore::robsim.errors.UnitWarning")
@pytest.mark.parametrize(("name", "every", "part"), EACH)
def test_a_number_changed_by_its_path_agrees_with_the_file(name, every, part):
    experiment = rs.load_scenario(examples.path(name))
    compared = 0
    for i, control in enumerate(controls(experiment)[::every]):
        if control.path.endswith(DERIVED) or (name == "wrong_dh" and AGREED in control.path):
            continue
        for value in take_part(list_other_values(control), i, part):
            changes = control.changes(value)
            made, said = by_path(experiment, changes), in_file(name, changes)
            assert (made is None) == (said is None), (control.path, value)
            if made is not None and not (
                control.path.startswith(ROUNDED) or control.path.endswith(DERIVED)
            ):
                assert made == said, control.path
            compared += made is not None
    assert compared > 5


@pytest.mark.filterwarnings("ignore::robsim.errors.UnitWarning")
@pytest.mark.parametrize(("name", "every", "part"), EACH)
@pytest.mark.few(2)
def test_a_value_that_a_file_refuses_is_refused_by_a_path(name, every, part):
    experiment = rs.load_scenario(examples.path(name))
    refused = 0
    for i, control in enumerate(controls(experiment)[::every]):
        size = np.shape(control.value)
        for value in take_part(BAD, i, part):
            given = np.full(size, value).tolist() if size else value
            changes = control.changes(given)
            if by_path(experiment, changes) is not None:
                assert in_file(name, changes) is not None, (control.path, value)
                continue
            refused += 1
            if in_file(name, changes) is None:
                with pytest.raises(rs.RobSimError):
                    experiment.at(changes)
            if math.isfinite(value) and by_path(experiment, {control.path: given}) is not None:
                assert in_file(name, changes) is not None, (control.path, value)
    assert refused > 5


@pytest.mark.parametrize(
    "name", ["visp_tutorial", *(pytest.param(x, marks=pytest.mark.full) for x in LARGER)]
)
def test_a_change_of_a_number_makes_few_calls(name):
    """Reading the tables again made some ten thousand; benchmarks/paths.py measures seconds."""
    experiment = rs.load_scenario(examples.path(name))
    calls = {}
    for control in controls(experiment):
        for value in list_other_values(control):
            if by_path(experiment, {control.path: value}) is not None:
                calls[control.path] = calls_of(lambda v=value, p=control.path: experiment.at(p, v))
                break
    assert len(calls) > 20
    assert {path: count for path, count in calls.items() if count > 1000} == {}


def calls_of(change):
    """The number of Python functions that a change calls."""
    count = 0

    def note(frame, event, argument):
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        change()
    finally:
        sys.setprofile(before)
    return count


def test_a_number_has_a_path_and_other_values_have_none():
    experiment = rs.load_scenario(examples.path("wrong_calibration"))
    found = find_path(experiment, "belief.cameras.camera.focal")
    assert found.get(find_path_owner(experiment, "belief.cameras.camera.focal")) == 960.0
    assert (
        is_numeric_value(experiment.scene.home)
        and not is_numeric_value("800")
        and not is_numeric_value(True)
    )
    assert find_path(experiment, "cameras.other.focal") is None
    assert find_path(experiment, "task.gian") is None
