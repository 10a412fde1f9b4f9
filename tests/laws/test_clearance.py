"""Clearance: closed forms, and never more than the distance between any two points."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim import Block, CameraBody, Object, Pose, Wheel
from robsim.errors import InputError
from robsim.geometry.primitives import Primitive
from robsim.shapes import Ball, Capsule, Mesh, TaperedCylinder

steady = settings(derandomize=True, max_examples=25, deadline=None)
seeds = st.integers(0, 2**32)
CUBE, EYE = Block(1, 1, 1), CameraBody(0.4, 0.2, 0.2)
ON_EDGE, ON_CORNER = np.pi / 4, np.arctan(np.sqrt(0.5))
HALF = {"diagonal of a face": np.sqrt(0.5), "diagonal of a cube": np.sqrt(0.75)}
CORNER_FIRST = Pose.at(2, 0, 0, rpy=(0, ON_CORNER, 0)) @ Pose.at(rpy=(0, 0, -ON_EDGE))


def gap(first, second, pose, at=None):
    """Between two shapes, the second at a pose; both moved by another."""
    at = Pose.at() if at is None else at
    scene = rs.Scene(objects=[Object("a", first, pose=at), Object("b", second, pose=at @ pose)])
    found = rs.kinematics.clearance(scene, [], "a", "b")
    assert rs.kinematics.clearance(scene, [], "b", "a") == pytest.approx(found, abs=1e-12)
    return float(found)


def turned(rng, far):
    return Pose.at(*rng.uniform(-far, far, 3), rotvec=rng.normal(size=3))


@pytest.mark.parametrize(
    ("first", "second", "pose", "expected"),
    [
        (CUBE, CUBE, Pose.at(3, 0.2, -0.3), 2.0),  # face to face
        (CUBE, CUBE, Pose.at(1, 0.2, -0.3), 0.0),  # touching
        (CUBE, CUBE, Pose.at(0.75, 0.1, 0), -0.25),  # overlapping
        (CUBE, CUBE, Pose.at(2, 0, 0, rpy=(0, 0, ON_EDGE)), 1.5 - HALF["diagonal of a face"]),
        (CUBE, CUBE, CORNER_FIRST, 1.5 - HALF["diagonal of a cube"]),
        (CUBE, CUBE, Pose.at(3, 3, 3), 2 * np.sqrt(3)),  # corner to corner, on the line of centres
        (  # two edges that cross
            Block(1, 1, 4).at(Pose.at(rpy=(0, 0, ON_EDGE))),
            Block(1, 4, 1).at(Pose.at(rpy=(0, ON_EDGE, 0))),
            Pose.at(2, 0.3, -0.2),
            2 - 2 * HALF["diagonal of a face"],
        ),
        (Wheel(0.5, 0.2), CUBE, Pose.at(0, 0, 1), 0.4),  # disc to face
        (Wheel(0.5, 0.2), Wheel(0.3, 0.2), Pose.at(0, 0.7, 0.9), 0.7),  # two parallel discs
        (Wheel(0.5, 0.2, n=9).at(Pose.at(rpy=(0, 0, np.pi / 9))), CUBE, Pose.at(1.5, 0, 0), 0.5),
        (Wheel(0.5, 0.2, n=9), CUBE, Pose.at(1.5, 0, 0), 1 - 0.5 / np.cos(np.pi / 9)),  # its corner
        (EYE, CUBE, Pose.at(0, 0, 1.0), 0.1),  # opening to face
        (EYE, CUBE, Pose.at(0, 0, -1.0), 0.5),  # back to face
        (EYE, CUBE, Pose.at(1, 0, 0.6), 0.35),  # its rim, 1.5 times as wide
        (Ball(0.3), CUBE, Pose.at(1.2, 0.4, -0.3), 0.4),  # to a face
        (Ball(0.3), CUBE, Pose.at(2, 2, 2), 1.5 * np.sqrt(3) - 0.3),  # to a corner
        (Ball(0.3), CUBE, Pose.at(0.6, 0.1, 0), -0.2),
        (Ball(0.3).at(Pose.at(0, 0, 0.5)), Ball(0.2), Pose.at(1, 2, 2.5), 2.5),
        (Ball(0.3), Ball(0.2), Pose.at(0, 0, 0), -0.5),
        (Capsule(0.1, 1), CUBE, Pose.at(1, 0.2, 0.9), 0.4),  # its side to a face
        (Capsule(0.1, 1), CUBE, Pose.at(0.2, 0, 2), 0.9),  # its end to a face
        (Capsule(0.1, 1), Ball(0.2), Pose.at(0.3, 0.4, 0.2), 0.2),  # its side
        (Capsule(0.1, 1), Ball(0.2), Pose.at(0, 3, 4.5), 4.7),  # its end
        (Capsule(0.1, 1), Capsule(0.2, 1), Pose.at(0.3, 0.4, 0.9), 0.2),  # side by side
        (Capsule(0.1, 1), Capsule(0.2, 3), Pose.at(0.3, 0.4, 5), np.sqrt(0.25 + 9) - 0.3),
        (Capsule(0.1, 1), Capsule(0.2, 1), Pose.at(0.4, 0.1, 0.2, rpy=(1, 0, 0)), 0.1),  # crossing
        (Capsule(0.1, 1), Capsule(0.2, 1), Pose.at(0, 1, 0, rpy=(np.pi / 2, 0, 0)), 0.2),  # a T
        (Capsule(0.1, 1), Capsule(0.2, 1), Pose.at(), -0.3),
        (TaperedCylinder(0.5, 0.2, 1), CUBE, Pose.at(0, 0, 2), 1.0),  # its upper end to a face
        (TaperedCylinder(0.5, 0.2, 1), CUBE, Pose.at(0.1, 0, -1.25), 0.25),
        (  # its slanted side, with a tangent plane of slope 3/10, to a face
            TaperedCylinder(0.5, 0.2, 1).at(Pose.at(rpy=(0, 0, np.pi / 32))),
            CUBE,
            Pose.at(0.35, 0, 0) @ Pose.at(rpy=(0, -np.arctan(0.3), 0)) @ Pose.at(1.5, 0, 0),
            1.0,
        ),
    ],
)
def test_closed_forms(first, second, pose, expected):
    for seed in range(3):
        at = turned(np.random.default_rng(seed), far=1.0)
        assert gap(first, second, pose, at) == pytest.approx(expected, abs=1e-12)


def onto(shape, points):
    """The nearest points of a block, a true cylinder, capsule or tapered cylinder, in its axes."""
    if isinstance(shape, Block):
        half = np.array([shape.length, shape.width, shape.height]) / 2
        return np.clip(points, -half, half)
    if isinstance(shape, Capsule):
        on = np.array([0, 0, np.clip(points[2], -shape.length / 2, shape.length / 2)])
        away = points - on
        return on + away * min(1.0, shape.radius / np.linalg.norm(away))
    if isinstance(shape, TaperedCylinder):
        return onto_taper(shape, points)
    inward = min(1.0, shape.radius / np.hypot(*points[:2]))
    z = np.clip(points[2], -shape.width / 2, shape.width / 2)
    return np.array([*(points[:2] * inward), z])


def onto_taper(shape, point):
    """Of the trapezium that is half of its section: the point, or the nearest of three sides."""
    h, r, R = shape.length / 2, shape.radius, shape.end_radius
    p = np.array([np.hypot(*point[:2]), point[2]])
    corners = np.array([[0, -h], [r, -h], [R, h], [0, h]])
    if abs(p[1]) <= h and p[0] <= r + (R - r) * (p[1] / (2 * h) + 0.5):
        return point
    found = []
    for a, b in pairwise(corners):
        t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        found.append(a + t * (b - a))
    rho, z = min(found, key=lambda each: np.linalg.norm(each - p))
    return np.array([*(point[:2] / (p[0] or 1.0) * rho), z])


def alternating(first, second, pose):
    """Distance of two convex shapes: from one to the nearest point of the other, and back."""
    p = pose.position
    for _ in range(400):
        p = onto(first, p)
        q = pose @ onto(second, pose.inv() @ p)
        p, distance = q, np.linalg.norm(q - p)
    return distance


@steady
@given(seeds)
def test_it_is_never_more_than_the_distance_and_not_much_less(seed):
    """The distance comes from alternating projections, from above."""
    rng = np.random.default_rng(seed)
    block = Block(*rng.uniform(0.1, 1, 3))
    other = [
        lambda: Block(*rng.uniform(0.1, 1, 3)),
        lambda: Wheel(*rng.uniform(0.1, 0.5, 2)),
        lambda: Capsule(*rng.uniform(0.1, 0.5, 2)),
        lambda: TaperedCylinder(*rng.uniform(0.1, 0.5, 3)),
    ][seed % 4]()
    pose = turned(rng, far=1.2)
    distance, found = alternating(block, other, pose), gap(block, other, pose)
    assert found <= distance + 1e-12
    if distance > 0.05:
        assert found > 0.7 * distance


@steady
@given(seeds)
def test_between_capsules_and_balls_it_is_the_distance(seed):
    rng = np.random.default_rng(seed)
    one, other = Capsule(*rng.uniform(0.01, 0.5, 2)), Capsule(*rng.uniform(0.01, 0.5, 2))
    pose = turned(rng, far=1.0)
    distance = alternating(one, other, pose)
    if distance > 0.01:
        assert gap(one, other, pose) == pytest.approx(distance, rel=1e-6)


def inside(shape, rng):
    return rng.dirichlet(np.full(len(shape.vertices), 0.2), 200) @ shape.vertices


@steady
@given(seeds)
def test_no_two_points_are_nearer(seed):
    rng = np.random.default_rng(seed)
    pose = turned(rng, far=0.4)
    taper = TaperedCylinder(0.1, 0.2, 0.2, n=5)
    for other in (Block(0.3, 0.2, 0.1), Wheel(0.15, 0.1, n=7), taper, Capsule(0.1, 0.2, n=8), EYE):
        found = gap(EYE, other, pose)
        a, b = (
            rng.dirichlet(np.full(len(s.vertices), 0.2), 200) @ s.vertices for s in (EYE, other)
        )
        away = np.linalg.norm((pose @ b)[:, None] - a, axis=-1)
        assert found <= away.min()


@pytest.mark.full
@pytest.mark.parametrize("seeds", [range(6), range(6, 25)], ids=str)
def test_overlapping_shapes_are_parted_by_their_depth(seeds):
    """A point common to both is found, and there is an axis along which the depth parts them."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        a, b = Block(*rng.uniform(0.2, 1, 3)), Block(*rng.uniform(0.2, 1, 3))
        pose = turned(rng, far=0.3)
        depth = -gap(a, b, pose)
        if depth <= 1e-3:
            continue
        assert alternating(a, b, pose) < 1e-3
        ways = rng.normal(size=(100, 3))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        for way in ways:  # a shorter way than the depth parts them in no direction
            assert gap(a, b, Pose.at(*(0.99 * depth * way)) @ pose) < 0


