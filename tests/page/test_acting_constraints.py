"""The constraints that act, in the recordings of runs: which, when and where."""

import dataclasses

import numpy as np
import pytest
from page.borders import list_acting, make_border_case

import robsim as rs
from robsim.page.constraint_entries import pack_constraint_states
from robsim.page.export import export_html, load_recording
from robsim.page.recording_builder import Recording
from robsim.page.recording_codec import pack_recording, unpack_recording
from robsim.page.recordings import build_recording
from robsim.run.constraint_states import ConstraintStates
from robsim.servo.constraints.row_names import name_first_row, number_repeated_names, parse_row_name


@pytest.fixture(scope="module")
def run():
    return make_border_case().run()


def unpacked(recording, state, instant):
    """The names of the constraints whose bits are set at an instant."""
    words = recording.arrays[f"constraints {state}"][instant]
    entries = enumerate(recording.header["constraints"])
    return [each["name"] for i, each in entries if int(words[i // 16]) >> i % 16 & 1]


def test_the_bits_are_the_positive_multipliers_of_the_run(run):
    made = build_recording(run, trials=False)
    back = Recording(*unpack_recording(pack_recording(made.header, made.arrays, {"poses"})))
    shown = {each["name"] for each in back.header["constraints"]}
    assert {"left border for mark 1", "bottom border for mark 0"} < shown
    for instant in range(0, run.sizes["time"], 7):
        assert unpacked(back, "holding", instant) == list_acting(run, "active", instant)
        assert unpacked(back, "yielding", instant) == list_acting(run, "slack", instant) == []
    ever = (run.active.values > 0).any(axis=0)
    assert len(shown) == ever.sum() < ever.size == 28


def test_borders_name_side_and_mark_and_limits_do_not(run):
    by_name = {
        each.pop("name"): each for each in build_recording(run, trials=False).header["constraints"]
    }
    assert by_name["left border for mark 1"] == {"side": "left", "mark": 1}
    assert by_name["body.wz at its lower limit"] == {}


def test_the_image_has_the_margin_of_each_constraint():
    views = rs.constraints.FieldOfView(12.0), rs.constraints.FieldOfView(5.0, camera="camera")
    (eye,) = build_recording(make_border_case(*views, duration=0.2).run()).header["cameras"]
    assert eye["margins"] == [5.0, 12.0]


def test_a_run_without_constraints_stores_none():
    made = build_recording(rs.load_scenario(rs.examples.path("visp_tutorial")).run(duration=0.4))
    assert made.header["constraints"] is None and "margins" not in made.header["cameras"][0]
    assert not [name for name in made.arrays if name.startswith("constraints")]


def test_constraints_that_never_act_take_no_room(tmp_path):
    run = make_border_case(rs.constraints.JointSpeeds(9.0), duration=0.4).run()
    back = load_recording(export_html(run, tmp_path / "run.html"))
    count = back.arrays["time"].size
    assert back.header["constraints"] == []
    assert back.arrays["constraints holding"].shape == (count, 0)


def test_many_constraints_have_many_words(run):
    states = ConstraintStates.of(run)
    wide = dataclasses.replace(states, holding=np.ones_like(states.holding))
    packed = pack_constraint_states(wide)["constraints holding"]
    assert packed.shape == (run.sizes["time"], 2)
    assert (packed == [2**16 - 1, 2**12 - 1]).all()


def test_rows_of_several_depths_are_one_constraint():
    view = rs.constraints.FieldOfView(8.0, depth_error=0.2)
    run = make_border_case(view, rs.constraints.JointSpeeds(0.08)).run()
    names = [str(name) for name in run["constraint"].values]
    assert "left border for mark 1 (4)" in names
    states = ConstraintStates.of(run)
    own = [name.startswith("left border for mark 1") for name in names]
    expected = (run.active.values[:, own] > 0).any(axis=1)
    assert expected.any()
    assert np.array_equal(states.holding[:, states.names.index("left border for mark 1")], expected)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("top border for mark 11", {"side": "top", "mark": 11}),
        ("least depth of mark 3", {"mark": 3}),
        ("arm.hand in the sight of mark 0", {"mark": 0}),
        (
            "right border for mark 2 of a cup in the left eye",
            {"side": "right", "mark": 2, "target": "a cup", "camera": "the left eye"},
        ),
        ("panda.joint4 at its upper limit", {}),
        ("distance of hand from mark 0 of cup", {}),
    ],
)
def test_row_names_are_understood(name, parts):
    assert parse_row_name(name) == parts


def test_a_number_is_dropped_from_repeated_names_only():
    rows = number_repeated_names(["plane for a", "plane for a", "plane for b (2)"])
    assert rows == ("plane for a", "plane for a (2)", "plane for b (2)")
    assert [name_first_row(each, rows) for each in rows] == [rows[0], rows[0], rows[2]]
