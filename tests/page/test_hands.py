"""A person at the studio: each gesture is checked by the poses of the page and by the saved files.

The same gestures are made in Chromium and in Firefox.
"""

from contextlib import ExitStack

import numpy as np
import pytest
from page.desk import open_desk
from page.drivers import ChromiumDriver
from page.hands import Hands, measure_offset

import robsim as rs
from robsim.page import load_recording
from robsim.studio.studio import studio

pytestmark = pytest.mark.browser

# handle that is dragged, camera and target
TARGETS = {
    "eye_in_hand": ("objects.plate", "camera", "plate"),
    "chapter_6_1": ("objects.cube", "camera", "cube"),
    "eye_to_hand": ("cameras.camera", "camera", "plate"),
    "mobile_arm": ("objects.plate", "camera", "plate"),
}
GESTURES = {"pull": (22, 8), "push": (-18, -6), "turn": (25, 0)}
WHY = "document.getElementById('why').innerText"
RETURN = 5.0  # seconds of simulated time
CHANGES = {  # changes in mid-run: path, value of the page
    "scheme": ("task.kind", "pbvs"),
    "features": ("task.features", "pixels"),
    "interaction": ("task.interaction", "desired"),
    "belief": ("belief.cameras.camera.focal", [540, 460]),
    "noise": ("sensing.noise", 0.5),
}


@pytest.fixture
def sit_down(chromium):
    """Open the studio of a shipped experiment in Chromium; return the hands."""
    with ExitStack() as stack:

        def sit(name):
            experiment = rs.load_scenario(rs.examples.path(name))
            desk = stack.enter_context(open_desk(chromium, experiment))
            return Hands(ChromiumDriver(desk.page()))

        yield sit


def make_gesture(hands, name, gesture):
    """Drag or turn the target of an experiment; return its displacement in mm and degrees."""
    handle = TARGETS[name][0]
    frame = handle.rpartition(".")[2]
    before = hands.pose(frame)
    (hands.turn if gesture == "turn" else hands.pull)(handle, *GESTURES[gesture])
    return measure_offset(before, hands.pose(frame))


def check_return(hands, name, first):
    """Return whether the target has its first pose in the camera in time; if not, check the why."""
    since = hands.read("since")
    time, poses = hands.track(*TARGETS[name][1:])
    after = [i for i, t in enumerate(time) if since < t <= since + RETURN + 1e-6]
    offsets = [measure_offset(first, poses[i]) for i in after]
    returned = any(away < 1.0 and angle < 0.1 for away, angle in offsets)
    if not returned:  # the explanation arrives after the end
        hands.until(
            f"{WHY}.includes('Missed the goal') || robsim.state.note.includes('takes about')"
        )
    return returned


def make_gestures(hands, name, gestures):
    """Move the target by gestures; return {gesture: whether the first relative pose is back}."""
    hands.play_to_rest()
    first = hands.track(*TARGETS[name][1:])[1][-1]
    returned = {}
    for gesture in gestures:
        away, angle = make_gesture(hands, name, gesture)
        assert away > 10 or angle > 3, (gesture, away, angle)
        hands.play_to_rest()
        returned[gesture] = check_return(hands, name, first)
        if hands.read("missed"):
            hands.ask("{reset: true}")
            hands.ask("{undo: true}")
            hands.play_to_rest()
    return returned


@pytest.mark.parametrize("name", TARGETS)
def test_the_arm_follows_the_target(sit_down, name):
    gestures = GESTURES if name == "eye_in_hand" else ["pull"]
    returned = make_gestures(sit_down(name), name, gestures)
    assert returned["pull"] or name == "chapter_6_1", returned


def break_and_mend(hands):
    """Raise the gain until the loop breaks, and lower it again; a refused value has no effect."""
    hands.type_value("gain (1/s)", "200")
    hands.play_to_rest()
    assert hands.read("missed") and float(hands.field("gain (1/s)")) == 200
    hands.type_value("gain (1/s)", "0.8")
    assert hands.read("restarts") == 1 and "had ended" in hands.read("restarted_because")
    hands.type_value("gain (1/s)", "-3")
    assert float(hands.field("gain (1/s)")) == 0.8
    reasons = "[...document.querySelectorAll('#controls .reason')].map((p) => p.textContent).join()"
    assert "greater than 0" in hands.driver.evaluate(reasons)
    hands.play_to_rest()
    assert hands.read("outcome") == "CONVERGED"


def test_the_gain_breaks_the_loop_and_mends_it(sit_down):
    break_and_mend(sit_down("eye_in_hand"))


def test_firefox_answers_the_hand_too(firefox_driver):
    with studio(rs.load_scenario(rs.examples.path("eye_in_hand"))) as server:
        firefox_driver.open(server.address)
        hands = Hands(firefox_driver)
        assert make_gestures(hands, "eye_in_hand", GESTURES)["pull"]
        break_and_mend(hands)


def download(hands, folder):
    """Return the four files of the studio, stored in a folder."""
    page, files = hands.driver.page, {}
    for name in ("experiment.toml", "experiment.py", "run.nc", "run.html"):
        answer = page.request.get(f"{page.url.partition('?')[0].rstrip('/')}/download/{name}")
        assert answer.ok, answer.text()
        files[name] = folder / name
        files[name].write_bytes(answer.body())
    return files


def check_files(hands, folder):
    """Check that all files hold the run that the page shows since the last change; return it."""
    files = download(hands, folder)
    experiment = rs.load_scenario(files["experiment.toml"])
    run, found = experiment.run(), {}
    exec(files["experiment.py"].read_text().replace("rs.show(run)", ""), found)
    for other in (found["run"], rs.open_run(files["run.nc"])):
        assert np.array_equal(other["q"], run["q"], equal_nan=True)
    time, poses = hands.track("camera", "plate")
    saved = load_recording(files["run.html"]).arrays["time"]
    assert np.allclose(saved, time, atol=1e-4)
    end, since = float(run["end_time"]), hands.read("since")
    shown = poses[int(np.argmin(abs(time - since - end)))]
    scene, q = experiment.scene, run["q_end"].values
    there = scene.pose("camera", q).inv() @ scene.pose("plate", q)
    away, angle = measure_offset(shown, there)
    assert away < 0.01 and angle < 0.001, (away, angle)
    return experiment


def test_changes_in_mid_run_are_undone_redone_and_saved(sit_down, tmp_path):
    hands = sit_down("eye_in_hand")
    for path, value in CHANGES.values():
        hands.ask("{reset: true}")
        hands.ask("{step: 30}")
        hands.ask(f"{{set: ['{path}', {value!r}]}}")
        assert hands.read("changes.map((c) => c.path)").count(path) == 1
        hands.play_to_rest()
        changed = check_files(hands, tmp_path)
        hands.press_button("undo")
        assert hands.read("changes") == []
        hands.press_button("redo")
        assert hands.read("changes.map((c) => c.path)").count(path) == 1
        hands.press_button("undo")
        control = next(each for each in changed.controls() if each.path == path)
        assert control.value == value, path
