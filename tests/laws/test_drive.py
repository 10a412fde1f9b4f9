"""A controller that is driven as a robot drives it: names, gaps, late images, an odd clock."""

import tracemalloc

import numpy as np
import pandas
import pytest

import robsim as rs
from robsim import examples

DT = 0.04


@pytest.fixture(scope="module")
def one():
    return rs.load_scenario(examples.path("visp_tutorial"))


@pytest.fixture(scope="module")
def run(one):
    return one.run(duration=2.0)


@pytest.fixture
def controller(one):
    return rs.Controller(one)


def at(run, t):
    return run.pixels.values[t], run.q.values[t]


def move_camera(scene, q, velocities):
    """The pose of a free camera after a period."""
    return scene.robots[0].integrate(q, velocities, DT)


FORMS = {
    "list": lambda p: p.tolist(),
    "float32": lambda p: np.asarray(p, np.float32),
    "numbers": lambda p: dict(enumerate(p)),
    "numbers backwards": lambda p: {i: p[i].tolist() for i in (3, 1, 0, 2)},
    "target": lambda p: {"square": p},
    "camera": lambda p: {"camera": p},
    "both": lambda p: {("camera", "square"): p},
    "camera and target": lambda p: {"camera": {"square": p}},
    "camera, target and numbers": lambda p: {"camera": {"square": dict(enumerate(p))}},
    "marks": lambda p: rs.control.Marks(p, 0.0),
    "marks by name": lambda p: rs.control.Marks({"square": p}, 0.0),
    "marks of a camera": lambda p: {"camera": rs.control.Marks({"square": p}, 0.0)},
}


@pytest.mark.parametrize("form", FORMS)
def test_marks_are_the_same_in_every_form(form, controller, run):
    pixels, q = at(run, 0)
    pixels = np.asarray(pixels, np.float32).astype(float)
    expected = controller.step(pixels, q, 0.0).velocities
    controller.reset()
    command = controller.step(FORMS[form](pixels), q, 0.0)
    np.testing.assert_array_equal(command.velocities, expected)
    assert command.health.unused == command.health.lost == ()


def test_marks_that_are_left_out_are_not_seen(controller, run):
    pixels, q = at(run, 0)
    controller.step(pixels, q, 0.0)
    gone = pixels.copy()
    gone[2] = np.nan
    expected = controller.step(gone, q, DT)
    for form in ({0: pixels[0], 1: pixels[1], 3: pixels[3]}, {"square": {2: (np.nan, 1.0)}}):
        controller.reset()
        controller.step(pixels, q, 0.0)
        found = controller.step(form, q, DT)
        if len(form) == 3:
            np.testing.assert_array_equal(found.velocities, expected.velocities)
            assert found.health.lost == ("square[2]",)
        else:
            assert found.health.lost == tuple(f"square[{i}]" for i in range(4))


def test_other_and_doubtful_targets_are_reported_and_not_used(controller, run):
    pixels, q = at(run, 0)
    first = controller.step({"square": pixels, "tag36h11:7": pixels + 9}, q, 0.0)
    assert first.health.unused == ("tag36h11:7",) and first.phase == "moving"
    wrong = rs.control.Marks({"square": pixels + 300}, DT, doubtful=["square"])
    second = controller.step(wrong, q, DT)
    np.testing.assert_array_equal(second.velocities, first.velocities)
    assert second.health.unused == ("doubtful square",) and len(second.health.lost) == 4


def test_marks_that_a_detector_calls_doubtful_are_not_used(controller, run):
    from robsim.vision.tags.detector import Detections

    pixels, q = at(run, 0)
    assert controller.step(Detections({}, {}), q, 0.0).phase == "waiting"
    doubted = Detections({"square": pixels}, {"square": "at the border of the image"})
    assert controller.step(doubted, q, DT).health.unused == ("doubtful square",)
    assert controller.step(Detections({"square": pixels}, {}), q, 2 * DT).phase == "moving"


