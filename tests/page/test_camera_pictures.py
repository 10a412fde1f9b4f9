"""Rendered pictures in the recording of a run: their grey values, their number and their size."""

import dataclasses

import numpy as np
import pytest
from page.posters import decode, draw_noise, hang_poster, read_pictures

import robsim as rs
from robsim.page import camera_pictures
from robsim.page.export import export_html, load_recording
from robsim.page.recordings import build_recording
from robsim.plot.run_pictures import place_goal


@pytest.fixture(scope="module")
def run():
    return hang_poster(draw_noise((6, 8))).run()


def test_a_page_has_the_pictures_of_the_scene(run, tmp_path):
    pictures = read_pictures(load_recording(export_html(run, tmp_path / "run.html")))
    scene = rs.Experiment.of(run).scene
    eye = scene.camera()
    half = scene.replacing(dataclasses.replace(eye, camera=eye.camera.resized(320, 240)))
    assert pictures["size"] == [320, 240] and pictures["prints"]
    assert len(pictures["instants"]) == len(pictures["images"]) >= 24
    for instant, address in zip(pictures["instants"], pictures["images"], strict=True):
        np.testing.assert_array_equal(decode(address), half.picture(run.q.values[instant]))
    q_goal = rs.Experiment.of(run).task.goal.q
    goal = decode(pictures["goal"]).astype(float)
    np.testing.assert_allclose(goal, half.picture(q_goal), atol=1)
    first, last = (decode(pictures["images"][k]) - goal for k in (0, -1))
    assert abs(first).max() > 50 and abs(last).max() <= 1


def test_pictures_are_denser_while_the_image_moves(run):
    instants = np.array(read_pictures(build_recording(run, trials=False))["instants"])
    last = round(float(run.end_time) / 0.04)
    assert instants[0] == 0 and instants[-1] == last
    assert (np.diff(instants) > 0).all() and np.diff(instants).max() < last / 10
    assert (instants < last / 4).mean() > 0.4
    first, second = np.diff(instants)[:2]
    assert first < np.diff(instants).max() / 2 and second <= 3 * first


def test_a_run_of_one_instant_has_one_picture(run):
    pictures = read_pictures(build_recording(run.isel(time=[0]), trials=False))
    assert pictures["instants"] == [0] and len(pictures["images"]) == 1


@pytest.mark.full
def test_pictures_with_noise_give_equal_bytes_and_are_small(tmp_path):
    optics = rs.vision.Optics(full_well=5000, read_noise=3.0, exposure=0.02)
    smooth = np.kron(draw_noise((4, 4)), np.ones((30, 40), dtype=np.uint8))
    run = hang_poster(smooth, optics, duration=4.0).run()
    first, second = (export_html(run, tmp_path / name).read_bytes() for name in ("a", "b"))
    assert first == second
    pictures = read_pictures(load_recording(tmp_path / "a"))
    assert len(pictures["images"]) >= 24
    assert 100_000 < sum(map(len, pictures["images"])) < 500_000


def test_noise_of_a_reduced_picture_is_the_noise_of_its_mean():
    optics = rs.vision.Optics(full_well=2000, read_noise=4.0, defocus=2.0)
    grey = np.full((6, 8), 128, dtype=np.uint8)
    scene = hang_poster(grey, optics).scene
    q, eye = [0, 0, 1.0, 0, 0, 0, 1], scene.camera()
    reduced = camera_pictures.reduce_camera(eye)
    assert reduced.camera.size == (320, 240) and reduced.optics.defocus == 1.0
    whole = scene.picture(q, exact=False).astype(float)
    means = whole.reshape(240, 2, 320, 2).mean(axis=(1, 3))
    small = scene.replacing(reduced).picture(q)
    inside = slice(110, 130), slice(150, 170)
    assert small[inside].std() == pytest.approx(means[inside].std(), rel=0.15)
    assert camera_pictures.reduce_camera(reduced) is reduced


def test_cameras_without_anything_to_see_have_no_pictures():
    marks_only = rs.load_scenario(rs.examples.path("visp_tutorial")).run(duration=0.2)
    assert read_pictures(build_recording(marks_only)) is None
    behind = hang_poster(draw_noise(), duration=0.2)
    (square,) = behind.scene.objects
    wall = rs.Object("wall", shapes=square.shapes, pose=rs.Pose.at(0, 0, -5))
    bare = dataclasses.replace(square, shapes=(), marks=square.marks)
    scene = rs.Scene(behind.scene.robots, [bare, wall], behind.scene.cameras)
    task = dataclasses.replace(behind.task, target="square")
    there = behind.with_(scene=scene, task=task)
    assert read_pictures(build_recording(there.run())) is None
    for shown in (behind, behind.scene):
        assert all("pictures" not in each for each in build_recording(shown).header["cameras"])


def test_the_goal_shows_all_bodies_at_the_goal_before_the_run_is_there():
    experiment = rs.load_scenario(rs.examples.path("stereo_in_hand"))
    made = build_recording(experiment.run(duration=0.4), trials=False)
    for name in ("left", "right"):  # the run knows the goal pose of the left camera
        pictures = read_pictures(made, name)
        eye = camera_pictures.reduce_camera(experiment.scene.camera(name))
        expected = experiment.scene.replacing(eye).picture(camera=name).astype(float)  # at home
        goal, first = decode(pictures["goal"]), decode(pictures["images"][0])
        assert (abs(goal - expected) > 2).mean() < 1e-3 and np.ptp(expected) > 50
        assert (abs(goal - first.astype(float)) > 20).mean() > 0.02
        assert not pictures["prints"]


def test_a_run_of_a_batch_has_the_pictures_of_its_own_camera():
    focals = np.array([600.0, 900.0])
    batch = hang_poster(draw_noise((6, 8)), duration=0.2).vary({"cameras.camera.focal": focals})
    runs = batch.run()
    first, second = (
        [read_pictures(build_recording(runs.isel(run=i), experiment, trials=False)) for i in chosen]
        for chosen, experiment in (((0, [0], 0), batch), ((1, [1], 1), None))
    )
    for focal, several in zip(focals, (first, second), strict=True):
        scene = batch.scene.replacing(camera_pictures.reduce_camera(batch.scene.camera()))
        assert several[0] == several[1] == several[2]
        eye = scene.camera()
        K = eye.camera.K * [[focal / 800, 1, 1], [1, focal / 800, 1], [1, 1, 1]]
        own = dataclasses.replace(eye, camera=dataclasses.replace(eye.camera, K=K))
        expected = scene.replacing(own).picture(batch.start)
        difference = np.abs(decode(several[0]["images"][0]).astype(int) - expected)
        assert difference.max() <= 1


def test_a_goal_out_of_reach_shows_the_camera_alone():
    experiment = rs.load_scenario(rs.examples.path("stereo_in_hand"))
    scene, q = experiment.scene, experiment.scene.home
    far = {"left": scene.pose("left", q) @ rs.Pose.at(0, 0, -5)}
    placed, at = place_goal(far, scene, q, "left")
    np.testing.assert_allclose(placed.pose("left", at).matrix, far["left"].matrix, atol=1e-12)
    assert at is q
    with pytest.raises(rs.errors.InputError, match="a pose of camera 'left', not of 'right'"):
        place_goal(far, scene, q, "right")
    with pytest.raises(rs.errors.InputError, match="the goal of the run has no pose"):
        place_goal({}, scene, q, "left")


def test_a_goal_without_a_pose_has_no_picture():
    watching = rs.load_scenario(rs.examples.path("watching_head")).run(duration=1.0)
    assert read_pictures(build_recording(watching, trials=False))["goal"] is None
