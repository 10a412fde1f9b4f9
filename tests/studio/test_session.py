"""A session: requests of pages and the messages to them, without a server."""

from __future__ import annotations

import base64
import json
import time
import tomllib

import numpy as np
import pytest

from robsim import examples, load_scenario, open_run
from robsim.page import load_recording
from robsim.page.recording_codec import unpack_recording
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench


class Pages:
    """Pages that keep the messages they receive."""

    def __init__(self, experiment):
        self.session = Session(Workbench(experiment), ScenarioShelf.shipped())
        self.told, self.heard = [], 0
        self.session.broadcast = self.told.append
        self.session.start()

    def ask(self, *wishes):
        for wish in wishes:
            self.session.receive(wish)

    def until(self, fits):
        """Return the first state from here on that fits, or fail."""
        for _ in range(2000):
            for message in self.told[self.heard :]:
                self.heard += 1
                state = json.loads(message)
                if state["type"] == "state" and fits(state):
                    return state
            time.sleep(0.01)
        raise AssertionError(self.messages("state")[-1])

    @staticmethod
    def until_true(fact):
        for _ in range(2000):
            if fact():
                return
            time.sleep(0.01)
        raise AssertionError

    def messages(self, kind):
        return [m for m in map(json.loads, list(self.told)) if m["type"] == kind]


@pytest.fixture
def experiment():
    return load_scenario(examples.path("visp_tutorial"))


@pytest.fixture
def pages(experiment):
    made = Pages(experiment)
    yield made
    made.session.close()


def rows_of(messages):
    """Return the arrays that a page has after these messages."""
    arrays = {}
    for message in map(json.loads, messages):
        if message["type"] in ("recording", "rows"):
            _, more = unpack_recording(base64.b64decode(message["recording"]))
            start = message.get("from", 0)
            timed = message["type"] == "rows"
            arrays = {
                name: np.concatenate([arrays[name][:start], more[name]])
                if timed and name in more and not name.endswith(".goal")
                else more.get(name, arrays.get(name))
                for name in {*arrays, *more}
            }
    return arrays


def test_a_page_sees_the_run_of_the_experiment(pages, experiment):
    pages.ask({"speed": 0.0}, {"play": True})
    end = pages.until(lambda state: state["resting"])
    run = experiment.run()
    assert end["outcome"] == "CONVERGED" and end["playing"]
    arrays = rows_of(pages.told)
    count = int(np.isfinite(run["error_norm"]).sum())
    assert len(arrays["time"]) == count + 25  # a second after convergence
    pixels = run["pixels"].values[:count].astype(np.float32)
    assert np.array_equal(arrays["camera.pixels"][:count], pixels)


def test_a_page_that_comes_late_has_it_all(pages):
    pages.ask({"speed": 0.0}, {"play": True})
    pages.until(lambda state: state["resting"])
    late, early = rows_of(pages.session.hello()), rows_of(pages.told)
    assert all(np.array_equal(late[name], early[name]) for name in early)
    kinds = [json.loads(message)["type"] for message in pages.session.hello()]
    assert kinds[:4] == ["controls", "gallery", "shapes", "recording"] and kinds[-1] == "state"


def test_a_change_is_echoed_with_its_consequences(pages):
    pages.ask({"set": ["task.gain", 1.25]})
    state = pages.until(lambda state: state["edited"])
    change = {"path": "task.gain", "before": "0.5 1/s", "after": "1.25 1/s", "original": 0.5}
    assert state["changes"] == [change]
    (changed,) = pages.messages("values")[-1]["controls"]
    assert (changed["path"], changed["value"]) == ("task.gain", 1.25)
    assert pages.session.bench.experiment.task.gain == 1.25