def test_it_waits_until_every_mark_has_been_seen_once(controller, run):
    pixels, q = at(run, 0)
    command = controller.step(None, q, 0.0)
    assert command.phase == "waiting" and not command.velocities.any() and not command.error.size
    assert command.health.lost == tuple(f"square[{i}]" for i in range(4))
    assert controller.step({0: pixels[0], 1: pixels[1]}, q, DT).phase == "waiting"
    command = controller.step({2: pixels[2], 3: pixels[3]}, q, 2 * DT)
    assert command.phase == "moving" and command.health.lost == ("square[0]", "square[1]")


def test_an_image_that_is_older_than_the_last_is_not_used(controller, run):
    (new, q), (old, _) = at(run, 10), at(run, 0)
    first = controller.step(rs.control.Marks(new, 0.30), q, 0.30)
    second = controller.step(rs.control.Marks(old, 0.25), q, 0.34)
    np.testing.assert_array_equal(second.velocities, first.velocities)
    assert second.health.unused == ("late image of camera",)
    assert second.health.age == pytest.approx(0.04)
    third = controller.step(rs.control.Marks(new, 0.30), q, 0.38)  # once more the same
    assert third.health.unused == () and third.health.age == pytest.approx(0.08)


def test_depths_agree_with_the_time_of_the_image(one, run):
    """With the depths at its exposure, a late image gives the command of a new one."""
    measured = one.at("task.interaction", "current")
    controller, late = rs.Controller(measured), rs.Controller(measured)
    for t in range(6):
        pixels, q = at(run, t)
        new = controller.step(pixels, q, t * DT)
        image = rs.control.Marks(*at(run, t - 3)[:1], (t - 3) * DT) if t > 2 else None
        if t > 2:
            old = late.step(image, q, t * DT)
            (sight,) = late.sights
            depth = sight.project(run.q.values[t - 3, :, None]).depth[:, 0]
            np.testing.assert_array_equal(late._images.each[sight.key].depth, depth)
        else:
            late.step(pixels if t == 0 else None, q, t * DT)
    assert not np.array_equal(new.velocities, old.velocities)


def test_several_cameras_each_with_times_of_its_own():
    made = rs.load_scenario(examples.path("stereo_in_hand"))
    run, controller = made.run(duration=0.4), rs.Controller(made)
    left, right = controller.cameras
    N = len(run.mark) // 2
    both, q = run.pixels.values[0], run.q.values[0]
    first = controller.step({left: both[:N], right: rs.control.Marks(both[N:], -0.02)}, q, 0.0)
    np.testing.assert_array_equal(first.velocities, run.qd.values[0])
    assert first.health.age == pytest.approx(0.02)
    one = controller.step({left: both[:N]}, q, made.dt)
    assert one.health.age == pytest.approx(0.02 + made.dt) and not one.health.lost
    blind = both[N:].copy()
    blind[1] = np.nan
    lost = controller.step({right: blind}, q, 2 * made.dt).health.lost
    assert lost == (f"{right}: {controller.sights[1].target.name}[1]",)


def test_calls_may_come_early_late_or_not_at_all(one, run):
    """The time of a period determines its number; within a period the command stays."""
    exact, odd = rs.Controller(one), rs.Controller(one)
    rng = np.random.default_rng(5)
    for t in range(40):
        expected = exact.step(*at(run, t), t * DT)
        if rng.random() < 0.2 and t:
            continue
        found = odd.step(*at(run, t), 1.7e9 + (t + rng.uniform(-0.4, 0.4) * (t > 0)) * DT)
        np.testing.assert_array_equal(found.velocities, expected.velocities)
        again = odd.step(*at(run, t + 1), 1.7e9 + (t + 0.3) * DT)
        np.testing.assert_array_equal(again.velocities, expected.velocities)


def test_convergence_is_reported_when_the_run_ends(one):
    run, controller = one.run(), rs.Controller(one)
    last = int(np.isfinite(run.error_norm.values).sum()) - 1
    commands = [controller.step(*at(run, t), t * DT) for t in range(last + 1)]
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.CONVERGED
    assert [each.health.converged for each in commands] == [False] * last + [True]
    assert commands[-1].phase == "converged" and commands[0].phase == "moving"
    np.testing.assert_array_equal(commands[-1].error, run.error.values[last])


