"""Recordings: the poses, images and curves of a run, in a page that is read back."""

import base64
import dataclasses
import gzip
import hashlib
import html
import json
import re
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim import page
from robsim.container import pack_container, unpack_container
from robsim.page.export import embed_page, export_html, load_recording
from robsim.page.html_document import MODULES
from robsim.page.recordings import build_recording

STATIC = Path(page.__file__).parent / "static"


def run_of(name, **changes):
    return rs.load_scenario(rs.examples.path(name)).run(**changes)


@pytest.fixture(scope="module")
def demo():
    return run_of("chapter_6_1", duration=2.0)


def poses(recording, frame, group="true"):
    """(T, 4, 4) of a frame."""
    number = recording.header["frames"].index({"name": frame, "group": group})
    numbers = recording.arrays["poses"][:, number].astype(float)
    turns = numbers[:, 3:] / np.linalg.norm(numbers[:, 3:], axis=1, keepdims=True)
    return rs.Pose.from_quaternion(numbers[:, :3], turns).matrix


def test_frames_are_where_the_scene_has_them(demo, tmp_path):
    scene = rs.Experiment.of(demo).scene
    back = load_recording(export_html(demo, tmp_path / "run.html"))
    for frame in ("camera", "cube", "rhino_xr4.tool"):
        true = scene.display.matrix @ scene.pose(frame, demo.q.values).matrix
        assert np.abs(poses(back, frame) - true).max() < 1e-4


