"""A session about a study: its map, and the runs of it that pages open, without a server."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest
from studio.test_session import Pages

import robsim as rs
from robsim.page.recording_codec import unpack_recording
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.web.app import UnavailableDownload


@pytest.fixture(scope="module")
def study():
    """Sixteen runs; ten of them could not begin."""
    one = rs.load_scenario(rs.examples.path("local_minimum")).with_(duration=6)
    look = rs.starts.LookAt(distance=(0.4, 1.2), visible=False, aside=0.6)
    vary = {"task.interaction": ["current", "mean"], "task.gain": rs.samplers.Choice([1.0, 2.0])}
    return rs.study(one, 8, seed=2, start=look, vary=vary)


class StudyPages(Pages):
    """Pages of a studio of a study."""

    def __init__(self, study):
        self.session = Session(None, ScenarioShelf.shipped(), study)
        self.told, self.heard = [], 0
        self.session.broadcast = self.told.append
        self.session.start()


@pytest.fixture
def pages(study):
    made = StudyPages(study)
    yield made
    made.session.close()


@pytest.fixture
def told(pages):
    """The header and the arrays of the map, which a new page receives first."""
    message = json.loads(pages.session.hello()[0])
    assert message["type"] == "study"
    return unpack_recording(base64.b64decode(message["recording"]))


def test_a_new_page_receives_the_table_first(study, told):
    header, arrays = told
    names = [column["name"] for column in header["columns"]]
    assert names == [name for name in study.table if name != "outcome"]
    for column in header["columns"]:
        array, own = arrays[column["name"]], study.table[column["name"]]
        if "labels" in column:
            array = np.array(column.get("numbers", column["labels"]))[array]
            assert array.tolist() == own.tolist()
        else:
            assert np.array_equal(array, own.to_numpy(array.dtype), equal_nan=True)
    outcomes = np.array([each["name"] for each in header["outcomes"]])[arrays["outcome"]]
    assert outcomes.tolist() == study.table["outcome"].tolist()


def test_columns_have_their_units_and_the_values_that_runs_of_a_sample_share(told):
    columns = {column["name"]: column for column in told[0]["columns"]}
    units = {"start_x": "m", "start_angle": "rad", "end_time": "s", "pixel_error": "px"}
    assert {name: columns[name]["unit"] for name in units} == units
    assert columns["task.gain"]["unit"] == "per second" and columns["began"]["unit"] == ""
    shared = {name for name, column in columns.items() if column["shared"]}
    assert {name for name in columns if name.startswith("start_")} < shared
    assert shared & {"task.gain", "task.interaction", "end_time", "draw"} == {"task.gain", "draw"}
    assert told[0]["in_turn"] == ["task.interaction"] and told[0]["cells"] == 2


def test_counts_agree_with_the_study_in_one_order(study, told):
    names = [outcome["name"] for outcome in told[0]["outcomes"]]
    counts = study.counts("task.interaction")
    for group in told[0]["counts"]:
        runs, began, shares = counts.rows[group["label"]]
        assert (group["runs"], group["began"]) == (runs, began)
        found = {names[i]: (count, text) for i, count, _, text in group["shares"]}
        assert found == {name: (each.count, str(each)) for name, each in shares.items()}
        assert sorted(group["shares"]) == group["shares"]
    reason = "8 of 16 runs could not begin and are not counted: 8 out of image"
    assert reason in told[0]["notes"]


def test_a_run_opens_as_the_study_had_it(study, pages):
    number = int(study.table["run"][study.table["outcome"] == "CONVERGED"].iloc[0])
    pages.ask({"speed": 0.0}, {"run": number})
    state = pages.until(lambda state: state["outcome"])
    row = study.table.iloc[number]
    assert state["run"] == number and state["outcome"] == row["outcome"]
    bench = pages.session.bench
    assert bench.experiment == study.of_run(number)
    assert bench.pair.live.decision.time == pytest.approx(row["end_time"], abs=1e-9)
    place = pages.session.bench.recording().arrays["poses"][0, :, :3]
    start = row[["start_x", "start_y", "start_z"]].to_numpy(float)
    assert np.abs(place - start).max(axis=1).min() < 1e-6


def test_a_run_that_could_not_begin_opens_and_ends_at_once(study, pages):
    pages.ask({"run": 0})
    state = pages.until(lambda state: state["outcome"])
    assert not study.table["began"][0]
    assert state["outcome"] == study.table["outcome"][0] and pages.session.bench.time == 0


@pytest.mark.parametrize(
    "number", [-1, 16, 2**53, True, 1.0, 1.5, "3", "../study.toml", None, [3], {"run": 3}]
)
def test_what_is_no_run_is_refused_in_words(number, pages):
    pages.ask({"run": number})
    state = pages.until(lambda state: state["note"])
    assert "run" in state["note"] and "internal" not in state["note"]
    assert state["run"] is None and not state["playing"] and pages.session.open_bench is None


@pytest.mark.parametrize("wish", [{"play": True}, {"step": 1}, {"reset": True}, {"second": None}])
def test_before_a_run_is_open_there_is_nothing_to_move(wish, pages):
    pages.ask(wish)
    state = pages.until(lambda state: state["note"])
    assert state["note"] == "no run is open yet: choose one on the map"
    with pytest.raises(UnavailableDownload, match="no run is open yet"):
        pages.session.download("run.nc")


def test_another_experiment_is_no_run_of_the_study(pages):
    pages.ask({"run": 4})
    pages.until(lambda state: state["run"] == 4 and state["playing"])
    pages.ask({"open": "visp_tutorial"})
    assert pages.until(lambda state: state["run"] is None)["handles"]
    assert len([m for m in pages.session.hello() if '"type": "study"' in m[:20]]) == 1


def test_a_studio_without_a_study_has_no_runs():
    pages = Pages(rs.load_scenario(rs.examples.path("visp_tutorial")))
    pages.ask({"run": 0})
    note = pages.until(lambda state: state["note"])["note"]
    pages.session.close()
    assert note == "no run 0 in this study"