def test_a_fault_is_reported_and_nothing_ends(pages):
    for wish, reason in [
        ({"set": ["task.gain", -1]}, "greater than 0"),
        ({"set": "task.gain"}, "set: expected [name, value]"),
        ({"drag": 3}, "drag: expected [name, value]"),
        ({"open": "../../etc/passwd"}, "no experiment '../../etc/passwd'"),
        ({"open": ["x"]}, "no experiment"),
        ({"speed": 3}, "no speed 3"),
        ({"second": ["task.gian", 1]}, "did you mean"),
        ({"shell": "rm"}, "requests: play"),
        ({"run": "rm"}, "no run 'rm' in this study"),
    ]:
        pages.ask(wish)
        pages.until(lambda state, reason=reason: reason in state["note"])
    pages.ask({"step": True})
    pages.until_true(lambda: pages.session.bench.time == 0.04)


def test_a_refused_value_is_told_beside_its_field_until_another_is_accepted(pages):
    pages.ask({"open": "eye_in_hand"})
    pages.until(lambda state: len(state["handles"]) == 4)
    pages.ask({"set": ["start.q", [9.0, *[0.0] * 6]]})
    told = pages.until(lambda state: state["refusals"])["refusals"]
    reason = "q: joint 'link1' of 'panda' is 515.7 deg, outside its limits [-166, 166] deg"
    assert told == [{"path": "start.q", "reason": reason}]
    pages.ask({"set": ["task.gain", -1.0]})
    told = pages.until(lambda state: len(state["refusals"]) == 2)["refusals"]
    assert told[1] == {"path": "task.gain", "reason": "must be greater than 0, got -1 1/s"}
    pages.ask({"set": ["task.gain", 1.5]})
    state = pages.until(lambda state: not state["refusals"])
    assert [each["after"] for each in state["changes"]] == ["1.5 1/s"]


def test_a_change_after_a_failure_starts_over_and_plays(pages):
    pages.ask({"open": "eye_in_hand"}, {"speed": 0.0})
    pages.until(lambda state: len(state["handles"]) == 4)
    pages.ask({"set": ["task.gain", 200.0]})
    state = pages.until(lambda state: state["missed"])
    assert not state["playing"] and state["restarts"] == 0
    pages.ask({"set": ["task.gain", 0.8]})
    state = pages.until(lambda state: state["restarts"] == 1)
    assert state["restarted_because"].startswith("the run had ended: ")
    state = pages.until(lambda state: state["resting"])
    assert not state["missed"] and state["distance"]["length"] < 1e-3 and state["since"] == 0.0
    assert pages.session.bench.experiment.task.gain == 0.8


