"""The value that a control shows, the value in effect and the value in the file are one."""

import os
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim import examples, load_scenario
from robsim.base import si_units
from robsim.declare.controls import Control
from robsim.errors import InputError
from robsim.run.experiment_paths import find_path, find_path_owner
from robsim.studio.control_values import check_control_value
from robsim.studio.rounded_values import list_control_units, round_dragged_value
from robsim.studio.workbench import Workbench

DRAWN = int(os.environ.get("ROBSIM_TEST_CONTROLS", "1"))  # of an experiment; 30 take hours
FEW = {"visp_tutorial": 6, "eye_in_hand": 3, "joint_limits": 4, "wrong_calibration": 3}
COUNTS = dict.fromkeys(examples.names(), DRAWN)
EACH = [*FEW.items(), *(pytest.param(*each, marks=pytest.mark.full) for each in COUNTS.items())]


def format_shown(value, unit):
    """The text of a number on the page: six digits, angles in degrees."""
    shown = value / float(si_units.deg) if unit.startswith("rad") else value
    return str(int(shown)) if float(shown).is_integer() else f"{shown:.6g}"


def list_shown(control, value):
    """The texts of a control on the page."""
    if control.form in ("flag", "choice"):
        return [str(value)]
    if control.form == "list":
        return [str(each) for each in value]
    numbers = np.broadcast_to(value, np.shape(control.value)).ravel().tolist()
    return [format_shown(x, u) for x, u in zip(numbers, list_control_units(control), strict=True)]


def read_value_in_effect(experiment, control):
    """The value at the path of a control, as the experiment stores it."""
    path = find_path(experiment, control.path)
    value = path.get(find_path_owner(experiment, control.path))
    if control.form != "choice" or isinstance(value, str):
        return value
    if value is None:
        return "none"
    raw = path.leaf.spec.write(value, path.leaf.c)
    raw = raw[0] if isinstance(raw, list) else raw
    return raw if isinstance(raw, str) else raw["kind"]


def draw_values(control, rng):
    """Five values: inside, at both bounds, slightly outside, and odd."""
    if control.form == "flag":
        return [True, False, "yes", 1, not control.value]
    if control.form == "choice":
        return [*rng.choice(control.options, 3).tolist(), "nonsense", control.options[-1]]
    if control.form == "whole":
        inside = int(rng.integers(control.low, min(control.high, 50) + 1))
        return [inside, control.low, control.high, control.low - 1, 2.5]
    low, high = (np.array(end, dtype=float) for end in (control.low, control.high))
    inside, share = low + (high - low) * rng.random(low.shape), rng.random(low.shape)
    odd = low + (high - low) * np.round(share, 1) + 1e-17
    values = [inside, low, high, high + 0.01 * (high - low), odd]
    return [each.tolist() for each in values]


def assert_requested(control, value, now):
    """Check that the value in effect is the requested value, rounded to what a page shows."""
    if control.form in ("flag", "choice", "whole"):
        assert now.value == value
    elif control.path.endswith(".rotvec"):  # the shortest vector of the same rotation
        requested, actual = (rs.Pose.at(rotvec=x).rotation for x in (value, now.value))
        assert np.allclose(actual, requested, rtol=0, atol=5e-5)
    else:
        assert np.allclose(now.value, value, rtol=1e-5, atol=1e-15)


def list_all_shown(controls):
    return {path: list_shown(each, each.value) for path, each in controls.items()}


def is_alike(path, other):
    """Whether another path is the value itself, or a belief that follows it."""
    return other.rpartition("belief.")[2] == path.rpartition("belief.")[2]


def is_stated(table, path):
    """Whether a file states the table of a value; else the value is a default, such as "home"."""
    for key in path.split(".")[:-1]:
        if isinstance(table, list) and all(isinstance(each, dict) for each in table):
            table = {each.get("name", str(i)): each for i, each in enumerate(table)}
        if not isinstance(table, dict) or key not in table:
            return False
        table = table[key]
    return True


def check_set(bench, path, value):
    """Set a value; check that it is shown, in effect and saved, or refused without a trace."""
    control, experiment, before = bench.controls[path], bench.experiment, dict(bench.controls)
    try:
        bench.set(path, value)
    except InputError as error:
        assert str(error) and bench.experiment is experiment
        assert bench.controls == before
        return
    now = bench.controls[path]
    assert_requested(control, value, now)
    shown = list_shown(now, now.value)
    assert list_shown(now, read_value_in_effect(bench.experiment, now)) == shown
    if control.form in ("number", "numbers") and not path.endswith("rotvec"):
        assert shown == list_shown(now, check_control_value(control, value))
    saved = rs.Experiment.from_text(bench.experiment.to_toml())
    assert saved == bench.experiment
    stored = {each.path: each for each in saved.controls()}
    assert stored[path].value == now.value
    if control.form != "choice":  # another kind has other values
        was, after = list_all_shown(before), list_all_shown(bench.controls)
        others = [each for each in after if each in was and was[each] != after[each]]
        check_followers(bench, path, others, stored)


