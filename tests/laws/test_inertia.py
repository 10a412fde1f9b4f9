"""Inertia: of the primitives against tetrahedra and quadrature, sums, moved copies, refusals."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import robsim as rs
from robsim import Block, CameraBody, Pose, Wheel
from robsim.joints import Link
from robsim.shapes import Ball, Capsule, Inertia, Mesh, TaperedCylinder

SOMEWHERE = Pose.at(0.3, -2.0, 1.0, rpy=(0.4, -1.0, 2.0))
SOLIDS = (
    Block(0.3, 0.2, 0.1, mass=2.0),
    CameraBody(0.08, 0.05, 0.03, mass=0.5),
    Wheel(0.1, 0.04, mass=1.5),
    Ball(0.2, mass=3.0),
    Capsule(0.05, 0.2, mass=2.5),
    TaperedCylinder(0.1, 0.05, 0.3, mass=0.7),
)
EACH = pytest.mark.parametrize("solid", SOLIDS, ids=lambda s: type(s).__name__)


def close(a, b, tolerance=1e-14):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def same(a, b, tolerance=1e-13):
    """Two inertias, number by number."""
    for part in ("mass", "centre", "tensor"):
        close(getattr(a, part), getattr(b, part), tolerance)


def tetrahedra(vertices, faces):
    """Mass (of density 1), first and second moments about the origin, of a closed polyhedron.

    Each triangle of a face and the origin make a tetrahedron (0, a, b, c); the integral of x x'
    over it is det / 120 (s s' + a a' + b b' + c c') with s = a + b + c.
    """
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for face in faces:
        for i, j in pairwise(face[1:]):
            corners = vertices[[face[0], i, j]]
            volume, s = np.linalg.det(corners) / 6, corners.sum(axis=0)
            mass += volume
            first += volume * s / 4
            second += volume / 20 * (np.outer(s, s) + corners.T @ corners)
    return mass, first, second


def about_centre(mass, first, second):
    centre = first / mass
    spread = second - mass * np.outer(centre, centre)
    return Inertia(mass, centre, np.trace(spread) * np.eye(3) - spread)


FRONT = ((8, 9, 10, 11),)  # what closes a camera body


@pytest.mark.parametrize("solid", [Block(0.3, 0.2, 0.1), CameraBody(0.08, 0.05, 0.03)])
@pytest.mark.parametrize("pose", [Pose.at(), SOMEWHERE])
def test_solids_with_plane_faces_against_their_tetrahedra(solid, pose):
    solid = solid.at(pose)
    closed = (*solid.faces, *(FRONT if isinstance(solid, CameraBody) else ()))
    ours = about_centre(*tetrahedra(solid.vertices, closed))
    same(replace(solid, density=1.0).inertia, ours)


def by_quadrature(inside, half, n=200):
    """Inertia of density 1 of the points inside, by midpoints of a grid over a box."""
    axes = [h * (2 * np.arange(n) + 1 - n) / n for h in half]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[
        inside(*np.meshgrid(*axes, indexing="ij"))
    ]
    cell = np.prod(2 * np.array(half) / n)
    return about_centre(cell * len(x), cell * x.sum(axis=0), cell * x.T @ x)


def test_round_solids_against_a_grid_of_points():
    """To the thousandth that the steps of the grid leave."""
    ball = by_quadrature(lambda x, y, z: x * x + y * y + z * z < 1, (1, 1, 1), 120)
    wheel = by_quadrature(lambda x, y, z: x * x + y * y < 1, (1, 1, 0.2), 120)
    for solid, found in [(Ball(1, density=1), ball), (Wheel(1, 0.4, density=1), wheel)]:
        np.testing.assert_allclose(solid.inertia.mass, found.mass, rtol=1e-3)
        close(solid.inertia.tensor, found.tensor, 2e-3 * found.tensor.max())


@EACH
def test_mass_and_density_give_the_same_inertia(solid):
    volume = replace(solid, mass=None, density=1.0).inertia.mass
    dense = replace(solid, mass=None, density=solid.mass / volume)
    same(dense.inertia, solid.inertia)
    assert replace(solid, mass=None).inertia is None


@EACH
def test_a_moved_solid_has_a_moved_inertia(solid):
    same(solid.at(SOMEWHERE).inertia, solid.inertia.at(SOMEWHERE))


def test_two_halves_make_a_whole():
    half = Block(0.15, 0.2, 0.1, mass=1.0)
    both = half.at(Pose.at(-0.075)).inertia + half.at(Pose.at(0.075)).inertia
    same(both, SOLIDS[0].inertia)


def test_energy_does_not_depend_on_the_frame():
    """1/2 m v'v + 1/2 w'I w of a turning body, seen from two frames."""
    body, w = SOLIDS[1].inertia + SOLIDS[0].at(SOMEWHERE).inertia, np.array([0.3, -1.0, 2.0])

    def energy(inertia, w):
        v = np.cross(w, inertia.centre)
        return inertia.mass * v @ v / 2 + w @ inertia.tensor @ w / 2

    turned = Pose.at(rpy=(0.1, 2.0, -3.0))
    close(energy(body, w), energy(body.at(turned), turned @ w), 1e-12)


def test_a_link_has_its_given_mass_else_the_mass_of_its_shapes():
    shapes = (SOLIDS[0], Mesh("a.stl"), Ball(0.1), SOLIDS[3].at(SOMEWHERE))
    link = Link("arm", shapes=shapes)
    same(link.inertial, SOLIDS[0].inertia + SOLIDS[3].inertia.at(SOMEWHERE))
    given = Inertia(1.0, (0, 0, 1), np.eye(3))
    assert Link("arm", shapes=shapes, inertia=given).inertial == given
    assert Link("arm", shapes=(Ball(0.1),)).inertial is None


def test_an_invalid_inertia_cannot_be_added():
    with pytest.raises(TypeError, match="unsupported operand"):
        SOLIDS[0].inertia + 3


def test_an_inertia_is_a_value():
    one, other = (Inertia(1, (0, 0, z), np.eye(3)) for z in (0.0, -0.0))
    assert one == other and hash(one) == hash(other)
    assert one != Inertia(1, (0, 0, 1), np.eye(3))
    with pytest.raises(ValueError, match="read-only"):
        one.tensor[0, 0] = 2.0


@pytest.mark.parametrize(
    ("mass", "centre", "tensor", "message"),
    [
        (-1, (0, 0, 0), np.eye(3), "mass must be a number not below 0, got -1"),
        (0, (0, 0, 0), np.eye(3), "without mass; only one can be above 0 then; strict=False keeps"),
        (0, (0, 0, 0), np.zeros((3, 3)), "the mass and all moments are 0"),
        (np.nan, (0, 0, 0), np.eye(3), "mass: nan; every number must be finite"),
        (1, (0, 0), np.eye(3), "centre of mass: expected shape"),
        (1, (0, 0, 0), None, "inertia needs a tensor"),
        (1, (0, 0, 0), np.diag([1, 1, 2.1]), "none can exceed the sum of the other two"),
        (1, (0, 0, 0), np.diag([1, 1, -1]), "none can be below 0"),
        (1, (0, 0, 0), np.eye(3) + np.eye(3, k=1) / 9, "not symmetric, by 0.111"),
    ],
)
def test_an_inertia_that_no_body_can_have_is_refused(mass, centre, tensor, message):
    with pytest.raises(rs.errors.InputError, match=message):
        Inertia(mass, centre, tensor)


@pytest.mark.parametrize(
    ("mass", "moments", "defect"),
    [
        (1.0, (1, 1, 3), "none can exceed the sum of the other two"),
        (1.0, (-1, 1, 1), "none can be below 0"),
        (0.0, (1, 1, 1), "without mass; only one can be above 0 then"),
        (0.0, (0, 0.35, 0), None),
        (1.0, (0, 0, 0.9e-8), None),  # 1 kg, 0.1 mm from the axis
        (1.0, (0, 0, 1.1e-8), "none can exceed"),
        (1.3, (-2e-35, 0, 2e-35), None),  # zeros that a program has rounded
    ],
)
def test_published_numbers_are_kept_and_their_defect_is_described(mass, moments, defect):
    found = Inertia(mass, (1, 2, 3), np.diag(moments), strict=False)
    assert found.mass == mass and found.centre.tolist() == [1, 2, 3]
    assert found.tensor.diagonal().tolist() == list(moments)
    assert (found.defect is None) == (defect is None) and (defect or "") in (found.defect or "")
    moved = found.at(SOMEWHERE)
    close(np.linalg.eigvalsh(moved.tensor), np.sort(moments), 1e-14)
    assert (moved.defect is None) == (defect is None)


def test_the_sum_of_massless_inertias_is_massless():
    ring = Inertia(0.0, tensor=np.diag([0, 0.35, 0]))
    assert (ring + ring).tensor.tolist() == np.diag([0, 0.7, 0]).tolist()
    both = SOLIDS[0].inertia + ring
    same(both, Inertia(2.0, (0, 0, 0), SOLIDS[0].inertia.tensor + ring.tensor, strict=False))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Block(1, 1, 1, mass=1, density=1), "give its mass or its density, not both"),
        (lambda: Ball(1e200, density=1).inertia, "mass: inf; every number must be finite"),
        (lambda: CameraBody(1e200, 1, 1, mass=1).inertia, "every number must be finite"),
        (lambda: Ball(1, mass=0), "Ball.mass must be a positive number"),
        (lambda: Ball(1, n=2), "Ball.n must be a whole number from 3 to 4096, got 2"),
        (lambda: Mesh("a.stl", mass=1), "the inertia of a mesh is not known"),
        (lambda: Mesh("a.stl", (1, 0, 1)), "three numbers other than 0"),
        (lambda: Link("a", inertia=1.0), "expected an Inertia"),
        (lambda: Mesh("/a.stl"), "absolute"),
        (lambda: Mesh("C:\\a.stl"), "absolute"),
        (lambda: Mesh("https://a.org/a.stl"), "absolute"),
        (lambda: Mesh("package://arm"), "absolute, or not a file name"),
        (lambda: Mesh("package://arm/../a.stl"), "leaves its package"),
        (lambda: Mesh("../../a.stl"), "leaves its package"),
        (lambda: Mesh("meshes/../../../a.stl"), "leaves its package"),
        (lambda: Mesh("a\n.stl"), "expected"),
        (lambda: Mesh(""), "expected"),
    ],
)
def test_bad_shapes_are_refused(make, message):
    with pytest.raises(rs.errors.InputError, match=message):
        make()


@pytest.mark.parametrize(
    "name", ["a.stl", "../meshes/a b.stl", "file:///a/b.stl", "package://arm/x/../a.stl"]
)
def test_good_names_of_meshes_stay_as_they_are(name):
    assert Mesh(name).filename == name


def test_a_ball_is_three_circles_around_its_centre():
    ball = Ball(0.2, n=12).at(SOMEWHERE)
    close(np.linalg.norm(ball.vertices - SOMEWHERE.position, axis=1), np.full(36, 0.2))
    circles = (SOMEWHERE.inv() @ ball.vertices).reshape(3, 12, 3)
    for axis, circle in enumerate(circles):
        close(circle[:, axis], np.zeros(12))
    assert (len(ball.edges), len(ball.faces)) == (36, 3)


def test_a_robot_of_meshes_is_drawn_as_lines():
    arm = rs.Robot.from_dh([[0, 0, 1, 0]], shapes=[(), (Mesh("a.stl"),)])
    stone = rs.Object("stone", Mesh("b.stl"), marks=np.zeros((1, 3)))
    figure = rs.plot.scene(rs.Scene([arm], [stone]), q=[0.0])
    assert figure is not None


def test_a_thin_rod_and_a_point_are_bodies_too():
    """m l^2/12 across a rod, nothing about it; two points make a rod of their own."""
    rod = rs.shapes.Inertia(3.0, tensor=np.diag([0.0, 1.0, 1.0])).at(
        rs.Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3))
    )
    np.testing.assert_allclose(np.linalg.eigvalsh(rod.tensor), [0, 1, 1], atol=1e-15)
    points = [rs.shapes.Inertia(2.0, (x, 0, 0), np.zeros((3, 3))) for x in (-1.0, 1.0)]
    np.testing.assert_allclose((points[0] + points[1]).tensor, np.diag([0.0, 4.0, 4.0]))