def test_pictures_are_on_their_faces(tmp_path):
    grey = np.random.default_rng(0).integers(0, 256, (288, 192), dtype=np.uint8)
    label = np.array([[0, 255]], dtype=np.uint8)
    pictures = rs.shapes.BlockPictures(top=label, back=label)
    shapes = rs.shapes.Poster(grey, 0.6), rs.shapes.Block(0.4, 0.2, 0.1, pictures=pictures)
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    (square,) = experiment.scene.objects
    scene = dataclasses.replace(
        experiment.scene, objects=dataclasses.replace(square, shapes=shapes, marks=square.marks)
    )
    run = experiment.with_(scene=scene, duration=0.2).run()
    back = load_recording(export_html(run, tmp_path / "run.html"))
    poster, block = [part for part in back.header["parts"] if "pictures" in part]
    (wall,), (top, rear) = poster["pictures"], block["pictures"]
    means = grey.reshape(96, 3, 96, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(back.arrays[wall["greys"]], means, atol=0.51)
    np.testing.assert_allclose(wall["corners"][:6], [-0.3, -0.45, 0, 0.3, -0.45, 0])
    assert top["greys"] == rear["greys"] and (back.arrays[top["greys"]] == label).all()
    np.testing.assert_allclose(top["corners"][:6], [-0.2, 0.1, 0.05, 0.2, 0.1, 0.05])
    np.testing.assert_allclose(rear["corners"][:6], [-0.2, 0.1, 0.05, -0.2, -0.1, 0.05])
    assert int(poster["color"][1:3], 16) == pytest.approx(grey.mean(), abs=0.6)


def test_numbers_come_back_as_float32(demo, tmp_path):
    back = load_recording(export_html(demo, tmp_path / "run.html"))
    assert np.array_equal(back.arrays["camera.pixels"], demo.pixels.values.astype(np.float32))
    assert np.array_equal(back.arrays["time"], demo.time.values.astype(np.float32))
    error = back.arrays["curve error"]
    assert np.array_equal(error[:, 0], demo.error_norm.values.astype(np.float32))
    made = build_recording(demo)
    assert back.header == json.loads(json.dumps(made.header))


def test_an_exported_page_has_the_title_of_its_recording_as_text(tmp_path):
    title = "</title><script>{recording} & 'more'</script>"
    scene = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(title=title)
    text = export_html(scene, tmp_path / "page.html").read_text(encoding="utf-8")
    (written,) = re.findall("<title>(.*?)</title>", text)
    assert html.unescape(written) == title and "<" not in written


def test_the_same_run_gives_the_same_bytes(demo, tmp_path):
    first, second = (export_html(demo, tmp_path / name).read_bytes() for name in ("a", "b"))
    assert first == second and len(first) < 3_000_000


@pytest.mark.full
def test_ten_thousand_instants_of_an_arm_stay_below_three_megabytes(tmp_path):
    long = run_of("wrong_calibration", duration=400.0, hold=True)
    assert long.sizes["time"] == 10_001
    assert export_html(long, tmp_path / "run.html").stat().st_size < 3_000_000


def test_a_wrongly_believed_body_has_a_ghost_and_a_true_one_has_none():
    wrong = build_recording(run_of("wrong_dh", duration=0.4)).header
    groups = [wrong["frames"][part["frame"]]["group"] for part in wrong["parts"]]
    assert groups.count("belief") > 3 and "goal" in groups
    right = build_recording(run_of("visp_tutorial", duration=0.4)).header
    assert "belief" not in [frame["group"] for frame in right["frames"]]


def test_a_mission_is_shown_as_a_whole():
    mission = run_of("inspection_a")
    made = build_recording(mission)
    assert made.arrays["time"].size == mission.run.sizes["time"]
    told = [event["text"] for event in made.header["events"]]
    assert told == [*(leg.name for leg in mission.legs), "14 phases done after 37.6 s"]
    short = dataclasses.replace(mission, legs=mission.legs[:9])
    assert build_recording(short).header["events"][-1]["text"] == "9 of 14 phases done after 27.2 s"


def test_robots_scenes_and_experiments_stand_still():
    arm = rs.robots.puma560()
    for shown in (arm, rs.Scene(arm), rs.load_scenario(rs.examples.path("car"))):
        assert build_recording(shown).arrays["poses"].shape[0] == 1


def test_no_text_can_leave_its_place(tmp_path):
    bad = "</script><script>alert(1)</script><!-- \u2028 {policy}"
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(title=bad)
    page = export_html(experiment.run(duration=0.2), tmp_path / "run.html").read_text()
    assert page.count("</script>") == 2 and "alert(1)</" not in page
    assert load_recording(tmp_path / "run.html").header["title"] == bad
    assert embed_page(page).count("<") == 2


@pytest.mark.parametrize("shown", [None, 3, "run.nc", np.zeros(3)])
def test_a_run_that_cannot_be_shown_is_reported(shown, tmp_path):
    with pytest.raises(rs.errors.InputError, match=r"expected a run, .*, a robot or a study, got"):
        export_html(shown, tmp_path / "run.html")


def test_several_runs_are_refused_as_several(tmp_path):
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    several = experiment.vary({"task.gain": [1.0, 2.0]}).run(duration=0.2)
    with pytest.raises(rs.errors.InputError, match="pick one"):
        export_html(several, tmp_path / "run.html")


def test_damaged_pages_are_refused(demo, tmp_path):
    path = export_html(demo, tmp_path / "run.html")
    whole, rng = path.read_text(), np.random.default_rng(3)
    start = whole.index('id="recording"')
    for at in rng.integers(start, whole.index("</script>", start), 20):
        path.write_text(f"{whole[:at]}!!{whole[at + 1 :]}")
        with pytest.raises(rs.errors.FileError, match=r"run\.html"):
            load_recording(path)


@pytest.mark.parametrize(
    "change",
    [{"kind": "O"}, {"kind": "u2"}, {"shape": [99999999, 11]}, {"shape": [-1]}, {"name": []}],
)
def test_forged_recordings_are_refused_whatever_their_checksum(demo, tmp_path, change):
    path = export_html(demo, tmp_path / "run.html")
    whole = path.read_text()
    text = re.search(r'id="recording">(.*?)<', whole)[1]
    header, arrays = unpack_container(BytesIO(gzip.decompress(base64.b64decode(text))))
    header["arrays"][0].update(change)
    forged = base64.b64encode(gzip.compress(pack_container(header, arrays).getvalue())).decode()
    path.write_text(whole.replace(text, forged))
    with pytest.raises(rs.errors.FileError, match=r"run\.html: not a page of RobSim"):
        load_recording(path)


def test_the_libraries_are_those_that_are_listed():
    listed = json.loads((STATIC / "vendor.json").read_text())
    for name, digest in listed["sha256"].items():
        assert hashlib.sha256((STATIC / name).read_bytes()).hexdigest() == digest
    assert {each["license"] for each in listed["packages"].values()} == {"MIT"}


def test_modules_share_one_scope_without_two_equal_names():
    names = []
    for module in MODULES:
        text = (STATIC / f"{module}.js").read_text()
        found = r"^(?:export )?(?:async )?(?:function|class|const|let) (\w+)"
        names += re.findall(found, text, re.MULTILINE)
    assert len(names) > 20 and len(set(names)) == len(names)