def test_a_shape_of_ones_own_has_no_hull():
    with pytest.raises(InputError, match="no hull of a Primitive"):
        _ = Primitive().hull
    with pytest.raises(InputError, match="no hull of a Mesh"):
        _ = Mesh("elbow.stl").hull


# robots


def arm():
    return rs.Robot.from_dh(
        [[0, 0, 1, 0], [0, 0, 1, 0]],
        name="arm",
        shapes=[[], *[[Block(1, 0.1, 0.1).at(Pose.at(-0.5, 0, 0))]] * 2],
    )


def scene():
    post = Object("post", Wheel(0.1, 2, n=4).at(Pose.at(rpy=(0, 0, ON_EDGE))), pose=Pose.at(2.5))
    eye = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], body=CameraBody(0.1, 0.1, 0.1))
    # the camera looks up: its opening is 15 cm wide, its back at the origin of the tool
    return rs.Scene(
        [arm()], [post, Object("dot", marks=[[0, 0, 0]])], rs.MountedCamera("eye", eye, "arm.link2")
    )


def test_of_a_robot_its_nearest_link_counts():
    s = scene()
    assert rs.kinematics.clearance(s, [0, 0], "arm", "post") == pytest.approx(0.4, abs=1e-12)
    assert rs.kinematics.clearance(s, [0, 0], "arm.link1", "post") == pytest.approx(1.4, abs=1e-12)
    assert rs.kinematics.clearance(s, [0, 0], ["arm.link1", "eye"], "post") == pytest.approx(
        0.325, abs=1e-12
    )
    assert rs.kinematics.clearance(s, [0, 0], "arm.link1", "arm.link2") == pytest.approx(
        0, abs=1e-12
    )
    assert rs.kinematics.clearance(s, [np.pi / 2, 0], "arm", "post") == pytest.approx(
        2.35, abs=1e-12
    )


