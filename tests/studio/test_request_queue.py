"""The requests of pages that wait for a session, and files that wait for the requests."""

from __future__ import annotations

import threading
import time

import pytest

from robsim import examples, load_scenario, robots
from robsim.studio import request_queue
from robsim.studio.pendant.pendant_session import PendantSession
from robsim.studio.pendant.teach_pendant import TeachPendant
from robsim.studio.request_queue import RequestQueue
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench


def test_the_last_request_of_each_key_is_taken_in_order(monkeypatch):
    requests = RequestQueue(lambda request: request["key"])
    for key, value in [("a", 1), ("b", 2), ("a", 3)]:
        requests.put({"key": key, "value": value})
    assert [each["value"] for each in requests.take(0.0)] == [2, 3]
    assert requests.take(0.0) == []
    monkeypatch.setattr(request_queue, "MOST", 2)
    for value in range(3):
        requests.put({"key": value, "value": value})
    requests.finish()
    assert [each["value"] for each in requests.take(0.0)] == [0, 1]


def test_waiting_ends_when_the_taken_requests_are_handled():
    requests = RequestQueue(id)
    requests.put({})
    began = time.monotonic()
    requests.wait(0.1)
    assert time.monotonic() - began >= 0.1
    assert requests.take(0.0) == [{}]
    threading.Timer(0.1, requests.finish).start()
    requests.wait(60.0)
    assert 0.15 < time.monotonic() - began < 30.0


def slow(function):
    def act(*values):
        time.sleep(0.4)
        return function(*values)

    return act


@pytest.mark.full
def test_a_saved_file_has_the_poses_that_were_recorded_before(monkeypatch):
    monkeypatch.setattr(TeachPendant, "record", slow(TeachPendant.record))
    session = PendantSession(robots.planar_2r())
    session.start()
    session.receive({"record": True})
    session.receive({"record": True})
    table = session.download("poses.csv")[1].decode()
    session.close()
    assert table.count("\npose ") == 2


def test_a_saved_experiment_has_the_changes_that_were_requested_before(monkeypatch):
    monkeypatch.setattr(Workbench, "set", slow(Workbench.set))
    session = Session(Workbench(load_scenario(examples.path("visp_tutorial"))), None)
    session.send_news = lambda: None
    session.start()
    session.receive({"set": ["task.gain", 1.25]})
    text = session.download("experiment.toml")[1].decode()
    session.close()
    assert "gain = 1.25" in text
