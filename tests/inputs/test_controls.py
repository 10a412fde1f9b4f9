"""The values that a person may change by hand, as their declarations describe them."""

from __future__ import annotations

import math

import pytest

from robsim import IBVS, PBVS, Experiment, examples, load_scenario
from robsim.errors import InputError

NAMES = sorted(examples.names())


def control(experiment, path):
    return next(each for each in experiment.controls() if each.path == path)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.few(23)
def test_a_control_shows_the_value_that_it_sets(name):
    experiment = load_scenario(examples.path(name))
    controls = experiment.controls()
    changes = {}
    for each in controls:
        changes |= each.changes(each.value)
    same = {each.path: each for each in experiment.at(changes).controls()}
    for each in controls:
        value = same[each.path].value
        if isinstance(value, list):
            assert value == pytest.approx(each.value, abs=1e-12), each.path
        else:
            assert value == each.value, each.path


def test_a_slider_has_the_bounds_of_its_declaration():
    experiment = load_scenario(examples.path("visp_tutorial"))
    dropped, latency = (control(experiment, f"sensing.{x}") for x in ("dropped", "latency"))
    assert (dropped.low, dropped.high, dropped.unit) == (0, 0.999, "")  # all but 1 itself
    assert (latency.low, latency.high, latency.unit) == (0, 0.5, "s")
    assert latency.changes(0.08) == {"sensing.latency": "0.08 s"}
    assert experiment.at(latency.changes(0.08)).sensing.latency == 0.08


def test_a_slider_without_a_bound_reaches_four_times_as_far():
    experiment = load_scenario(examples.path("visp_tutorial")).at("task.gain", 3)
    assert control(experiment, "task.gain").high == 12.0
    skew = control(experiment, "cameras.camera.skew")
    assert (skew.low, skew.high) == (-5.0, 5.0)


def test_joints_have_their_limits():
    experiment = load_scenario(examples.path("eye_in_hand"))
    joints = control(experiment, "start.q")
    limits = experiment.scene.robots[0].limits
    assert [joints.low, joints.high] == limits.T.tolist()
    assert joints.names == experiment.scene.coordinate_names
    other = [0.5 * (a + b) for a, b in limits]
    assert experiment.at(joints.changes(other)).start.tolist() == other


def test_a_choice_offers_kinds_that_need_no_more_than_their_name():
    experiment = load_scenario(examples.path("visp_tutorial"))
    kinds = control(experiment, "task.kind")
    assert kinds.value == "ibvs" and {"pbvs", "hybrid"} <= set(kinds.options)
    assert "mission" not in kinds.options  # which needs its phases
    assert isinstance(experiment.at(kinds.changes("pbvs")).task, PBVS)
    depth = control(experiment, "task.depth")
    assert experiment.at(depth.changes("true")).task.depth == "true"  # a word, not a truth value


def test_a_free_camera_is_placed_by_position_and_rotation():
    experiment = load_scenario(examples.path("visp_tutorial"))
    place = control(experiment, "start.position")
    assert place.names == ("x", "y", "z") and place.unit == "m"
    moved = experiment.at(place.changes([0.1, 0.2, -1.0]))
    assert moved.start[:3].tolist() == [0.1, 0.2, -1.0]
    assert moved.start[3:].tolist() == pytest.approx(experiment.start[3:].tolist())


def test_a_belief_is_changed_where_the_truth_is_not():
    experiment = load_scenario(examples.path("visp_tutorial"))
    focal = control(experiment, "belief.cameras.camera.focal")
    wrong = experiment.at(focal.changes([880.0, 800.0]))
    assert wrong.task.belief.cameras[0].camera.K[0, 0] == 880.0
    assert wrong.scene.cameras[0].camera.K[0, 0] == 800.0


def test_a_value_out_of_bounds_is_refused_by_its_declaration():
    experiment = load_scenario(examples.path("visp_tutorial"))
    with pytest.raises(InputError, match=r"task\.gain: .*greater than 0"):
        experiment.at(control(experiment, "task.gain").changes(0.0))


def test_an_experiment_of_python_objects_has_controls_too():
    scene = load_scenario(examples.path("visp_tutorial")).scene
    experiment = Experiment(scene, IBVS(goal=[0, 0, -0.5, 0, 0, 0, 1], gain=0.7))
    assert control(experiment, "task.gain").value == 0.7
    assert control(experiment, "task.goal.position").value == [0, 0, -0.5]
    assert all(math.isfinite(x) for x in control(experiment, "start.position").value)
