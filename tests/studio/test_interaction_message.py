"""The message of the interaction matrix holds the numbers of `Scene.interaction` at the instant."""

import json

import numpy as np
import pytest

import robsim as rs
from robsim.studio.interaction_message import InteractionMessages
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench


def make_bench(name, **changes):
    """Return a bench with three instants of an example."""
    bench = Workbench(rs.load_scenario(rs.examples.path(name)).at(changes))
    bench.step()
    bench.step()
    return bench


@pytest.mark.parametrize("index", [0, 2])
def test_the_matrix_of_an_instant_is_that_of_the_scene(index):
    bench = make_bench("visp_tutorial")
    message = InteractionMessages().build(bench, index)
    instant = bench.pair.live.instants[index]
    L = bench.experiment.scene.interaction(instant.q)
    entry, joints = message["matrices"]
    np.testing.assert_allclose(entry["matrix"], L.matrix, rtol=1e-4, atol=1e-9)
    assert (message["type"], message["index"], message["time"]) == (
        "interaction",
        index,
        instant.time,
    )
    assert entry["rows"] == L.rows and entry["columns"] == L.columns
    assert entry["rank"] == L.rank == entry["full"] == 6
    assert entry["condition"] == pytest.approx(np.linalg.cond(L), rel=1e-4)
    singular = np.linalg.svd(L.matrix, compute_uv=False)
    np.testing.assert_allclose(entry["singular"], singular, rtol=1e-4)
    assert entry["free"] == [] and entry["tolerance"] == 1e-6
    LJ = bench.experiment.task.task_jacobian(bench.experiment.scene, instant.q)
    np.testing.assert_allclose(joints["matrix"], LJ.matrix, rtol=1e-4, atol=1e-9)
    assert joints["columns"] == LJ.columns


def test_free_motions_are_told_in_words():
    bench = make_bench("eye_in_hand", **{"task.features": {"kind": "points", "marks": [0]}})
    L, LJ = InteractionMessages().build(bench, 0)["matrices"]
    assert L["rank"] == L["full"] == 2 and len(L["free"]) == 4
    assert L["free"][0].startswith("the camera may move along (")
    assert LJ["full"] == 2 and len(LJ["free"]) == 5


def test_each_servo_task_has_its_matrices():
    entries = InteractionMessages().build(make_bench("mobile_arm"), 1)["matrices"]
    assert [each["title"].partition(":")[0] for each in entries] == [
        *("L of task 1, IBVS", "L J of task 1, IBVS"),
        *("L of task 2, PBVS", "L J of task 2, PBVS"),
    ]


@pytest.mark.parametrize("index", [-1, 3, 1.5, True, "x", None, [1], 2**70])
def test_an_instant_that_does_not_exist_has_a_reason(index):
    message = InteractionMessages().build(make_bench("visp_tutorial"), index)
    assert message["matrices"] == [] and "number of an instant, 0 to 2" in message["reason"]
    json.dumps(message, allow_nan=False)


def test_without_a_run_there_is_a_reason():
    assert "step by step" in InteractionMessages().build(None, 0)["reason"]


def test_a_request_is_answered_and_changes_nothing():
    session, sent = Session(make_bench("visp_tutorial"), ScenarioShelf([])), []
    session.broadcast = sent.append
    session.note, handled = "a note that remains", session.handled
    session._handle_requests([{"interaction": 1}])
    (message,) = map(json.loads, sent)
    assert (message["type"], message["index"], len(message["matrices"])) == ("interaction", 1, 2)
    assert session.note == "a note that remains" and session.handled == handled


@pytest.mark.parametrize("name", ["marks_that_lie", "mobile_arm", "stereo_in_hand"])
def test_messages_are_small(name):
    bench = make_bench(name)
    assert len(json.dumps(InteractionMessages().build(bench, 0))) < 16 * 1024
