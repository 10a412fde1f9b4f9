"""Pictures of the shown instant are drawn on request, beside the simulation."""

import dataclasses
import json
import threading
import time

import numpy as np
import pytest
from page.posters import decode, draw_noise, hang_poster, read_pictures

import robsim as rs
from robsim.page.recording_builder import Recording
from robsim.studio.live_pictures import MOST, LivePictures
from robsim.studio.message_text import LARGEST
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench


class Answers:
    """The messages of pictures of a workbench."""

    def __init__(self, experiment):
        self.bench, self.messages = Workbench(experiment), []
        self.pictures = LivePictures(self.messages.append)

    def ask(self, index, mode="picture", camera="camera"):
        """Return the answer of a request."""
        count = len(self.messages)
        self.pictures.request(self.bench, [camera, index, mode])
        for _ in range(2000):
            if len(self.messages) > count:
                assert len(self.messages[-1]) < LARGEST
                message = json.loads(self.messages[-1])
                assert (message["camera"], message["index"], message["mode"]) == (
                    camera,
                    index,
                    mode,
                )
                return message["image"] and decode(message["image"])
            time.sleep(0.01)
        raise AssertionError

    def reduce(self, scene):
        eye = scene.camera()
        return scene.replacing(dataclasses.replace(eye, camera=eye.camera.resized(320, 240)))


@pytest.fixture
def answers():
    made = Answers(hang_poster(draw_noise((6, 8))))
    for _ in range(10):
        made.bench.step()
    yield made
    made.pictures.close()


def test_the_picture_is_that_of_the_scene_and_follows_the_hand(answers):
    bench = answers.bench
    for index in (10, 3):
        q = bench.pair.live.instants[index].q
        scene = answers.reduce(bench.experiment.scene)
        np.testing.assert_array_equal(answers.ask(index), scene.picture(q))
    before = answers.ask(10)
    bench.set("objects.square.position", [0.05, 0.0, 0.0])
    scene, live = answers.reduce(bench.experiment.scene), bench.pair.live
    moved = answers.ask(10)
    np.testing.assert_array_equal(moved, scene.picture(live.now.q))
    assert (abs(moved.astype(float) - before) > 20).mean() > 0.1
    assert answers.ask(3) is None  # of another scene
    assert answers.ask(11) is None  # not there yet
    bench.step()
    np.testing.assert_array_equal(answers.ask(11), scene.picture(live.now.q))


def test_the_difference_vanishes_at_the_goal(answers):
    bench = answers.bench
    scene = answers.reduce(bench.experiment.scene)
    q, q_goal = bench.pair.live.now.q, bench.experiment.task.goal.q
    own, goal = (np.asarray(scene.picture(each), dtype=float) for each in (q, q_goal))
    np.testing.assert_allclose(answers.ask(10, "difference"), 127 + (own - goal) / 2, atol=1.01)
    while not bench.idle:
        bench.step()
    end = answers.ask(len(bench.pair.live.instants) - 1, "difference")
    assert abs(end.astype(float) - 127).max() <= 1


@pytest.mark.parametrize(
    "value",
    [
        None,
        ["camera", 0],
        ["other", 0, "picture"],
        [["camera"], 0, "picture"],
        ["camera", -1, "picture"],
        ["camera", True, "picture"],
        ["camera", 0.5, "picture"],
        ["camera", 0, "marks"],
        ["camera", 0, {}],
    ],
)
def test_invalid_requests_are_ignored(answers, value):
    answers.pictures.request(answers.bench, value)
    answers.pictures.request(None, ["camera", 0, "picture"])
    assert answers.pictures._thread is None and not answers.pictures._waiting


def test_scenes_without_bodies_have_no_pictures():
    bare = Answers(rs.load_scenario(rs.examples.path("visp_tutorial")))
    bare.pictures.request(bare.bench, ["camera", 0, "picture"])
    assert bare.pictures._thread is None
    assert "pictures" not in bare.bench.recording().header["cameras"][0]


def test_large_pictures_are_reduced_until_a_message_holds_them():
    noisy = Answers(hang_poster(draw_noise((480, 640)), rs.vision.Optics(read_noise=60.0)))
    assert noisy.ask(0).shape == (180, 240)
    noisy.pictures.close()


def test_waiting_requests_are_few_and_the_latest(answers, monkeypatch):
    hold, begun = threading.Event(), threading.Event()
    draw = answers.pictures._draw

    def wait_and_draw(request):
        begun.set()
        hold.wait(20)
        return draw(request)

    monkeypatch.setattr(answers.pictures, "_draw", wait_and_draw)
    answers.pictures.request(answers.bench, ["camera", 0, "picture"])
    assert begun.wait(20)
    for _ in range(MOST):
        answers.bench.step()
    for index in range(MOST + 8):
        answers.pictures.request(answers.bench, ["camera", index, "picture"])
    assert [each[1] for each in answers.pictures._waiting] == list(range(8, MOST + 8))
    hold.set()


def test_a_session_goes_on_while_a_picture_is_drawn(monkeypatch):
    session = Session(Workbench(hang_poster(draw_noise((6, 8)))), ScenarioShelf.shipped())
    told, hold = [], threading.Event()
    session.broadcast = told.append
    monkeypatch.setattr(session.pictures, "_draw", lambda request: hold.wait(20) and None)
    session.start()
    session.receive({"picture": ["camera", 0, "picture"]})
    session.receive({"step": 3})

    def read(kind):
        return [m for m in map(json.loads, list(told)) if m["type"] == kind]

    for _ in range(2000):
        if session.handled:
            break
        time.sleep(0.01)
    assert len(session.bench.pair.live.instants) == 4 and not read("picture")
    hold.set()
    for _ in range(2000):
        if read("picture"):
            break
        time.sleep(0.01)
    session.close()
    assert session.handled == 1  # a picture changes nothing
    assert not session.pictures._thread.is_alive()


def test_a_saved_page_has_pictures_since_the_last_change(answers):
    recording = answers.bench.recording()
    assert isinstance(recording, Recording)
    before = read_pictures(recording)
    scene, live = answers.reduce(answers.bench.experiment.scene), answers.bench.pair.live
    assert before["instants"] == list(range(11))
    np.testing.assert_array_equal(decode(before["images"][4]), scene.picture(live.instants[4].q))
    answers.bench.set("objects.square.position", [0.05, 0.0, 0.0])
    answers.bench.step()
    assert read_pictures(answers.bench.recording())["instants"] == [10, 11]