def test_marks_that_may_be_out_of_the_image_need_not_have_been_seen():
    """As a detector returns them, without hidden marks: it starts, and continues as the run."""
    made = rs.load_scenario(examples.path("marks_come_and_go")).with_(sensing=rs.Sensing())
    made = made.at("task.weighting", ["border"])
    run, controller = made.run(), rs.Controller(made)
    pixels = run.pixels.values
    inside = ((pixels >= -0.5) & (pixels < [639.5, 479.5])).all(axis=-1)
    for t in range(500):
        seen = {i: pixels[t, i] for i in np.flatnonzero(inside[t])}
        command = controller.step(seen, run.q.values[t], t * made.dt)
        np.testing.assert_allclose(command.velocities, run.qd.values[t], rtol=0, atol=1e-12)
        assert len(command.health.lost) == 15 - inside[t].sum()
    assert inside[0].sum() == 5 and inside[499].all()


def test_too_few_marks_hold_the_robot():
    made = rs.load_scenario(examples.path("marks_come_and_go")).at("task.weighting", ["border"])
    controller, view = rs.Controller(made), made.scene.view(made.start)
    seen = {i: view.pixels[i] for i in range(15) if view.visibility[i] == 0}
    assert controller.step(seen, made.start, 0.0).phase == "moving"
    one = dict(list(seen.items())[:1])
    command = controller.step(one, made.start, made.dt)
    assert command.phase == "holding" and not command.velocities.any()
    assert command.health.limits == ("too few marks",) and len(command.health.lost) == 14
    assert controller.step(seen, made.start, 2 * made.dt).phase == "moving"


ODD = [
    ("pixels", np.zeros((3, 2)), "pixels of"),
    ("pixels", "text", "pixels of"),
    ("pixels", {"no such": np.zeros((4, 2))}, "none of camera"),
    ("pixels", {9: (1, 2)}, "no mark 9"),
    ("pixels", {"camera": 3}, "pixels of"),
    ("pixels", 10**400, "pixels of"),
    ("q", np.zeros(3), "q"),
    ("q", np.full(7, np.nan), "q"),
    ("q", None, "q"),
    ("q", {"no robot": [1]}, "no robot"),
    ("t", -5.0, "clock goes backwards"),
    ("t", np.nan, "t"),
    ("t", "noon", "t"),
    ("t", None, "t"),
    ("run", "yes", "run"),
]


@pytest.mark.parametrize(("name", "value", "words"), ODD, ids=range(len(ODD)))
def test_nothing_is_raised_in_mid_run_and_the_robot_brakes(one, run, name, value, words):
    safe = one.with_(safety=rs.Safety(acceleration=0.5))
    controller = rs.Controller(safe)
    for t in range(10):
        before = controller.step(*at(run, t), t * DT)
    given = {"pixels": run.pixels.values[10], "q": run.q.values[10], "t": 10 * DT, "run": None}
    command = controller.step(**{**given, name: value})
    assert words in command.health.fault and command.phase == "holding"
    assert not command.health.converged
    size, last = np.abs(command.velocities).max(), np.abs(before.velocities).max()
    assert last - 0.5 * DT * (1 + 1e-9) <= size < last
    for t in (11, 12):  # after a clock that was wrong all begins anew
        after = controller.step(*at(run, t), t * DT)
    assert after.phase == "moving" and after.health.fault == ""


AT_THE_START = [each for each in ODD if each[2] != "clock goes backwards"]


@pytest.mark.parametrize(("name", "value", "words"), AT_THE_START, ids=range(len(AT_THE_START)))
def test_odd_input_at_the_start_is_an_error(one, run, name, value, words):
    given = {"pixels": run.pixels.values[0], "q": run.q.values[0], "t": 0.0, "run": None}
    with pytest.raises(rs.errors.InputError, match=words):
        rs.Controller(one).step(**{**given, name: value})


