"""Shadows of solids: their outlines, and cuts of many faces that intersect."""

import numpy as np
import pytest

import robsim as rs
from robsim.plot import face_order
from robsim.plot.face_order import FaceOrder
from robsim.plot.solid_shadows import ShadowOutlines
from robsim.plot.wireframe import WireSolid


def wire(shape, faces=slice(None)):
    corners, rounds = shape.skin
    return WireSolid(
        "solid", "#000000", np.empty((0, 2, 3)), [corners[list(f)] for f in rounds][faces]
    )


def area(outline):
    x, y = outline[:, :2].T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def test_a_block_has_the_shadow_of_its_upper_faces():
    solid = wire(rs.Block(1.0, 2.0, 3.0).at(rs.Pose.at(0.1, 0.2, 0.3, rpy=(0.4, -0.3, 0.8))))
    [outline] = ShadowOutlines([solid]).compute([solid])
    upward = sum(max(area(face), 0.0) for face in solid.faces)
    assert area(outline) == pytest.approx(upward, rel=1e-12)
    assert len(outline) == 6


def test_a_wheel_on_its_side_has_the_shadow_of_a_rectangle():
    solid = wire(rs.Wheel(0.5, 0.2, 32).at(rs.Pose.at(0, 0, 1, rpy=(np.pi / 2, 0, 0))))
    [outline] = ShadowOutlines([solid]).compute([solid])
    assert area(outline) == pytest.approx(1.0 * 0.2, rel=1e-9)


def test_the_faces_of_an_open_solid_have_one_shadow_each():
    opened, closed = wire(rs.Block(1, 1, 1), slice(4)), wire(rs.Block(1, 1, 1))
    outlines = ShadowOutlines([opened, closed]).compute([opened, closed])
    assert len(outlines) == 5
    np.testing.assert_array_equal(outlines[0], opened.faces[0])


def test_many_bars_through_each_other_are_cut_without_loss(monkeypatch):
    monkeypatch.setattr(face_order, "MOST_COVERING", 0)  # parts that a bar hides are not left out
    angles = np.linspace(0, np.pi, 14, endpoint=False)
    bars = [rs.Block(2.0, 0.1, 0.1).at(rs.Pose.at(0, 0, 0, rpy=(0.1, 0.2, a))) for a in angles]
    solids = [wire(bar).faces for bar in bars]
    viewer = np.array([0.3, 0.5, 0.8, 0.0])
    painted = FaceOrder(solids).arrange(viewer)
    faces = [face for solid in solids for face in solid]
    pieces = np.split(painted.corners, np.cumsum(painted.counts)[:-1])
    assert len(pieces) > 4 * len(faces)

    def seen(corners):
        spokes = corners[1:] - corners[0]
        return np.cross(spokes[:-1], spokes[1:]).sum(axis=0) @ viewer[:3] / 2

    found = np.zeros(len(faces))
    np.add.at(found, painted.sources, [seen(piece) for piece in pieces])
    np.testing.assert_allclose(found, np.maximum([seen(face) for face in faces], 0.0), atol=1e-12)
