"""Each pixel of a solid has the colour of the nearest face on its ray."""

import io
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread
from mpl_toolkits.mplot3d import proj3d

import robsim as rs
from robsim import plot
from robsim.plot.face_order import FaceOrder, PaintedFaces
from robsim.plot.painted_parts import list_painted_parts
from robsim.plot.polygons import grow_polygons
from robsim.plot.shaded_solids import SolidFaces

matplotlib.use("agg")

APART = 2  # pixels around a pixel that must show the same face


def block(size, at, rpy=(0, 0, 0), color="b"):
    return rs.Block(*size, color=color).at(rs.Pose.at(*at, rpy=rpy))


def solids(name):
    """Solids that a sort by the centres of their faces paints in a wrong order."""
    joint = rs.Wheel(0.08, 0.3, 24, color="m")
    return {
        "a long forearm through a wrist": [
            block((0.9, 0.1, 0.1), (0, 0, 0)),
            joint.at(rs.Pose.at(0.4, 0, 0, rpy=(np.pi / 2, 0, 0))),
            block((0.1, 0.1, 0.5), (0.4, 0, -0.2), color="g"),
        ],
        "three bars, each over the next": [
            block((1.0, 0.1, 0.1), (0.17 * x, 0.17 * y, 0), (0, 0.3, yaw), color)
            for x, y, yaw, color in (
                (1, 0, np.pi / 2, "r"),
                (-0.5, 0.866, 7 * np.pi / 6, "g"),
                (-0.5, -0.866, 11 * np.pi / 6, "b"),
            )
        ],
        "a camera on a plate, and a ball in a wheel": [
            block((1.0, 1.0, 0.05), (0, 0, 0), color="c"),
            rs.CameraBody(0.3, 0.2, 0.15, color="y").at(rs.Pose.at(0.1, 0.2, 0.1)),
            rs.Wheel(0.2, 0.2, 32, color="m").at(rs.Pose.at(-0.25, -0.2, 0.1)),
            rs.shapes.Ball(0.19, color="r").at(rs.Pose.at(-0.25, -0.2, 0.15)),
        ],
    }[name]


def draw(shapes, view, perspective=False):
    """The faces of the shapes, and the image (rows, columns, 3) of their figure without lines."""
    scene = rs.Scene(objects=[rs.Object(f"o{i}", shape) for i, shape in enumerate(shapes)])
    figure = plot.scene(scene, view=view, size=(6.0, 4.5))
    axes = figure.axes[0]
    axes.set_axis_off()
    axes.get_legend().remove()
    if perspective:
        axes.set_proj_type("persp", focal_length=0.6)
    others = [each for each in axes.collections if not isinstance(each, SolidFaces)]
    for artist in [*others, *axes.get_lines()]:
        artist.remove()
    [faces] = axes.collections
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=figure.dpi)
    return faces, imread(io.BytesIO(data.getvalue()))[..., :3]


def nearest_faces(faces, shape):
    """The number of the nearest face at each pixel (rows, columns), or -1, by a depth buffer."""
    axes = faces.axes
    depth, found = np.full(shape, np.inf), np.full(shape, -1)
    for k, face in enumerate(np.asarray(faces._faces)):
        x, y, z = proj3d.proj_transform(*face.T, axes.M)
        screen = axes.transData.transform(np.column_stack([x, y])) - 0.5  # centres of pixels
        corners = np.column_stack([screen[:, 0], shape[0] - 1 - screen[:, 1], z])
        for triangle in pairwise(corners[1:]):
            fill_triangle(depth, found, np.array([corners[0], *triangle]), k)
    return found


def fill_triangle(depth, found, triangle, k):
    """Enter a triangle (3, 3) of columns, rows and depths into the buffer."""
    (left, top), (right, bottom) = np.floor(triangle[:, :2].min(0)), np.ceil(triangle[:, :2].max(0))
    box = np.s_[max(int(top), 0) : int(bottom) + 1, max(int(left), 0) : int(right) + 1]
    row, column = np.mgrid[box]
    basis = np.vstack([triangle[:, :2].T, np.ones(3)])
    if abs(np.linalg.det(basis)) < 1e-9:
        return  # corners are repeated
    points = np.stack([column.ravel(), row.ravel(), np.ones(row.size)])
    shares = np.linalg.solve(basis, points).reshape(3, *row.shape)
    far = np.tensordot(triangle[:, 2], shares, 1)
    nearer = (shares >= 0).all(axis=0) & (far < depth[box])
    depth[box] = np.where(nearer, far, depth[box])
    found[box] = np.where(nearer, k, found[box])


def share_of_wrong_pixels(shapes, view, perspective=False):
    faces, image = draw(shapes, view, perspective)
    found = nearest_faces(faces, image.shape[:2])
    expected = np.where((found >= 0)[..., None], faces._facecolor3d[found, :3], 1.0)
    inner = found >= 0  # pixels without a line or another face around
    for rows, columns in np.ndindex(2 * APART + 1, 2 * APART + 1):
        beside = np.roll(found, (rows - APART, columns - APART), axis=(0, 1))
        inner &= beside == found
    assert inner.sum() > 1000
    wrong = np.abs(image - expected).max(axis=2) > 0.04  # cuts are faint lines
    return wrong[inner].mean()


