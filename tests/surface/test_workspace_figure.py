"""The figure of a workspace shows each point at its place, in the colour of its manipulability."""

from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.collections import LineCollection, PathCollection

import robsim as rs
from robsim import plot, robots
from robsim.kinematics import sample_workspace

matplotlib.use("agg")


def dots(axes):
    (found,) = [each for each in axes.collections if isinstance(each, PathCollection)]
    return found


@pytest.fixture(scope="module")
def puma():
    return sample_workspace(robots.puma560(), 700, axes="all")


def test_both_views_show_all_points_the_best_on_top(puma):
    figure = plot.workspace(puma)
    side, top, bar = figure.axes
    order = np.argsort(puma.manipulability)
    for axes, seen in ((side, [0, 2]), (top, [0, 1])):
        np.testing.assert_array_equal(dots(axes).get_offsets(), puma.points[order][:, seen])
        np.testing.assert_array_equal(dots(axes).get_array(), puma.manipulability[order])
        assert dots(axes).get_clim() == (0, puma.manipulability.max())
        assert axes.get_aspect() == 1
    assert (side.get_xlabel(), side.get_ylabel()) == ("x (m)", "z (m)")
    assert (top.get_xlabel(), top.get_ylabel()) == ("x (m)", "y (m)")
    assert side.get_xlim() == top.get_xlim()
    assert bar.get_ylabel() == "manipulability of flange"
    assert figure.get_suptitle() == "puma560, 700 configurations"


def test_the_robot_stands_at_home_in_the_axes_of_its_base(puma):
    arm = puma.robot
    pairs = zip(arm.links, arm.frames(arm.home), strict=True)
    corners = np.concatenate([s.at(T).vertices for link, T in pairs for s in link.shapes])
    moved = replace(puma, robot=arm.at(rs.Pose.at(5, 6, 7)))
    for found in (puma, moved):
        side = plot.workspace(found).axes[0]
        lines = [each for each in side.collections if isinstance(each, LineCollection)]
        assert len(lines) == 2  # the white below the black
        ends = np.concatenate(lines[1].get_segments())
        np.testing.assert_allclose(ends.min(axis=0), corners.min(axis=0)[[0, 2]], atol=1e-12)
        np.testing.assert_allclose(ends.max(axis=0), corners.max(axis=0)[[0, 2]], atol=1e-12)


@pytest.mark.parametrize(
    ("place", "view"),
    [
        ({}, "from above"),
        ({"rpy": (np.pi / 2, 0, 0)}, "from the side"),
        ({"rpy": (0, np.pi / 2, 0)}, "from the front"),
    ],
)
def test_a_workspace_in_a_plane_is_seen_from_one_side(place, view):
    first, *others = robots.planar_2r().links[1:]
    joint = first.joint.with_constants(rs.Pose.at(0, 0, 0, **place), first.joint.tail)
    arm = rs.Robot("arm", [rs.joints.Link("base"), replace(first, joint=joint), *others])
    figure = plot.workspace(sample_workspace(arm, 50))
    assert [axes.get_title() for axes in figure.axes] == [view, ""]
    assert figure.axes[1].get_ylabel() == "linear manipulability of fore"


def test_a_line_and_a_point_can_be_seen_too():
    belt = plot.workspace(sample_workspace(robots.conveyor(), 20))
    assert dots(belt.axes[0]).get_offsets()[:, 0].max() > 1
    still = plot.workspace(sample_workspace(robots.turntable(), 20))  # the middle of the plate
    np.testing.assert_allclose(dots(still.axes[0]).get_offsets(), 0, atol=1e-12)
    for figure in (belt, still):
        figure.canvas.draw()


def test_only_a_workspace_is_drawn():
    with pytest.raises(rs.errors.InputError, match="expected a Workspace as workspace returns it"):
        plot.workspace(robots.puma560())
