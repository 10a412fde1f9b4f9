"""Messages of a change: shapes are built and sent once, and each message is small."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from studio.page_model import PageModel

from robsim import examples, load_scenario
from robsim.page import body_shapes
from robsim.plot import palette, wireframe
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.studio import run_pair, scene_messages
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench

LARGEST = 65_536


class Desk:
    """A session with a page that has heard everything."""

    def __init__(self, name):
        experiment = load_scenario(examples.path(name)) if isinstance(name, str) else name
        self.bench = Workbench(experiment)
        self.session = Session(self.bench, ScenarioShelf([]))
        self.page = PageModel(self.news())

    def news(self):
        return list(self.session.outgoing.news(self.session, self.bench, self.session.shelf))

    def do(self, steps=1, **request):
        """Handle a request and steps; return the types of the messages."""
        assert not request or self.session.do(request) == ""
        for _ in range(steps):
            self.bench.step()
        return self.page.hear(self.news())

    def late_page(self):
        return PageModel(self.session.hello())


@pytest.fixture
def work(monkeypatch):
    """Counts of the calls that build shapes, and that simulate in advance."""
    counts = Counter()

    def count(module, name):
        call = getattr(module, name)

        def counted(*values):
            counts[name] += 1
            return call(*values)

        monkeypatch.setattr(module, name, counted)

    for name in ("build_shape_solid", "list_drawable_shapes"):
        count(wireframe, name)
    count(body_shapes, "_list_triangles")
    count(run_pair, "_simulate_ahead")
    return counts


def list_requests(desk):
    """A request for each kind of value that a hand changes, as far as the experiment has it."""
    controls = desk.bench.controls
    wanted = ("task.gain", "task.goal.q", "belief.cameras.camera.focal", "sensing.noise")
    for path, control in controls.items():
        if path in wanted or (path.startswith("objects.") and path.endswith(".position")):
            value = control.value
            value = [value[0] + 0.01, *value[1:]] if isinstance(value, list) else value + 0.02
            yield {"set": [path, value]}
    for handle in desk.bench.handles[:1]:
        yield {"drag": [handle.name, [handle.pose[0] + 0.004, *handle.pose[1:]]]}


@pytest.mark.parametrize("name", ["eye_in_hand", "wrong_dh", "chapter_6_1"])
def test_a_change_builds_no_shape_of_a_body_and_sends_what_changed(name, work):
    desk = Desk(name)
    desk.do(steps=5)
    desk.do(set=["task.gain", 0.9])
    work.clear()
    assert desk.do(set=["task.gain", 0.8]) == ["values", "rows", "state"]
    assert not work
    for request in list_requests(desk):
        kinds = set(desk.do(**request))
        allowed = {"controls", "values", "shapes", "entries", "rows", "state"}
        assert "rows" in kinds and kinds <= allowed
        assert work.pop("build_shape_solid", 0) <= 3  # bodies of the camera: true, believed, goal
        assert work.pop("_list_triangles", 0) <= 3 and not work
    assert max(desk.page.sizes) < LARGEST


@pytest.mark.full
@pytest.mark.parametrize("name", examples.names())
def test_messages_are_small_in_every_experiment(name):
    desk = Desk(name)
    desk.do(steps=3)
    for request in list_requests(desk):
        desk.session.do(request)
        desk.do(steps=2)
    assert max(desk.page.sizes) < LARGEST
    assert max(desk.late_page().sizes) < LARGEST
    if not isinstance(desk.bench.experiment.task, SelfSimulatingTask):
        assert "rows" in desk.page.kinds


def test_a_late_page_has_what_an_early_page_has(monkeypatch):
    monkeypatch.setattr(scene_messages, "TAIL", 3)
    desk = Desk("eye_in_hand")
    desk.do(steps=4)
    for request in [
        {"set": ["task.gain", 0.7]},
        {"set": ["belief.robots.panda.position", [0.02, 0.0, 0.0]]},
        {"set": ["task.gain", 0.6]},
        {"set": ["objects.plate.position", [0.5, 0.02, 0.0]]},
        {"set": ["belief.robots.panda.position", [0.0, 0.0, 0.0]]},
        {"second": ["task.interaction", "desired"]},
        {"set": ["task.gain", 0.5]},
        {"second": None},
    ]:
        desk.do(**request, steps=2)
        late, early = desk.late_page(), desk.page
        assert late.header == early.header
        assert late.shapes.keys() == early.shapes.keys()
        assert late.arrays.keys() == early.arrays.keys()
        for key, values in early.arrays.items():
            near = np.allclose(late.arrays[key], values, rtol=0, atol=1e-4, equal_nan=True)
            assert near, (request, key)


def test_a_believed_body_has_an_outline_from_the_change_on():
    desk = Desk("eye_in_hand")
    desk.do(steps=4)
    assert "belief" not in desk.page.groups()
    kinds = desk.do(set=["belief.objects.plate.position", [0.45, 0.1, 0.0]], steps=3)
    assert "recording" not in kinds and "belief" in desk.page.groups()
    x = desk.page.track("plate", "belief")[:, 0]
    assert len(x) == 8 and np.isnan(x[:4]).all() and np.isfinite(x[4:]).all()
    where = desk.bench.experiment.task.belief.pose("plate").position
    assert np.allclose(desk.page.track("plate", "belief")[-1], where, atol=1e-6)


def test_a_dragged_target_has_its_old_places_before_the_drag():
    desk = Desk("chapter_6_1")
    desk.do(steps=4)
    handle = next(each for each in desk.bench.handles if each.name == "objects.cube")
    before = np.array(handle.pose[:3])
    kinds = desk.do(drag=[handle.name, [handle.pose[0] + 0.01, *handle.pose[1:]]], steps=2)
    assert "shapes" not in kinds and "recording" not in kinds
    track = desk.page.track("cube")
    assert np.allclose(track[:4], before, atol=1e-6)
    assert np.allclose(track[4:], before + np.array([0.01, 0.0, 0.0]), atol=1e-6)


def test_a_restart_sends_rows_alone():
    desk = Desk("chapter_6_1")
    desk.do(steps=6)
    kinds = desk.do(reset=True, steps=0)
    assert "recording" not in kinds and "shapes" not in kinds and "rows" in kinds
    assert desk.page.arrays["time"].tolist() == [0.0]


def test_values_of_many_minutes_keep_as_many_shapes(monkeypatch):
    monkeypatch.setattr(scene_messages, "TAIL", 5)
    desk = Desk("wrong_calibration")
    path = "belief.cameras.camera.focal"
    counts = set()
    for focal in np.linspace(900.0, 1000.0, 16).tolist():
        desk.do(set=[path, [focal, focal]])
        shapes = desk.bench.builder.shapes
        counts.add((len(shapes.arrays), len(shapes._built), len(shapes._former)))
    log = desk.session.outgoing._scene.log
    assert len(counts) <= 2 and len(log.tail) <= 5 and len(log.shapes) == len(desk.page.shapes)


def test_the_second_scheme_has_a_path_of_its_own():
    desk = Desk("eye_in_hand")
    desk.do(second=["task.interaction", "desired"], steps=30)
    first, second = desk.page.header["trails"]
    frames = desk.page.header["frames"]
    assert frames[first["frame"]] == {"name": "camera", "group": "true"}
    assert frames[second["frame"]] == {"name": "camera", "group": "second"}
    assert second["color"] == palette.ORANGE != first["color"]
    other = desk.bench.pair.other
    q = np.array([each.q for each in other.instants])
    scene = other.experiment.scene
    there = (scene.display.matrix @ scene.pose("camera", q).matrix)[:, :3, 3]
    track = desk.page.track("camera", "second")
    assert len(track) == 31 and np.allclose(track, there, atol=1e-5)
    assert np.abs(track - desk.page.track("camera")).max() > 1e-3


def test_a_large_shape_is_sent_in_parts():
    points = np.random.default_rng(2).normal(size=(9001, 3)).astype(np.float32)
    page = PageModel()
    page.hear(
        scene_messages._encode_shapes({"large": points, "none": points[:0], "one": points[:1]})
    )
    assert max(page.sizes) < LARGEST and len(page.sizes) > 2
    assert np.array_equal(page.shapes["large"], points)
    assert page.shapes["none"].shape == (0, 3) and len(page.shapes["one"]) == 1


def test_a_mission_is_sent_in_small_messages():
    desk = Desk("inspection_b")
    assert max(desk.page.sizes) < LARGEST
    whole = desk.bench.recording()
    assert len(desk.page.arrays["time"]) == len(whole.arrays["time"])
    assert np.allclose(desk.page.arrays["poses"], whole.arrays["poses"], atol=1e-4)
    assert desk.page.header["parts"] == whole.header["parts"]