def test_a_batch_equals_its_rows():
    s, rng = scene(), np.random.default_rng(1)
    q = rng.uniform(-3, 3, (3, 200, 2))  # more than are looked at together
    whole = rs.kinematics.clearance(s, q, ["arm", "eye"], "post")
    assert whole.shape == (3, 200)
    alone = [rs.kinematics.clearance(s, row, ["arm", "eye"], "post") for row in q[1, ::20]]
    np.testing.assert_allclose(alone, whole[1, ::20], rtol=0, atol=1e-14)
    assert rs.kinematics.clearance(s, np.empty((0, 2)), "arm", "post").shape == (0,)


@pytest.mark.parametrize(
    ("one", "other", "told"),
    [
        ("arm", "pots", "did you mean 'post'"),
        ("arm.link3", "post", "no robot, link or object 'arm.link3'"),
        ("arm", "dot", "dot: no shapes"),
        ("arm", [], "an empty list: no shapes"),
        ("arm", ["post", "arm.link1"], "'arm.link1' is on both sides"),
        ("arm", 3, "expected the name"),
        ("arm", ["post", 3], "expected the name"),
    ],
)
def test_shapes_that_cannot_touch_are_refused(one, other, told):
    with pytest.raises(InputError, match=told):
        rs.kinematics.clearance(scene(), [0, 0], one, other)
