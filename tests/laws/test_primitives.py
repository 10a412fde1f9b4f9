"""Blocks, wheels, camera bodies, ...: the chapter's frames, closed surfaces, rigid motion."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Ball, Block, CameraBody, Capsule, TaperedCylinder, Wheel

BLOCK = Block(0.3, 0.2, 0.1, color="r")
WHEEL = Wheel(0.1, 0.04, n=7, color="b")
BODY = CameraBody(0.08, 0.05, 0.03, color="g")
CAPSULES = [Capsule(0.1, 0.3, n=7), Capsule(0.2, 0.1, n=3), Capsule(0.1, 0.05)]
TAPERED = [TaperedCylinder(0.1, 0.05, 0.3, n=7, color="b"), TaperedCylinder(1.0, 2.0, 0.5, n=3)]
SOLIDS = [BLOCK, WHEEL, Wheel(2.0, 1.0, n=3), *TAPERED]
EACH = pytest.mark.parametrize("solid", [*SOLIDS, *CAPSULES, BODY], ids=repr)
CLOSED = pytest.mark.parametrize("solid", [*SOLIDS, *CAPSULES], ids=repr)
SOMEWHERE = Pose.at(0.3, -2.0, 1.0, rpy=(0.4, -1.0, 2.0))


def close(a, b, tolerance=1e-15):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def sides(solid):
    """How often each directed side (a, b) is run along by a face."""
    return Counter(s for f in solid.faces for s in zip(f, f[1:] + f[:1], strict=True))


def volume(solid, more_faces=()):
    """By the divergence theorem, over the triangles of every face: positive if faced outwards."""
    p, total = solid.vertices, 0.0
    for face in (*solid.faces, *more_faces):
        for b, c in pairwise(face[1:]):
            total += p[face[0]] @ np.cross(p[b], p[c]) / 6
    return total


# the chapter's frames and counts


def test_a_block_lies_along_x_y_z_by_length_width_height_around_its_centre():
    """Chapter, section 2.1: 8 vertices, 12 edges, 6 faces."""
    corners = {tuple(np.round(v, 12)) for v in BLOCK.vertices}
    assert corners == {(x, y, z) for x in (-0.15, 0.15) for y in (-0.1, 0.1) for z in (-0.05, 0.05)}
    assert (len(BLOCK.vertices), len(BLOCK.edges), len(BLOCK.faces)) == (8, 12, 6)


def test_the_edges_of_a_block_are_four_of_each_size():
    a, b = np.moveaxis(BLOCK.vertices[BLOCK.edges], 1, 0)
    lengths = np.sort(np.linalg.norm(a - b, axis=1))
    close(lengths, np.repeat([0.1, 0.2, 0.3], 4))
    assert ((np.abs(a - b) > 1e-12).sum(axis=1) == 1).all()  # each along one axis


@pytest.mark.parametrize("n", [3, 4, 7, 32])
def test_a_wheel_turns_about_z_and_counts_its_points_from_x(n):
    """Chapter, section 2.2: two circles of n points; drawn are the 2n sides of the circles."""
    wheel = Wheel(0.1, 0.04, n)
    assert (len(wheel.vertices), len(wheel.edges), len(wheel.faces)) == (2 * n, 2 * n, n + 2)
    angle = 2 * np.pi * np.arange(n) / n
    for circle, z in ((wheel.vertices[:n], -0.02), (wheel.vertices[n:], 0.02)):
        close(circle, np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.full(n, z)], axis=1))


def test_the_circles_of_a_wheel_are_drawn_and_nothing_between_them():
    start, end = np.moveaxis(WHEEL.vertices[WHEEL.edges], 1, 0)
    assert (start[:, 2] == end[:, 2]).all()
    close(np.linalg.norm(start - end, axis=1), np.full(14, 0.2 * np.sin(np.pi / 7)))


def test_a_wheel_has_32_points_by_default():
    assert len(Wheel(1, 1).vertices) == 64


def test_a_camera_body_stands_on_its_image_side_with_z_along_its_length():
    """Chapter, section 2.3: x along the height, y along the width, frame at the back face."""
    back, throat, front = BODY.vertices.reshape(3, 4, 3)
    for ring, scale, z in ((back, 1.0, 0.0), (throat, 1.0, 0.06), (front, 1.5, 0.08)):
        close(np.abs(ring), np.tile([scale * 0.015, scale * 0.025, z], (4, 1)))
        close(ring[:, :2].mean(axis=0), [0, 0])
    assert (len(BODY.vertices), len(BODY.edges), len(BODY.faces)) == (12, 20, 9)


# surfaces


@EACH
def test_faces_are_plane(solid):
    for face in solid.faces:
        corners = solid.vertices[list(face)]
        assert np.linalg.matrix_rank(corners - corners.mean(axis=0), tol=1e-12) == 2


@EACH
def test_edges_are_pairs_of_different_vertices_each_once_and_every_vertex_is_used(solid):
    edges = [tuple(e) for e in solid.edges.tolist()]
    assert all(a < b for a, b in edges)
    assert len(set(edges)) == len(edges)
    if not isinstance(solid, Capsule):  # circles between the ends of edges are not drawn
        assert set(np.ravel(edges).tolist()) == set(range(len(solid.vertices)))


@EACH
def test_every_edge_is_a_side_of_a_face(solid):
    assert {tuple(sorted(s)) for s in sides(solid)} >= {tuple(e) for e in solid.edges.tolist()}


@CLOSED
def test_a_closed_solid_has_each_side_twice_once_each_way(solid):
    around = sides(solid)
    assert set(around.values()) == {1}
    assert all((b, a) in around for a, b in around)
    vertices, faces = len(solid.vertices), len(solid.faces)
    assert vertices - len(around) // 2 + faces == 2  # Euler


@CLOSED
def test_a_closed_solid_lies_behind_each_of_its_faces(solid):
    for face in solid.faces:
        p = solid.vertices[list(face)]
        normal = np.cross(p[1] - p[0], p[2] - p[1])
        assert ((solid.vertices - p[0]) @ normal <= 1e-15).all()


def test_a_camera_body_is_open_at_the_front_and_nowhere_else():
    around = sides(BODY)
    rim = {s for s in around if s[::-1] not in around}
    assert set(around.values()) == {1}
    assert {tuple(sorted(s)) for s in rim} == {(8, 9), (9, 10), (10, 11), (8, 11)}
    close(BODY.vertices[8:, 2], np.full(4, 0.08))


def test_the_faces_of_a_camera_body_look_outwards():
    for face in BODY.faces:
        p = BODY.vertices[list(face)]
        normal, centre = np.cross(p[1] - p[0], p[2] - p[1]), p.mean(axis=0)
        axis = np.array([0, 0, max(centre[2], 0.01)])
        assert normal @ (centre - axis) > 0


def test_volumes_agree_with_a_box_a_prism_and_a_box_with_a_frustum():
    assert volume(BLOCK) == pytest.approx(0.3 * 0.2 * 0.1, rel=1e-13)
    prism = 7 / 2 * 0.1**2 * np.sin(2 * np.pi / 7) * 0.04
    assert volume(WHEEL) == pytest.approx(prism, rel=1e-13)
    back, front = 0.03 * 0.05, 1.5**2 * 0.03 * 0.05
    flare = 0.02 / 3 * (back + front + np.sqrt(back * front))
    assert volume(BODY, [(8, 9, 10, 11)]) == pytest.approx(0.06 * back + flare, rel=1e-13)


# round solids


@pytest.mark.parametrize("capsule", CAPSULES, ids=repr)
def test_the_vertices_of_a_capsule_are_a_radius_away_from_its_segment(capsule):
    x, y, z = capsule.vertices.T
    beyond = np.maximum(np.abs(z) - capsule.length / 2, 0)
    close(np.sqrt(x * x + y * y + beyond * beyond), np.full(len(z), capsule.radius))
    assert np.ptp(z) == pytest.approx(capsule.length + 2 * capsule.radius, rel=1e-15)


def test_a_tapered_cylinder_has_its_two_circles_at_its_two_ends():
    low, high = TAPERED[0].vertices.reshape(2, 7, 3)
    for ring, radius, z in ((low, 0.1, -0.15), (high, 0.05, 0.15)):
        close(np.hypot(*ring.T[:2]), np.full(7, radius))
        close(ring[:, 2], np.full(7, z))


def test_the_surfaces_of_round_solids_come_near_their_volumes():
    """A polygon of n corners lacks the share 2 pi^2 / (3 n^2) of its circle."""
    for make in (
        lambda n, **given: Capsule(0.1, 0.3, n, **given),
        lambda n, **given: TaperedCylinder(0.1, 0.05, 0.3, n, **given),
    ):
        whole = make(32, density=1.0).inertia.mass
        lacks = [1 - volume(make(n)) / whole for n in (64, 128)]
        assert 0 < lacks[1] < 1.4e-3
        assert lacks[0] / lacks[1] == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize("n", [3, 7, 32])
def test_the_skin_of_a_ball_is_round_and_closed(n):
    ball = Ball(0.2, n=n).at(SOMEWHERE)
    points, faces = ball.skin
    assert np.array_equal(points[: 3 * n], ball.vertices)
    close(np.linalg.norm(points - SOMEWHERE.position, axis=1), np.full(len(points), 0.2))
    around = Counter(s for f in faces for s in zip(f, f[1:] + f[:1], strict=True))
    assert set(around.values()) == {1} and all((b, a) in around for a, b in around)
    used = {corner for face in faces for corner in face}
    assert used == set(range(3 * n, len(points)))
    assert len(used) - len(around) // 2 + len(faces) == 2


@pytest.mark.parametrize(
    ("solid", "kinds"),
    [
        (Capsule(0.1, 0.3, density=2.0), [Wheel, Ball, Ball]),
        (TaperedCylinder(0.1, 0.05, 0.3, density=2.0), [Wheel] * 4),
    ],
)
def test_the_substitute_of_a_solid_in_files_has_its_size_and_place(solid, kinds):
    """Four cylinders have the volume of the taper; balls of a capsule lie half in its cylinder."""
    simpler = solid.at(SOMEWHERE).simpler()
    assert [type(each) for each in simpler] == kinds
    assert {each.color for each in simpler} == {solid.color}
    back = [each.at(SOMEWHERE.inv()) for each in simpler]
    heights = np.concatenate([each.vertices[:, 2] for each in back])
    whole = solid.vertices[:, 2]
    close([heights.min(), heights.max()], [whole.min(), whole.max()])
    if isinstance(solid, TaperedCylinder):
        masses = [replace(each, density=2.0).inertia.mass for each in back]
        assert sum(masses) == pytest.approx(solid.inertia.mass, rel=1e-14)


# motion


@EACH
def test_a_moved_copy_has_each_vertex_moved(solid):
    moved = solid.at(SOMEWHERE)
    close(moved.vertices, SOMEWHERE @ solid.vertices)
    assert moved.faces == solid.faces
    assert np.array_equal(moved.edges, solid.edges)
    assert type(moved) is type(solid)
    assert moved.color == solid.color


@EACH
def test_motion_is_rigid(solid):
    a, b = solid.vertices, solid.at(SOMEWHERE).vertices
    close(np.linalg.norm(b[:, None] - b, axis=-1), np.linalg.norm(a[:, None] - a, axis=-1), 1e-14)


@EACH
def test_moving_twice_is_moving_by_the_product(solid):
    there = Pose.at(1, 2, 3, rpy=(1, 0, -1))
    close(solid.at(SOMEWHERE).at(there).vertices, solid.at(there @ SOMEWHERE).vertices, 1e-14)
    close(solid.at(SOMEWHERE).at(SOMEWHERE.inv()).vertices, solid.vertices, 1e-14)


@EACH
def test_a_pose_times_a_solid_is_the_moved_copy(solid):
    assert SOMEWHERE @ solid == solid.at(SOMEWHERE)
    assert solid.at(SOMEWHERE.matrix) == solid.at(SOMEWHERE)


@EACH
def test_the_original_stays_where_it_was(solid):
    before = solid.vertices.copy()
    solid.at(SOMEWHERE)
    np.testing.assert_array_equal(solid.vertices, before)
    assert solid.pose == Pose.at()


def test_a_pose_may_be_given_at_once():
    placed = Block(1, 2, 3, pose=SOMEWHERE)
    assert placed == Block(1, 2, 3).at(SOMEWHERE)


def test_turning_a_wheel_by_one_division_gives_the_same_wheel():
    turned = WHEEL.at(Pose.at(rpy=(0, 0, 2 * np.pi / 7))).vertices
    close(turned.reshape(2, 7, 3), np.roll(WHEEL.vertices.reshape(2, 7, 3), -1, axis=1))


# refusals and values


@pytest.mark.parametrize("bad", [0, -0.1, np.nan, np.inf, "30 cm", None, [1, 2], [[1]]])
@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda bad: Block(bad, 1, 1), "Block.length"),
        (lambda bad: Block(1, bad, 1), "Block.width"),
        (lambda bad: Block(1, 1, bad), "Block.height"),
        (lambda bad: Capsule(bad, 1), "Capsule.radius"),
        (lambda bad: Capsule(1, bad), "Capsule.length"),
        (lambda bad: TaperedCylinder(bad, 1, 1), "TaperedCylinder.radius"),
        (lambda bad: TaperedCylinder(1, bad, 1), "TaperedCylinder.end_radius"),
        (lambda bad: TaperedCylinder(1, 1, bad), "TaperedCylinder.length"),
        (lambda bad: Wheel(bad, 1), "Wheel.radius"),
        (lambda bad: Wheel(1, bad), "Wheel.width"),
        (lambda bad: CameraBody(bad, 1, 1), "CameraBody.length"),
        (lambda bad: CameraBody(1, bad, 1), "CameraBody.width"),
        (lambda bad: CameraBody(1, 1, bad), "CameraBody.height"),
    ],
)
def test_a_size_is_a_positive_number(make, what, bad):
    with pytest.raises(InputError, match=what):
        make(bad)


@pytest.mark.parametrize("n", [2, 0, -3, 3.5, "8", None, True])
def test_a_wheel_has_at_least_three_points(n):
    with pytest.raises(
        InputError, match=r"Wheel\.n(: expected a number| must be a whole number from 3 to 4096)"
    ):
        Wheel(1, 1, n)


def test_a_batch_of_poses_moves_nothing():
    with pytest.raises(InputError, match="expected one pose, got a batch"):
        BLOCK.at(Pose.exp(np.zeros((2, 6))))


def test_a_solid_is_a_value():
    same = Block(0.3, 0.2, 0.1, "r")
    assert same == BLOCK
    assert hash(same) == hash(BLOCK)
    assert Block(0.3, 0.2, 0.1, "k") != BLOCK
    assert BLOCK.at(SOMEWHERE) != BLOCK
    with pytest.raises(AttributeError):
        BLOCK.length = 1.0
    with pytest.raises(ValueError, match="read-only"):
        BLOCK.vertices[0, 0] = 1.0
