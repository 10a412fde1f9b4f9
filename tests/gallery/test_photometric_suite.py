"""The suite of features of pictures: its pictures and starts, and which basin is larger."""

from itertools import pairwise

import numpy as np
import pytest

import robsim as rs
from robsim.suites.procedural_pictures import KINDS, draw_procedural_picture
from robsim.suites.published import photometric

SUITE = photometric.suite()


@pytest.mark.parametrize("kind", KINDS)
def test_procedural_pictures_have_the_contrast_of_all(kind):
    one, other = (draw_procedural_picture(kind, seed) for seed in (0, 1))
    assert one.shape == (288, 384)
    assert (one != other).mean() > 0.5
    for each in (one, other):
        assert abs(each.mean() - 127.5) < 3
        assert 35 < each.std() < 46


def test_starts_have_the_displacements_of_their_groups():
    distance, angle = SUITE.off_goal(SUITE.starts)
    size = np.array([float(each.split()[0]) for each in SUITE.groups["displacement"]]) / 100
    np.testing.assert_allclose(distance, size)
    np.testing.assert_allclose(angle, np.radians(80) * size, rtol=1e-6)
    assert (np.bincount(SUITE.draws) == 40).all()


def test_each_run_sees_its_poster_at_the_goal():
    goal = rs.Pose.at(0, 0, -photometric.DISTANCE)
    shown = []
    for k in (0, 1, 11):
        run = 40 * k
        wall = SUITE.scene.object("wall")
        moved = rs.Object(
            "wall",
            shapes=wall.shapes,
            marks=SUITE.varied["objects.wall.marks"][run],
            pose=rs.Pose.at(*SUITE.varied["objects.wall.position"][run]),
        )
        scene = SUITE.scene.replacing(moved)
        shown.append(scene.picture(goal.q))
        pixels = scene.view(goal.q).pixels
        np.testing.assert_allclose(pixels.mean(axis=0), [39.5, 29.5])
    assert all((a != b).mean() > 0.5 for a, b in pairwise(shown))


def take_runs(size, *names):
    """The suite with two starts of a size before each poster, and some schemes."""
    label = f"{size} cm"
    chosen = [i for i, each in enumerate(SUITE.groups["displacement"]) if each == label]
    runs = np.array(chosen).reshape(12, 8)[:, :2].ravel()
    return rs.studies.Suite(
        "some",
        1,
        *(getattr(SUITE, name) for name in ("title", "source", "criterion", "succeeds", "scene")),
        SUITE.goal,
        SUITE.starts[runs],
        gain=SUITE.gain,
        varied={name: values[runs] for name, values in SUITE.varied.items()},
        draws=SUITE.draws[runs],
        dt=SUITE.dt,
        duration=SUITE.duration,
        schemes={name: SUITE.schemes[name] for name in names},
    )


@pytest.mark.full
def test_blur_widens_the_basin_of_the_luminance():
    rows = rs.bench(take_runs(20, "luminance", "mixture", "defocus")).data
    share = rows.groupby("scheme")["success"].mean()
    assert share["mixture"] > share["luminance"] + 0.2
    assert share["defocus"] > share["luminance"] + 0.2


@pytest.mark.full
def test_all_features_arrive_from_near():
    rows = rs.bench(take_runs(5, *photometric.FEATURES)).data
    assert (rows.groupby("scheme")["success"].mean() > 0.8).all()
