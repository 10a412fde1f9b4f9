"""A servo by a network that was trained on rendered pictures: its numbers, and its runs."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import robsim as rs

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def parts(monkeypatch):
    """The modules of the example."""
    monkeypatch.syspath_prepend(EXAMPLES)
    from pose_network import evaluate, network, pose_feature, posters, views

    return SimpleNamespace(
        evaluate=evaluate, network=network, feature=pose_feature, posters=posters, views=views
    )


@pytest.fixture
def pictures(parts):
    """The picture at the goal and three pictures (3, 60, 80) beside it."""
    scene = parts.evaluate.make_scene(parts.posters.draw_poster("leaves", 0))
    starts = parts.views.draw_starts(np.random.default_rng(0), 3, 60, 0.10, 0.50)
    q = np.array([scene.coordinates(rs.Pose(T)) for T in starts])
    return scene.picture(), scene.picture(q), starts


def test_the_weights_are_small_and_give_the_pose_of_pytorch(parts):
    """`train.py` stores a pair of pictures with the pose of the network in PyTorch."""
    path = parts.network.WEIGHTS
    assert path.stat().st_size < 1_000_000
    network = parts.network.PoseNetwork()
    with np.load(path) as stored:
        goal, seen = (network.extract(each.astype(np.float32)) for each in stored["check_pictures"])
        expected = stored["check_pose"]
    everywhere = np.ones(parts.network.CELLS)
    found = network.compare(parts.network.RolledGoal(0.0, goal, everywhere, np.zeros(6)), seen)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert np.abs(expected).max() > 1e-3


def test_the_pose_of_a_homography_is_exact(parts):
    n, T = parts.network, parts.views.build_poses([[0.05, -0.03, -0.2]], [[0.1, -0.05, 0.2]])[0]
    p = T[:3, :3].T @ T[:3, 3]
    H = T[:3, :3].T - np.outer(p, [0, 0, 1])
    np.testing.assert_allclose(n.decode_homography(1.7 * H), [*p, 0.1, -0.05, 0.2], atol=1e-12)
    places = np.column_stack([n.PLACES, np.ones(n.CELLS)]) @ H.T
    fitted = n.fit_homography(places[:, :2] / places[:, 2:], np.ones(n.CELLS))
    np.testing.assert_allclose(n.decode_homography(fitted), [*p, 0.1, -0.05, 0.2], atol=1e-4)


def test_a_roll_precedes_a_rotation(parts):
    rotate = parts.views.rotate
    whole = rotate([[0, 0, 1.2]]) @ rotate([[0.1, -0.2, 0.3]])
    vector = parts.network.add_roll(np.array([0.1, -0.2, 0.3]), 1.2)
    np.testing.assert_allclose(rotate([vector]), whole, atol=1e-12)
    np.testing.assert_allclose(parts.network.add_roll(np.zeros(3), 0.3), [0, 0, 0.3], atol=1e-15)


def test_the_pose_is_zero_at_the_goal_and_points_to_it_from_afar(parts, pictures):
    goal, seen, starts = pictures
    network = parts.network.PoseNetwork()
    prepared = network.prepare_goal(goal)
    assert np.array_equal(network.measure_pose(prepared, goal), np.zeros(6))
    for picture, T in zip(seen, starts, strict=True):
        roll = np.arctan2(T[1, 0], T[0, 0])
        assert network.measure_pose(prepared, picture)[5] == pytest.approx(roll, abs=0.3)
    larger = np.kron(goal, np.ones((2, 2), dtype=np.uint8))  # of 160 x 120 pixels
    assert np.array_equal(network.measure_pose(prepared, larger), np.zeros(6))
    with pytest.raises(ValueError, match="expected multiples of 80 x 60"):
        network.measure_pose(prepared, goal[:50])


def test_a_controller_takes_the_pictures_of_a_real_camera(parts, pictures):
    goal, seen, starts = pictures
    scene = parts.evaluate.make_scene(parts.posters.draw_poster("leaves", 0))
    feature = parts.feature.LearnedPose()
    controller = rs.Controller(rs.Experiment(scene, rs.IBVS(features=feature, gain=2.0)))
    q = scene.coordinates(rs.Pose(starts[0]))
    command = controller.step(None, q, 0.0, images={"eye": seen[0]})
    pose = feature.network.measure_pose(feature.network.prepare_goal(goal), seen[0])
    np.testing.assert_allclose(command.velocities, -2.0 * pose, atol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize("kind", ["cells", "text"])
def test_runs_from_afar_reach_the_goal(parts, kind):
    """Cells are no kind of the training, and this text is not in it."""
    scene = parts.evaluate.make_scene(parts.posters.draw_poster(kind, 1))
    starts = rs.Pose(parts.views.draw_starts(np.random.default_rng(7), 2, 60, 0.10, 0.50))
    run = rs.simulate(scene, parts.feature.make_task(gain=8.0), starts, duration=3.0)
    assert parts.evaluate.succeed(run).all()


@pytest.mark.full
def test_a_run_has_the_same_bits_alone_and_in_a_batch(parts):
    scene = parts.evaluate.make_scene(parts.posters.draw_poster("leaves", 0))
    starts = rs.Pose(parts.views.draw_starts(np.random.default_rng(8), 3, 60, 0.10, 0.50))
    task = rs.IBVS(features=parts.feature.LearnedPose(), gain=8.0)
    run = rs.simulate(scene, task, starts, duration=0.4)
    alone = rs.simulate(scene, task, starts[1], duration=0.4)
    assert np.array_equal(alone.q_end.values, run.q_end.values[1])