@pytest.mark.parametrize("view", [(22, -55), (60, 130), (-25, 20)])
@pytest.mark.parametrize(
    "name",
    [
        "a long forearm through a wrist",
        "three bars, each over the next",
        "a camera on a plate, and a ball in a wheel",
    ],
)
@pytest.mark.few(2)
def test_a_pixel_has_the_colour_of_the_nearest_face(name, view):
    assert share_of_wrong_pixels(solids(name), view) == 0.0


def test_it_does_so_in_perspective():
    assert share_of_wrong_pixels(solids("a long forearm through a wrist"), (22, -55), True) == 0.0


def test_no_part_of_a_visible_face_is_lost_by_the_cuts():
    wall = np.array([[0.0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]])
    cube = rs.Block(1, 1, 1)
    sides = [cube.vertices[list(face)] for face in cube.faces]
    painted = FaceOrder([[wall], sides]).arrange(np.array([1.0, 0.3, 0.2, 0.0]))
    areas = np.zeros(7)
    pieces = np.split(painted.corners, np.cumsum(painted.counts)[:-1])
    for source, corners in zip(painted.sources, pieces, strict=True):
        edges = corners[1:] - corners[0]
        normals = np.cross(edges[:-1], edges[1:]) / 2
        areas[source] += np.linalg.norm(normals.sum(axis=0))
    assert areas[0] == pytest.approx(4.0, abs=1e-12)
    assert sorted(areas[1:]) == pytest.approx([0, 0, 0, 1, 1, 1], abs=1e-12)


FRONT, BEHIND, BESIDE = 0.5, -0.5, 2.0
ABOVE = np.array([0.0, 0.0, 1.0, 0.0])  # a viewer infinitely far away
TILTED = np.array([0.1, -0.05, 1.0, 0.0])
NEAR = np.array([0.0, 0.0, 3.0, 1.0])


def painted_sources(shapes, viewer):
    """The numbers of the painted faces of solids, and how many faces come before each solid."""
    faces = [[shape.vertices[list(face)] for face in shape.faces] for shape in shapes]
    painted = FaceOrder(faces).arrange(viewer)
    return set(painted.sources.tolist()), np.cumsum([0, *map(len, faces)])


@pytest.mark.parametrize("viewer", [ABOVE, TILTED, NEAR])
@pytest.mark.parametrize(
    ("at", "is_painted"),
    [((0, 0, FRONT), True), ((0, 0, BEHIND), False), ((0, 0, 0), False), ((BESIDE, 0, 0), True)],
)
def test_a_small_block_is_left_out_behind_or_in_a_large_one(viewer, at, is_painted):
    small = block((0.2, 0.2, 0.2), at)
    sources, first = painted_sources([block((1.0, 1.0, 0.5), (0, 0, 0)), small], viewer)
    assert bool(sources & set(range(first[1], first[2]))) == is_painted
    assert sources & set(range(first[1]))


def test_a_block_that_looks_out_from_behind_another_is_painted():
    sources, first = painted_sources(
        [block((1.0, 1.0, 0.2), (0, 0, 0)), block((0.2, 0.2, 0.2), (0.45, 0, BEHIND))], ABOVE
    )
    assert len(sources & set(range(first[1], first[2]))) == 1


def test_a_block_around_the_viewer_hides_nothing():
    inside = np.array([0.0, 0.0, 0.0, 1.0])
    sources, _ = painted_sources([block((9, 9, 9), (0, 0, 0)), block((1, 1, 1), (2, 0, 0))], inside)
    assert len(sources) == 1


def test_two_equal_blocks_do_not_hide_each_other():
    sources, _ = painted_sources([block((1, 1, 1), (0, 0, 0))] * 2, ABOVE)
    assert sources


def test_a_grown_square_has_its_sides_outside_and_its_corners_cut():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    sides = [[0, -0.5], [2, -0.5], [2.5, 0], [2.5, 2], [2, 2.5], [0, 2.5], [-0.5, 2], [-0.5, 0]]
    start, count = np.array([0, 4]), np.array([4, 4])
    both = np.concatenate([square, square[::-1]])  # counterclockwise, and clockwise
    grown = grow_polygons(both, start, count, np.full(8, 0.5))
    np.testing.assert_allclose(np.roll(grown[:8], -1, axis=0), sides, atol=1e-15)
    assert {tuple(each) for each in grown[8:]} == {tuple(each) for each in grown[:8]}


def test_the_parts_of_a_face_are_one_path_and_its_edges_are_lines():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]])
    corners = np.concatenate([square, square + np.array([1.0, 0.0])])  # a face that is cut in two
    is_side = np.array([1, 0, 1, 1, 1, 1, 1, 0], bool)
    both = np.array([4, 4]), np.zeros(2, int), np.zeros(2, int)
    painted = PaintedFaces(np.pad(corners, ((0, 0), (0, 1))), is_side, *both)
    parts = list_painted_parts(painted, corners, np.array([True]), np.array([0]))
    assert parts.is_line.tolist() == parts.is_lined.tolist() == [False, True, True]
    places = np.split(parts.place_corners(corners, 0.0), parts.ends[:-1])
    assert [len(each) for each in places] == [2 * (2 * 4 + 1), 4 * 2, 2 * 2]
    assert (np.ptp(places[2][:, 0].reshape(2, 2), axis=1) == 0).all()  # the upright lines
