"""The torques of drives in recordings, on pages in a real browser, and live in a studio."""

import json

import numpy as np
import pytest
from page.desk import open_desk
from page.waiting import until

import robsim as rs
from robsim.page import load_recording
from robsim.page.export import export_html
from robsim.page.html_document import encode_recording_text
from robsim.studio.workbench import Workbench

LIMITS = [2, 9, 5, 23, 1.2, 2, 1.0]  # N m; some are below the torques of the motion


def make_case(**more):
    drive = rs.drives.VelocityLoop(bandwidth=60, gravity=False, torque_limit=LIMITS)
    case = rs.load_scenario(rs.examples.path("eye_in_hand"))
    return case.with_(actuation=rs.Actuation(drive=drive), duration=0.6, **more)


@pytest.fixture(scope="module")
def run():
    return make_case().run()


def test_a_recording_has_torques_and_their_limited_parts(run, tmp_path):
    recording = load_recording(export_html(run, tmp_path / "run.html"))
    curve = recording.header["curves"][-1]
    assert (curve["title"], curve["unit"], len(curve["names"])) == ("drive torques", "N m", 7)
    assert curve["colors"] == recording.header["curves"][-2]["colors"]
    torque, limited = (recording.arrays[curve[key]] for key in ("values", "limited"))
    np.testing.assert_allclose(torque, run.torque.values, rtol=1e-6)
    np.testing.assert_array_equal(limited, run.saturation.values > 0)
    assert limited.any(axis=0).sum() > 2 and not limited.all(axis=0).any()


def test_a_recording_without_a_drive_has_no_trace_of_torques(tmp_path):
    case = make_case().with_(actuation=rs.Actuation())
    recording = load_recording(export_html(case.run(), tmp_path / "run.html"))
    assert "torque" not in json.dumps(recording.header["curves"])
    assert not any("limited" in name for name in recording.arrays)


def test_a_mission_has_the_torques_of_all_phases(tmp_path):
    case = make_case()
    arm = rs.Scene(case.scene.robots)
    tasks = [rs.FollowJoints(by={"link4": angle}, duration=0.2) for angle in (0.05, -0.05)]
    mission = rs.Mission([rs.Phase(f"phase {i}", task) for i, task in enumerate(tasks)])
    drive = rs.Actuation(drive=rs.drives.VelocityLoop())
    done = rs.Experiment(arm, mission, dt=0.02, actuation=drive).run()
    joined = done.run
    np.testing.assert_array_equal(joined.torque_limit.values, [87] * 4 + [12] * 3)
    first = done.legs[0].run.torque.values
    np.testing.assert_array_equal(joined.torque.values[:5], first[:5])
    recording = load_recording(export_html(done, tmp_path / "mission.html"))
    assert recording.header["curves"][-1]["title"] == "drive torques"
    assert recording.arrays["curve drive torques"].shape == (joined.sizes["time"], 7)


def test_the_bench_continues_the_torques_of_a_run(run):
    bench = Workbench(make_case())
    for _ in range(8):
        bench.step()
    shown = bench.recording()
    np.testing.assert_array_equal(shown.arrays["curve drive torques"], run.torque.values[:9])
    limited = run.saturation.values[:9] > 0
    np.testing.assert_array_equal(shown.arrays["limited drive torques"], limited)
    assert encode_recording_text(shown.header, dict(shown.arrays), set())


def row(page, name):
    return page.locator("#controls .lil-controller", has=page.get_by_text(name, exact=True)).first


def unfold(page, *names):
    for name in names:
        page.locator("#controls .lil-title", has_text=name).first.click()


@pytest.mark.browser
def test_a_page_draws_torques_and_the_limited_parts_broadly(opened, run, tmp_path):
    page = opened(export_html(run, tmp_path / "run.html").as_uri())
    figure = page.locator("#charts figure").last
    caption = figure.inner_text().replace("\u00a0", " ")
    assert "drive torques (N m)" in caption and "broad: limited" in caption
    pixels = """() => {
      const { plot } = robsim.charts.at(-1);
      const [x, y] = [plot.valToPos(0.3, "x", true), plot.valToPos(-9, "y", true)];
      const { data } = plot.ctx.getImageData(x, y - 5, 1, 10);
      return [...Array(10).keys()].filter((i) => data[4 * i + 3] > 60).length;
    }"""
    broad = page.evaluate(pixels)
    limited = run.saturation.values[:, 1] > 0
    assert limited[np.searchsorted(run.time.values, 0.3)] and broad >= 6


@pytest.mark.browser
def test_a_drive_and_a_load_are_chosen_and_changed_in_the_studio(chromium):
    case = make_case().with_(actuation=rs.Actuation())
    with open_desk(chromium, case) as desk:
        page = desk.page()
        listed = "robsim.listed.map((c) => c.path)"
        assert not page.evaluate(f"{listed}.some((path) => path.endsWith('inertia.mass'))")
        unfold(page, "actuation")
        row(page, "drive").locator("select").select_option("velocity_loop")
        until(page, f"{listed}.includes('actuation.drive.bandwidth')")
        until(page, "robsim.view.header.curves.at(-1).title === 'drive torques'")
        assert page.evaluate(f"{listed}.includes('robots.panda.links.link4.inertia.mass')")
        unfold(page, "payloads")
        row(page, "add").locator("select").select_option("panda.flange")
        until(page, f"{listed}.includes('actuation.payloads.0.mass')")
        unfold(page, "panda.flange")
        mass = row(page, "mass (kg)").locator("input")
        mass.fill("2.5")
        mass.press("Enter")
        value = "robsim.listed.find((c) => c.path === 'actuation.payloads.0.mass').value"
        until(page, f"{value} === 2.5")
        loads = desk.app.bench.experiment.actuation.payloads
        assert loads == (rs.drives.Payload("panda.flange", 2.5),)
        page.locator("#speed").select_option("0")
        page.locator("#play").click()
        until(page, "robsim.view.arrays['curve drive torques'].shape[0] > 10")
        page.locator("#play").click()


@pytest.mark.browser
def test_a_drive_of_a_flying_camera_is_refused_with_its_reason(desk):
    page = desk.page()
    unfold(page, "actuation")
    row(page, "drive").locator("select").select_option("velocity_loop")
    until(page, "document.body.innerText.includes('there is nothing to drive')")
    assert desk.app.bench.experiment.actuation.drive is None
