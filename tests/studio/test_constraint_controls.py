"""Constraints of the law on the bench: added, removed and changed, and shown while they act."""

import json

import numpy as np
import pytest
from page.borders import make_border_case
from studio.page_model import PageModel

import robsim as rs
from robsim.errors import InputError
from robsim.studio.outbound_messages import OutboundMessages
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench

LIST = "task.law.constraints"


@pytest.fixture
def bench():
    return Workbench(rs.load_scenario(rs.examples.path("visp_tutorial")))


def constraints(bench):
    return list(bench.experiment.task.law.constraints)


def test_the_law_is_switched_and_constraints_are_added_changed_and_removed(bench):
    bench.set("task.law", "constrained")
    assert constraints(bench) == [rs.constraints.JointLimits()]
    control = bench.controls[LIST]
    assert control.form == "list" and control.value == ["joint_limits"]
    kinds = {"field_of_view", "joint_limits", "joint_speeds", "joint_accelerations", "mark_depth"}
    assert kinds <= set(control.options)
    bench.set(LIST, [0, "field_of_view", "joint_speeds"])
    bench.set(f"{LIST}.1.margin", 20.0)
    bench.set(f"{LIST}.2.most", 0.3)
    added = [rs.constraints.FieldOfView(20.0), rs.constraints.JointSpeeds(0.3)]
    assert constraints(bench) == [rs.constraints.JointLimits(), *added]
    bench.set(LIST, [2, 1])
    assert constraints(bench) == added[::-1]
    bench.undo()
    assert constraints(bench) == [rs.constraints.JointLimits(), *added]
    for _ in range(5):
        bench.step()
    assert bench.experiment == rs.Experiment.from_text(bench.experiment.to_toml())


@pytest.mark.parametrize("wrong", [[], [1], [0, 0], ["clearance"], [0, None], "field_of_view", 3])
def test_a_wrong_list_is_refused(bench, wrong):
    bench.set("task.law", "constrained")
    before = bench.experiment
    with pytest.raises(InputError, match=LIST.replace(".", r"\.")):
        bench.set(LIST, wrong)
    assert bench.experiment is before


def test_a_changed_list_is_told_in_words(bench):
    bench.set("task.law", "constrained")
    bench.set(LIST, [0, "mark_depth"])
    (told,) = [each for each in bench.differences if each["path"] == "task.law"]
    assert told["before"] == "joint" and told["after"] == "constrained"
    other = Workbench(bench.experiment)
    other.set(LIST, [1])
    (told,) = [each for each in other.differences if each["path"] == LIST]
    assert told["before"] == "joint limits, mark depth" and told["after"] == "mark depth"
    assert told["original"] is None


def test_instants_before_a_change_keep_the_constraints_that_acted():
    bench = Workbench(make_border_case())
    for _ in range(90):
        bench.step()
    before = bench.pair.instants().constraints
    bench.set(LIST, [1])  # the speeds alone
    bench.step()
    after = bench.pair.instants().constraints
    assert len(before.names) == 28 and len(after.names) == 12
    assert np.array_equal(after.holding[:90], before.holding[:90, :12])
    bench.set(LIST, ["field_of_view", 0])
    bench.step()
    again = bench.pair.instants().constraints
    assert not again.holding[:90, 12:].any() and np.array_equal(
        again.holding[:90, :12], before.holding[:90, :12]
    )


def test_borders_that_cannot_be_kept_give_way():
    bench = Workbench(make_border_case())
    for _ in range(60):
        bench.step()
    assert not bench.pair.instants().constraints.yielding.any()
    bench.set(f"{LIST}.0.margin", 170.0)
    bench.step()
    states, slack = bench.pair.instants().constraints, bench.pair.live.now.slack
    assert np.array_equal(states.yielding[-1], slack > 0)
    given = [name for name, one in zip(states.names, states.yielding[-1], strict=True) if one]
    assert given and all("border for mark" in name for name in given)


def test_each_row_belongs_to_its_constraint():
    bench = Workbench(make_border_case())
    by_name = {each["name"]: each for each in bench.recording().header["constraints"]}
    assert by_name["left border for mark 1"]["of"] == [f"{LIST}.0"]
    assert by_name["body.wz at its lower limit"]["of"] == [f"{LIST}.1"]


def test_a_page_hears_what_acts_and_a_new_page_the_same():
    session = Session(Workbench(make_border_case()), ScenarioShelf([]))
    out, bench = OutboundMessages(), session.bench
    model = PageModel(out.news(session, bench, session.shelf))
    for _ in range(100):
        bench.step()
        model.hear(out.news(session, bench, session.shelf))
    holding = bench.pair.instants().constraints.holding
    bits = 1 << np.arange(16)
    expected = np.column_stack([holding[:, :16] @ bits, holding[:, 16:] @ bits[:12]])
    assert np.array_equal(model.arrays["constraints holding"], expected) and expected.any()
    kinds = model.hear([])
    bench.set(f"{LIST}.0.margin", 30.0)
    kinds = model.hear(out.news(session, bench, session.shelf))
    assert "recording" not in kinds and model.header["cameras"][0]["margins"] == [30.0]
    bench.set(LIST, [0])
    kinds = model.hear(out.news(session, bench, session.shelf))
    assert "recording" in kinds and len(model.header["constraints"]) == 16
    fresh = PageModel(out.present())
    assert fresh.header == model.header
    assert all(np.array_equal(fresh.arrays[name], x) for name, x in model.arrays.items())


def test_a_page_receives_kinds_but_no_objects():
    session = Session(Workbench(make_border_case()), ScenarioShelf([]))
    told = [
        json.loads(each) for each in OutboundMessages().news(session, session.bench, session.shelf)
    ]
    controls = [one for each in told if each["type"] == "controls" for one in each["controls"]]
    (own,) = [one for one in controls if one["path"] == LIST]
    assert own["value"] == ["field_of_view", "joint_speeds"] and own["low"] == 1.0
    assert not {"items", "starters"} & own.keys()