def test_marks_that_are_infinite_are_not_seen(controller, run):
    pixels, q = at(run, 0)
    controller.step(pixels, q, 0.0)
    pixels = pixels.copy()
    pixels[0, 1] = np.inf
    assert controller.step(pixels, q, DT).health.lost == ("square[0]",)


def test_arguments_may_be_used_again(controller, run):
    """No array of the caller's is kept or changed, and none of a command changes later."""
    pixels, q = (x.copy() for x in at(run, 0))
    command = controller.step(pixels, q, 0.0)
    kept = command.velocities.copy(), command.error.copy()
    np.testing.assert_array_equal(pixels, run.pixels.values[0])
    pixels[:], q[:] = 0.0, 0.0
    again = controller.step(None, run.q.values[0], DT)
    np.testing.assert_array_equal(again.velocities, kept[0])
    np.testing.assert_array_equal(command.velocities, kept[0])
    np.testing.assert_array_equal(command.error, kept[1])


@pytest.mark.full
def test_no_memory_is_taken_as_time_goes_on(controller, run):
    def some(first):
        for step in range(first, first + 1500):
            controller.step(*at(run, step % 40), step * DT)

    some(0)
    tracemalloc.start()
    some(1500)
    before = tracemalloc.get_traced_memory()[0]
    some(3000)
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert after - before < 4096


def test_rows_of_a_drive_are_a_run_that_is_explained(one):
    """A drive with two thirds of the gain, by another period and with rare images, is a
    log; a drive with the controller itself is the run."""
    run, controller = one.run(), rs.Controller(one)
    last = int(np.isfinite(run.error_norm.values).sum())
    rows = []
    for t in range(last):
        controller.step(*at(run, t), t * DT)
        rows.append(controller.row())
    again = rs.logs.read_log(pandas.DataFrame(rows), one)
    for name in ("q", "qd", "pixels", "error"):
        np.testing.assert_array_equal(again[name].values[:last], run[name].values[:last])
    assert rs.replay(again).identical(again)

    slow, rows = rs.Controller(one.at("task.gain", one.task.gain * 2 / 3)), []
    with pytest.raises(rs.errors.InputError, match="call step first"):
        slow.row()
    for t in range(last):
        slow.step(None if t % 2 else run.pixels.values[t], run.q.values[t], t * DT)
        rows.append(slow.row())
    assert np.isnan(rows[1]["pixels[0,row]"]) and not np.isnan(rows[2]["pixels[0,row]"])
    explanation = rs.explain(rs.logs.read_log(pandas.DataFrame(rows), one))
    assert "are 0.66667 +- 0.00024 times" in str(explanation)


def test_a_drive_with_holds_is_explained_as_its_own(one):
    """Moved by hand, and held by the watchdog while no image came: the log reports both."""
    safety = rs.Safety(watchdog=rs.control.Watchdog(0.1), hold_to_run=True, ramp=0.2)
    made = one.with_(safety=safety)
    controller, q, rows, held = rs.Controller(made), made.start.copy(), [], 0
    for t in range(100):
        image = None if 30 <= t < 45 else one.scene.view(q).pixels
        command = controller.step(image, q, t * DT, run=True)
        rows.append(controller.row())
        held += command.phase == "holding"
        q = (
            q + 0 * q
            if command.phase == "waiting"
            else move_camera(one.scene, q, command.velocities)
        )
    assert held > 10
    message = str(rs.explain(rs.logs.read_log(pandas.DataFrame(rows), made)))
    assert "are the commands of this controller" in message, message


def test_a_controller_of_a_file(one):
    path = examples.path("visp_tutorial")
    assert rs.Controller.from_file(path).experiment == one
    changed = rs.Controller.from_file(path, ["task.gain=2", "run.dt=20 ms"])
    assert (changed.dt, changed.experiment.task.gain) == (0.02, 2.0)
    with pytest.raises(rs.errors.FileError, match="no such file"):
        rs.Controller.from_file("nothing.toml")