def test_a_change_wakes_a_run_that_rests(pages):
    pages.ask({"speed": 0.0}, {"play": True})
    pages.until(lambda state: state["resting"])
    count = len(pages.session.bench.pair.live.instants)
    time.sleep(0.2)
    assert len(pages.session.bench.pair.live.instants) == count
    pages.ask({"drag": ["objects.square", [0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]})
    woken = pages.until(lambda state: state["goal"]["kept"])
    assert woken["playing"] and not woken["resting"]
    assert woken["since"] == pytest.approx(21.4)
    state = pages.until(lambda state: state["resting"])
    assert state["outcome"] == "CONVERGED" and state["distance"]["length"] < 1e-4


def test_requests_of_the_history(pages):
    pages.ask({"set": ["task.gain", 2.0]})
    pages.until(lambda state: state["undo"] and not state["redo"])
    pages.ask({"undo": True})
    pages.until(lambda state: state["redo"] and not state["edited"] and not state["changes"])
    pages.ask({"redo": True})
    pages.until(lambda state: state["edited"] and not state["redo"])
    pages.ask({"original": True})
    pages.until(lambda state: not state["edited"] and state["undo"])
    pages.ask({"change": {"task.interaction": "desired", "run.dt": "20 ms"}})
    state = pages.until(lambda state: len(state["changes"]) == 2)
    assert state["changes"] == [
        {
            "path": "task.interaction",
            "before": "current",
            "after": "desired",
            "original": "current",
        },
        {"path": "run.dt", "before": "40 ms", "after": "20 ms", "original": 0.04},
    ]
    pages.ask({"second": {"task.gain": 0.3}})
    pages.until(lambda state: state["second"] == {"task.gain": 0.3})
    pages.ask({"undo": True})
    pages.until(lambda state: not state["second"])


def test_of_equal_requests_the_last_one_counts(pages):
    pages.ask(*({"set": ["task.gain", gain]} for gain in np.linspace(0.1, 3.0, 200)))
    pages.until_true(lambda: pages.session.bench.experiment.task.gain == 3.0)
    assert pages.session.bench.revision < 40


def test_it_keeps_real_time(pages):
    pages.ask({"play": True})
    began = time.monotonic()
    pages.until_true(lambda: pages.session.bench.time > 0.5)
    assert time.monotonic() - began > 0.4


def test_another_experiment_is_opened_by_name(pages):
    pages.ask({"open": "eye_in_hand"})
    state = pages.until(lambda state: len(state["handles"]) == 4 and state["playing"])
    names = [each["name"] for each in state["handles"]]
    assert names == ["objects.plate", "start", "goal", "cameras.camera"]
    told = [json.loads(each) for each in pages.session.hello()]
    why = next(each["why"] for each in told if each["type"] == "texts")
    assert why["headline"] == "" and why["watch"][0]["text"].startswith("A Panda arm")


def test_the_saved_file_is_the_experiment_as_it_is(pages, tmp_path, monkeypatch):
    pages.ask({"set": ["task.gain", 1.5]})
    pages.until(lambda state: state["changes"])
    session = pages.session
    kind, text = session.download("experiment.toml")
    assert kind == "application/toml" and tomllib.loads(text.decode())["task"]["gain"] == 1.5
    (tmp_path / "run.nc").write_bytes(session.download("run.nc")[1])
    run = session.bench.experiment.run()
    assert np.array_equal(open_run(tmp_path / "run.nc")["q"], run["q"], equal_nan=True)
    (tmp_path / "run.html").write_bytes(session.download("run.html")[1])
    assert load_recording(tmp_path / "run.html").header["title"] == session.bench.experiment.title
    assert session.file_name("run.html") == "visp_tutorial-run.html"
    found = {}
    monkeypatch.setattr("robsim.page.export.open_page_file", lambda path: None)
    exec(session.download("experiment.py")[1].decode(), found)
    assert found["experiment"] == session.bench.experiment
    assert session.download("../run.nc") is None


def test_an_error_of_the_simulation_is_reported_and_nothing_ends(pages, monkeypatch):
    bench = pages.session.bench
    with monkeypatch.context() as patch:
        patch.setattr(type(bench.pair), "step", lambda self: 1 / 0)
        pages.ask({"play": True})
        pages.until(lambda state: "the simulation stopped: ZeroDivisionError" in state["note"])
    pages.ask({"step": 3})
    pages.until_true(lambda: bench.time == pytest.approx(0.12))


def test_messages_sent_in_parts_come_whole_to_a_late_page(pages, monkeypatch):
    monkeypatch.setattr("robsim.studio.scene_messages.TAIL", 3)
    for gain in (0.6, 0.7, 0.8, 0.9, 1.0, 1.1):
        pages.ask({"step": 4})
        pages.ask({"set": ["task.gain", gain]})
        pages.until_true(lambda gain=gain: pages.session.bench.experiment.task.gain == gain)
    pages.ask({"drag": ["objects.square", [0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]}, {"step": 2})
    pages.until_true(lambda: pages.session.bench.time == pytest.approx(1.04))
    pages.ask({"speed": 2.0})
    pages.until(lambda state: state["speed"] == 2.0)
    late, early = rows_of(pages.session.hello()), rows_of(pages.told)
    assert len(late["time"]) == 27
    for name in early:
        rounding = 1e-4 if name == "poses" else 0.0
        assert np.allclose(late[name], early[name], rtol=0, atol=rounding, equal_nan=True), name


def test_a_folder_is_a_shelf(tmp_path):
    (tmp_path / "one.toml").write_text("# Look here.\nschema = 1\ntitle = '<b>one</b>'\n")
    (tmp_path / "two.toml").write_text("not toml")
    assert ScenarioShelf.of(tmp_path).entries == [
        {"name": "one", "group": "", "title": "<b>one</b>", "about": "Look here.", "more": ""},
        {"name": "two", "group": "", "title": "two", "about": "", "more": ""},
    ]
