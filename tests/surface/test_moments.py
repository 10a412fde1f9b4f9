"""Pictures side by side: true proportions, one scale, and near bodies cover far ones."""

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex

import robsim as rs
from robsim import plot
from robsim.plot import palette

matplotlib.use("agg")

ARM = rs.Robot.from_dh(
    [[0, 0, 1, 0]],
    name="arm",
    shapes=[[], [rs.Block(1, 0.2, 0.4, color="b").at(rs.Pose.at(-0.5, 0, 0))]],
)
POST = rs.Object("post", rs.Block(0.1, 0.3, 2, color="r"), pose=rs.Pose.at(0.5, -2, 0))
EYE = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], body=rs.CameraBody(0.2, 0.1, 0.1))
SCENE = rs.Scene(ARM, POST, rs.MountedCamera("eye", EYE, "arm.link1", rs.Pose.at(0, 0, 0.2)))


def faces(axes, color):
    """Corners of all faces of a colour, and how near they are drawn."""
    collections = [c for c in axes.collections if isinstance(c, PolyCollection)]
    lines = [c for c in axes.collections if isinstance(c, LineCollection)]
    pairs = zip(collections, lines, strict=True)
    mine = [
        c for c, line in pairs if to_hex(line.get_edgecolor()[0]) == palette.convert_color(color)
    ]
    corners = [path.vertices for c in mine for path in c.get_paths()]
    return np.concatenate(corners), [c.get_zorder() for c in mine]


def spans(points):
    return np.column_stack([points.min(axis=0), points.max(axis=0)]).ravel()


@pytest.mark.parametrize(
    ("view", "arm", "post"),
    [  # left, right, low, high; the arm lies along x or along y
        ("right", [(0, 1, -0.2, 0.2), (-0.1, 0.1, -0.2, 0.2)], (0.45, 0.55, -1, 1)),
        ("left", [(-1, 0, -0.2, 0.2), (-0.1, 0.1, -0.2, 0.2)], (-0.55, -0.45, -1, 1)),
        ("behind", [(-0.1, 0.1, -0.2, 0.2), (-1, 0, -0.2, 0.2)], (1.85, 2.15, -1, 1)),
        ("front", [(-0.1, 0.1, -0.2, 0.2), (0, 1, -0.2, 0.2)], (-2.15, -1.85, -1, 1)),
        ("above", [(0, 1, -0.1, 0.1), (-0.1, 0.1, 0, 1)], (0.45, 0.55, -2.15, -1.85)),
    ],
)
def test_it_shows_where_things_are(view, arm, post):
    figure = plot.moments(SCENE, [[0.0], [np.pi / 2]], views=[view], extent=(6, 5))
    for axes, expected in zip(figure.axes, arm, strict=True):
        np.testing.assert_allclose(spans(faces(axes, "b")[0]), np.array(expected), atol=1e-12)
        np.testing.assert_allclose(spans(faces(axes, "r")[0]), np.array(post), atol=1e-12)
        assert faces(axes, "k")[0].size  # the body of the camera


def test_a_near_body_is_drawn_last_and_a_far_one_is_not():
    (axes,) = plot.moments(SCENE, [[0.0]], extent=(6, 5)).axes
    assert min(faces(axes, "r")[1]) > max(faces(axes, "b")[1])
    (axes,) = plot.moments(SCENE, [[0.0]], views=["left"], extent=(6, 5)).axes
    assert max(faces(axes, "r")[1]) < min(faces(axes, "b")[1])
    (axes,) = plot.moments(SCENE, [[0.0]], extent=(3, 3)).axes  # the post is 2 m away
    with pytest.raises(ValueError, match="at least one array"):
        faces(axes, "r")


def test_all_pictures_have_one_scale_around_a_frame():
    figure = plot.moments(
        SCENE,
        [[0.0], [0.5], [1.0]],
        ["a", "b", "c"],
        around="arm.link1",
        extent=(3, 2),
        views=["right", "above"],
    )
    assert len(figure.axes) == 6
    assert [axes.get_title() for axes in figure.axes] == ["a", "b", "c", "", "", ""]
    names = [axes.get_ylabel() for axes in figure.axes[::3]]
    assert names == ["from the right", "from above"]
    for axes, q in zip(figure.axes[3:], (0.0, 0.5, 1.0), strict=True):
        assert axes.get_aspect() == 1.0
        middle = np.mean([axes.get_xlim(), axes.get_ylim()], axis=1)
        np.testing.assert_allclose(middle, [np.cos(q), np.sin(q)], atol=1e-12)
        np.testing.assert_allclose(np.diff([axes.get_xlim()])[0], 3)
    (bar,) = figure.axes[-1].lines
    assert np.ptp(bar.get_xdata()) == pytest.approx(1.0)
    assert [text.get_text() for text in figure.axes[-1].texts] == ["1 m"]


def test_it_shows_the_frame_of_the_figures():
    moved = rs.Scene(ARM, display=rs.Pose.at(0, 0, 3))
    (axes,) = plot.moments(moved, [[0.0]], around="arm.base", extent=(3, 3)).axes
    np.testing.assert_allclose(spans(faces(axes, "b")[0]), [0, 1, 2.8, 3.2], atol=1e-12)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"q": [0.0]}, r"expected shape \(n, 1\)"),
        ({"q": np.empty((0, 1))}, r"expected shape \(n, 1\)"),
        ({"views": ["below"]}, "no view 'below'"),
        ({"titles": ["a", "b"]}, "titles: expected 1, one for each configuration, got 2"),
        ({"around": "arm.link2"}, "did you mean 'arm.link1'"),
        ({"extent": (0, 1)}, r"extent: expected \(width, height\) in metres, got \(0, 1\)"),
        ({"extent": 1.0}, r"extent \(width, height\) in metres: expected shape"),
        ({"views": "right"}, r"views: expected a list, such as \['right'\]"),
        ({"views": []}, "views: expected a list"),
        ({"views": [["right"]]}, r"no view \['right'\]"),
        ({"titles": 5}, "titles: expected a list of texts, got 5"),
        ({"scene": ARM}, "expected a Scene"),
    ],
)
def test_a_picture_that_is_impossible_is_refused(settings, told):
    with pytest.raises(rs.errors.InputError, match=told):
        plot.moments(**{"scene": SCENE, "q": [[0.0]], **settings})