def check_followers(bench, path, others, stored):
    """Check the values that a change moved too: they are not stated, and are shown and saved."""
    table = tomllib.loads(bench.experiment.to_toml())
    listed = [change["path"] for change in bench.differences]
    originals = list_all_shown(bench._original_controls)
    for other in others:
        now = bench.controls[other]
        shown = list_shown(now, now.value)
        assert is_alike(path, other) or not is_stated(table, other), other
        assert list_shown(now, read_value_in_effect(bench.experiment, now)) == shown
        assert stored[other].value == now.value
        believed = "belief" in other.split(".")  # it is listed as the true value
        assert other in listed or believed or shown == originals.get(other, shown), other


@pytest.mark.filterwarnings("ignore")  # such as features of low rank
@pytest.mark.parametrize(("name", "count"), EACH)
@pytest.mark.few(1)
def test_the_value_shown_the_value_in_effect_and_the_value_saved_are_one(name, count):
    bench = Workbench(load_scenario(examples.path(name)))
    rng = np.random.default_rng(7)
    paths = sorted(path for path, each in bench.controls.items() if each.form != "list")
    for path in rng.choice(paths, min(count, len(paths)), replace=False).tolist():
        for number in range(5):
            if path in bench.controls:  # another kind may lack it
                value = draw_values(bench.controls[path], rng)[number]
                check_set(bench, path, value)


def test_beliefs_that_differ_are_fields_of_their_tasks_alone():
    """A common field would show and change neither of them."""
    experiment = load_scenario(examples.path("car"))
    first, second = experiment.task.tasks
    paths = [each.path for each in experiment.controls()]
    assert any(path.startswith("belief.") for path in paths)
    believed = experiment.at({"belief.cameras.camera.focal": [410.0, 400.0]}).task.tasks[0].belief
    apart = experiment.with_(task=rs.Priorities([replace(first, belief=believed), second]))
    values = {each.path: each.value for each in apart.controls() if "belief." in each.path}
    assert not any(path.startswith("belief.") for path in values)
    assert values["task.tasks.0.belief.cameras.camera.focal"] == [410.0, 400.0]


def test_numbers_from_a_slider_are_stored_as_they_are_shown():
    bench = Workbench(load_scenario(examples.path("visp_tutorial")))
    for given, stored in ((0.7999999, 0.8), (0.8300000000000001, 0.83), (1234567.0, 1234567.0)):
        bench.set("task.gain", given)
        assert bench.experiment.task.gain == stored
        bench.change({"task.gain": given})  # as a button does
        assert bench.experiment.task.gain == stored
    bench.set("start.rotvec", [0.0, 0.0, 12.499999999 * float(si_units.deg)])
    assert 'rpy = "0, 0, 12.5 deg"' in bench.experiment.to_toml()
    exact = bench.controls["start.position"].value
    bench.set("start.position", [exact[0], 0.1 + 0.2, exact[2]])  # the others stay exact
    assert bench.controls["start.position"].value == [exact[0], 0.3, exact[2]]


def test_a_moved_start_keeps_its_angles():
    bench = Workbench(load_scenario(examples.path("visp_tutorial")))
    bench.set("start.position", [-0.25, 0.1, -0.9])
    assert 'position = "-25, 10, -90 cm"\nrotvec = "-10, 10, -50 deg"' in bench.experiment.to_toml()


def test_a_slider_at_its_end_stays_within_its_limits():
    bench = Workbench(load_scenario(examples.path("eye_in_hand")))
    control = bench.controls["start.q"]
    for end in (control.low, control.high):
        for i, limit in enumerate(end):
            value = check_control_value(
                control, [*control.value[:i], limit, *control.value[i + 1 :]]
            )
            assert control.low[i] <= value[i] <= control.high[i]
            assert value[i] == pytest.approx(limit, abs=2e-5)


def test_a_dragged_pose_has_numbers_of_a_person():
    place = Control("objects.plate.position", "numbers", [0.31, 0.0, 1 / 3], unit="m", names="xyz")
    assert round_dragged_value(place, [0.36124999, 1e-5, 1 / 3]) == [0.3612, 0.0, 1 / 3]
    turn = replace(place, path="objects.plate.rotvec", unit="rad", value=[0.0, 1 / 3, 0.0])
    assert round_dragged_value(turn, [1e-6, 1 / 3 + 1e-6, 0.0]) == turn.value  # not turned
    turned = round_dragged_value(turn, [0.0, 1 / 3, 0.5])
    assert turned == [0.0, 19.1 * float(si_units.deg), 28.65 * float(si_units.deg)]
