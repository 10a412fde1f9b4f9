"""The chapter's ten functions (sections 2 and 3), in centimetres, with eq. (10) as corrected."""

import inspect
import subprocess
import sys

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from robsim import classic
from robsim.base.errors import InputError
from robsim.classic import (
    init_block,
    init_cam,
    init_circ,
    move_block,
    move_cam,
    move_circ,
    plot_block,
    plot_cam,
    plot_circ,
    point_view,
)
from robsim.geometry.pose import Pose
from robsim.geometry.primitives import Block, CameraBody, Wheel
from robsim.vision.camera import Camera

matplotlib.use("agg")

ARGUMENTS = {
    "init_block": ["L", "W", "H", "color"],
    "init_circ": ["R", "W", "n", "color"],
    "init_cam": ["L", "W", "H", "f", "px", "py", "alpha", "u0", "v0", "color"],
    "move_block": ["blk_i", "R", "t"],
    "move_circ": ["circ_i", "R", "t"],
    "move_cam": ["cam_i", "R", "t"],
    "plot_block": ["block"],
    "plot_circ": ["circ"],
    "plot_cam": ["cam"],
    "point_view": ["p3D", "Ki", "T_c"],
}
INTRINSICS = (0.8, 1.1e-3, 0.9e-3, 0.05, 240, 320)  # f, px, py in cm, alpha, u0, v0
BLOCK = init_block(30, 20, 10, "r")
CIRC = init_circ(10, 4, 16, "k")
CAM = init_cam(8, 4, 3, *INTRINSICS, "b")
SHAPES = [
    pytest.param(BLOCK, move_block, plot_block, id="block"),
    pytest.param(CIRC, move_circ, plot_circ, id="circ"),
    pytest.param(CAM, move_cam, plot_cam, id="cam"),
]
QUARTER_TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # about z


@pytest.fixture(autouse=True)
def no_open_figures():
    yield
    plt.close("all")


@pytest.fixture
def rng():
    return np.random.default_rng(10)


def rotation(rng):
    """Any rotation, by the QR decomposition: orthogonal to rounding."""
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return Q * np.linalg.det(Q)


def pose(rng, reach=50.0):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(rng), rng.uniform(-reach, reach, 3)
    return T


def in_base(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def distances(points):
    return np.linalg.norm(points[:, None] - points, axis=-1)


def ring(points, x, y, z):
    """The points (+-x, +-y, z), as a set."""
    return {tuple(p) for p in np.round(points, 12)} == {
        (i * x, j * y, z) for i in (-1, 1) for j in (-1, 1)
    }


# the names


def test_the_module_exports_the_ten_names_of_the_chapter_and_no_more():
    namespace = {}
    exec("from robsim.classic import *", namespace)
    assert set(namespace) - {"__builtins__"} == set(ARGUMENTS) == set(classic.__all__)


@pytest.mark.parametrize("name", ARGUMENTS)
def test_the_arguments_have_the_chapter_s_names_and_order(name):
    assert list(inspect.signature(getattr(classic, name)).parameters) == ARGUMENTS[name]


def test_matplotlib_is_not_imported_before_something_is_drawn():
    code = "import sys, robsim.classic; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# sections 2.1 to 2.3 and 3.1: shapes and frames


def test_a_block_has_8_vertices_12_edges_6_faces():
    assert isinstance(BLOCK, Block)
    assert (len(BLOCK.vertices), len(BLOCK.edges), len(BLOCK.faces)) == (8, 12, 6)


def test_a_camera_has_12_vertices_20_edges_9_faces():
    assert isinstance(CAM, CameraBody)
    assert (len(CAM.vertices), len(CAM.edges), len(CAM.faces)) == (12, 20, 9)


@pytest.mark.parametrize("n", [3, 16, 101])
def test_a_wheel_of_n_points_has_2n_vertices_2n_edges_n_and_2_faces(n):
    circ = init_circ(10, 4, n, "k")
    assert isinstance(circ, Wheel)
    assert (len(circ.vertices), len(circ.edges), len(circ.faces)) == (2 * n, 2 * n, n + 2)


def test_a_block_has_x_along_length_y_along_width_z_along_height_in_centimetres():
    assert ring(BLOCK.vertices[BLOCK.vertices[:, 2] < 0], 15.0, 10.0, -5.0)
    assert ring(BLOCK.vertices[BLOCK.vertices[:, 2] > 0], 15.0, 10.0, 5.0)


def test_each_edge_of_a_block_is_parallel_to_an_axis_and_as_long_as_the_block_there():
    spans = np.abs(np.subtract(*np.moveaxis(BLOCK.vertices[BLOCK.edges], 1, 0)))
    expected = [[0, 0, 10]] * 4 + [[0, 20, 0]] * 4 + [[30, 0, 0]] * 4
    assert sorted(spans.tolist()) == expected


def test_a_wheel_has_its_origin_midway_between_the_centres_and_z_along_its_axis():
    first, second = CIRC.vertices[:16], CIRC.vertices[16:]
    np.testing.assert_allclose(first.mean(axis=0), [0, 0, -2], atol=1e-14)
    np.testing.assert_allclose(second.mean(axis=0), [0, 0, 2], atol=1e-14)
    np.testing.assert_allclose(np.hypot(*CIRC.vertices[:, :2].T), 10, rtol=1e-15)


def test_a_wheel_has_x_at_the_angle_0_and_its_points_go_round_towards_y():
    angle = np.arctan2(CIRC.vertices[:4, 1], CIRC.vertices[:4, 0])
    np.testing.assert_allclose(angle, [0, np.pi / 8, np.pi / 4, 3 * np.pi / 8], atol=1e-15)


def test_a_camera_has_its_frame_at_the_centre_of_its_back_face_and_z_along_its_length():
    back = CAM.vertices[CAM.vertices[:, 2] == 0]
    assert ring(back, 1.5, 2.0, 0.0)  # x along the height 3, y along the width 4
    assert (CAM.vertices[:, 2].min(), CAM.vertices[:, 2].max()) == (0, 8)


def test_a_camera_is_larger_at_its_opening_than_at_its_back():
    opening = CAM.vertices[CAM.vertices[:, 2] == 8]
    assert len(opening) == 4
    assert (opening.max(axis=0)[:2] > [1.5, 2.0]).all()


def test_the_colour_is_kept():
    assert (BLOCK.color, CIRC.color, CAM.color) == ("r", "k", "b")


# section 3.2: moving


@pytest.mark.parametrize("shape, move, _plot", SHAPES)
def test_moving_takes_each_point_p_to_R_p_plus_t(shape, move, _plot, rng):
    R, t = rotation(rng), rng.uniform(-50, 50, 3)
    expected = shape.vertices @ R.T + t
    np.testing.assert_allclose(move(shape, R, t).vertices, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("shape, move, _plot", SHAPES)
def test_moving_keeps_the_distances_between_points(shape, move, _plot, rng):
    for _ in range(20):
        moved = move(shape, rotation(rng), rng.uniform(-50, 50, 3))
        np.testing.assert_allclose(
            distances(moved.vertices), distances(shape.vertices), rtol=0, atol=1e-12
        )


@pytest.mark.parametrize("shape, move, _plot", SHAPES)
def test_two_moves_are_one_by_the_product(shape, move, _plot, rng):
    T1, T2 = pose(rng), pose(rng)
    T = T2 @ T1
    twice = move(move(shape, T1[:3, :3], T1[:3, 3]), T2[:3, :3], T2[:3, 3])
    once = move(shape, T[:3, :3], T[:3, 3])
    np.testing.assert_allclose(twice.vertices, once.vertices, rtol=0, atol=1e-12)


@pytest.mark.parametrize("shape, move, _plot", SHAPES)
def test_moving_leaves_the_given_shape_where_it_was(shape, move, _plot):
    before = shape.vertices.copy()
    moved = move(shape, QUARTER_TURN, [1, 2, 3])
    np.testing.assert_array_equal(shape.vertices, before)
    assert type(moved) is type(shape)
    assert moved.color == shape.color
    np.testing.assert_array_equal(moved.edges, shape.edges)


@pytest.mark.parametrize("shape, move, _plot", SHAPES)
def test_t_may_be_a_column_as_in_matlab(shape, move, _plot):
    assert move(shape, QUARTER_TURN, [[1], [2], [3]]) == move(shape, QUARTER_TURN, [1, 2, 3])


def test_a_quarter_turn_about_z_lays_the_length_along_y():
    moved = move_block(BLOCK, QUARTER_TURN, [100, 0, 0])
    np.testing.assert_allclose(moved.vertices.max(axis=0), [110, 15, 5], atol=1e-12)
    np.testing.assert_allclose(moved.vertices.min(axis=0), [90, -15, -5], atol=1e-12)


def test_a_moved_camera_keeps_its_intrinsics_and_its_pose_is_T_c():
    moved = move_cam(CAM, QUARTER_TURN, [1, 2, 3])
    np.testing.assert_array_equal(moved.Ki, CAM.Ki)
    np.testing.assert_array_equal(moved.pose.matrix[:3, :3], QUARTER_TURN)
    np.testing.assert_array_equal(moved.pose.position, [1, 2, 3])


# section 3.4 and eq. (10): the image. Erratum 1: the printed matrix Ki is lost; with X up along
# the height of the camera and Y to the right, u is the row and v the column of the pixel, and
# alpha is a skew angle (in Chaumette and Hutchinson it is the aspect ratio of a pixel).


def eq10(points, f, px, py, alpha, u0, v0):
    X, Y, Z = np.moveaxis(points, -1, 0)
    u = u0 - X / Z * f / (px * np.cos(alpha))
    v = v0 + Y / Z * f / py + X / Z * f * np.tan(alpha) / py
    return np.stack([u, v], axis=-1)


def test_Ki_is_the_matrix_of_eq_10():
    f, px, py, alpha, u0, v0 = INTRINSICS
    expected = [[-f / (px * np.cos(alpha)), 0, u0], [f * np.tan(alpha) / py, f / py, v0], [0, 0, 1]]
    np.testing.assert_allclose(CAM.Ki, expected, rtol=1e-15)


def test_point_view_is_eq_10_in_the_frame_of_the_camera(rng):
    for _ in range(50):
        f, alpha = rng.uniform(0.2, 2), rng.uniform(-1.2, 1.2)
        px, py = rng.uniform(2e-3, 4e-3, 2)
        intrinsics = (f, px, py, alpha, *rng.uniform(100, 500, 2))
        Ki, T_c = init_cam(8, 4, 3, *intrinsics, "b").Ki, pose(rng)
        points = rng.uniform([-40, -40, 60], [40, 40, 300], (20, 3))
        seen = point_view(in_base(T_c, points), Ki, T_c)
        np.testing.assert_allclose(seen, eq10(points, *intrinsics), rtol=0, atol=1e-9)


def test_a_point_worked_out_by_hand():
    # f/px = f/py = 800, skew 45 degrees: u = 240 - 0.1 * 800 * sqrt(2), v = 320 + 0.2 * 800 + 80
    Ki = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, np.pi / 4, 240, 320, "b").Ki
    np.testing.assert_allclose(
        point_view([10, 20, 100], Ki, np.eye(4)), [240 - 80 * np.sqrt(2), 560], rtol=0, atol=1e-9
    )


def test_one_point_gives_one_pixel_and_points_give_pixels():
    assert point_view([1, 2, 30], CAM.Ki, np.eye(4)).shape == (2,)
    assert point_view([[1, 2, 30]], CAM.Ki, np.eye(4)).shape == (1, 2)
    assert point_view(np.ones((7, 3)), CAM.Ki, np.eye(4)).shape == (7, 2)


def test_one_point_is_seen_where_it_is_seen_among_others(rng):
    points, T_c = rng.uniform([-20, -20, 60], [20, 20, 300], (5, 3)), np.eye(4)
    together = point_view(points, CAM.Ki, T_c)
    for point, pixel in zip(points, together, strict=True):
        np.testing.assert_array_equal(point_view(point, CAM.Ki, T_c), pixel)


def test_erratum_1_u_is_the_row_and_grows_downwards():
    above, axis, right = point_view([[5, 0, 100], [0, 0, 100], [0, 5, 100]], CAM.Ki, np.eye(4))
    np.testing.assert_allclose(axis, [240, 320])
    assert above[0] < axis[0]  # up along +x, towards the top row
    assert right[1] > axis[1]  # to the right along +y, towards the last column
    assert right[0] == axis[0]


@pytest.mark.parametrize("alpha", [-1.0, 0.0, 0.05, 1.0])
def test_erratum_1_the_determinant_of_Ki_is_negative(alpha):
    Ki = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, alpha, 240, 320, "b").Ki
    np.testing.assert_allclose(np.linalg.det(Ki), -800 * 800 / np.cos(alpha), rtol=1e-12)


def test_erratum_1_the_camera_s_column_and_row_are_v_and_u(rng):
    T_c = pose(rng)
    points = in_base(T_c, rng.uniform([-20, -20, 60], [20, 20, 300], (20, 3)))
    quarter = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    columns_rows = Camera.from_chapter(*INTRINSICS).project(points, T_c @ quarter)
    u_v = point_view(points, CAM.Ki, T_c)
    np.testing.assert_allclose(u_v[:, ::-1], columns_rows, rtol=0, atol=1e-9)


def test_a_moved_camera_sees_by_its_own_pose():
    looking_down = move_cam(CAM, np.diag([1.0, -1, -1]), [0, 0, 100])
    np.testing.assert_allclose(point_view([0, 0, 0], CAM.Ki, looking_down.pose), [240, 320])
    to_its_right = point_view([0, -5, 0], CAM.Ki, looking_down.pose)  # base -y is camera +y
    np.testing.assert_allclose(to_its_right, [240, 320 + 0.05 * 0.8 / 0.9e-3], rtol=1e-14)


def test_the_unit_of_length_does_not_matter_only_its_ratios(rng):
    points, T_c = rng.uniform([-20, -20, 60], [20, 20, 300], (20, 3)), pose(rng)
    metres = T_c.copy()
    metres[:3, 3] /= 100
    f, px, py, *rest = INTRINSICS
    millimetres = init_cam(8, 4, 3, 10 * f, 10 * px, 10 * py, *rest, "b")
    np.testing.assert_allclose(
        point_view(in_base(T_c, points) / 100, millimetres.Ki, metres),
        point_view(in_base(T_c, points), CAM.Ki, T_c),
        rtol=0,
        atol=1e-9,
    )


def test_points_behind_the_camera_are_nan_and_never_mirrored():
    points = [[1, 2, 30], [-1, -2, -30], [1, 2, 0]]
    seen = point_view(points, CAM.Ki, np.eye(4))
    assert np.isfinite(seen[0]).all()
    assert np.isnan(seen[1:]).all()
    assert np.isnan(point_view(points[1], CAM.Ki, np.eye(4))).all()


def test_T_c_may_be_a_pose_or_a_batch_of_them():
    T_c = Pose.exp([[0, 0, z, 0, 0, 0] for z in (0, 10)])
    each = [point_view([1, 2, 30], CAM.Ki, T_c[i]) for i in range(2)]
    np.testing.assert_array_equal(point_view([1, 2, 30], CAM.Ki, T_c), each)


# section 3.3: drawing


@pytest.mark.parametrize("shape, move, plot", SHAPES)
def test_the_lines_drawn_are_the_edges(shape, move, plot):
    moved = move(shape, QUARTER_TURN, [10, 20, 30])
    [lines] = plot(moved)
    np.testing.assert_array_equal(lines._segments3d, moved.vertices[moved.edges])
    np.testing.assert_array_equal(lines.get_colors(), [matplotlib.colors.to_rgba(shape.color)])
    plt.gcf().canvas.draw()


def test_shapes_are_drawn_in_the_same_axes_in_centimetres_with_equal_scales():
    [[first], [second], [third]] = plot_block(BLOCK), plot_circ(CIRC), plot_cam(CAM)
    axes = first.axes
    assert second.axes is third.axes is axes
    assert len(plt.get_fignums()) == 1
    labels = axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()
    assert labels == ("x (cm)", "y (cm)", "z (cm)")
    spans = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    np.testing.assert_allclose(axes.get_box_aspect() / spans, axes.get_box_aspect()[0] / spans[0])


def test_the_axes_hold_all_that_was_drawn():
    [lines] = plot_block(BLOCK)
    plot_circ(move_circ(CIRC, np.eye(3), [100, -200, 300]))
    axes = lines.axes
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    assert (low <= [-15, -210, -5]).all()
    assert (high >= [110, 10, 302]).all()


def test_the_current_3d_axes_are_used():
    axes = plt.figure().add_subplot(projection="3d")
    assert plot_block(BLOCK)[0].axes is axes


def test_the_3d_axes_of_the_current_figure_are_used_beside_flat_ones():
    figure = plt.figure()
    axes = figure.add_subplot(1, 2, 1, projection="3d")
    figure.add_subplot(1, 2, 2)
    assert plot_block(BLOCK)[0].axes is axes


def test_a_flat_figure_is_left_alone():
    figure, flat = plt.subplots()
    assert plot_block(BLOCK)[0].figure is not figure
    assert figure.axes == [flat]


# bad input


@pytest.mark.parametrize(
    "move, wrong, message",
    [
        (move_block, CIRC, "move_block: blk_i: expected a Block, got a Wheel"),
        (move_circ, CAM, "move_circ: circ_i: expected a Wheel, got a ClassicCamera"),
        (move_cam, BLOCK, "move_cam: cam_i: expected a CameraBody, got a Block"),
        (move_block, [1, 2], "move_block: blk_i: expected a Block, got a list"),
    ],
)
def test_moving_the_wrong_kind_of_shape_is_an_error(move, wrong, message):
    with pytest.raises(InputError, match=message):
        move(wrong, np.eye(3), [0, 0, 0])


@pytest.mark.parametrize(
    "plot, wrong, message",
    [
        (plot_block, CIRC, "plot_block: block: expected a Block, got a Wheel"),
        (plot_circ, BLOCK, "plot_circ: circ: expected a Wheel, got a Block"),
        (plot_cam, CIRC, "plot_cam: cam: expected a CameraBody, got a Wheel"),
    ],
)
def test_plotting_the_wrong_kind_of_shape_is_an_error_and_makes_no_figure(plot, wrong, message):
    with pytest.raises(InputError, match=message):
        plot(wrong)
    assert plt.get_fignums() == []


@pytest.mark.parametrize(
    "R, t, message",
    [
        (2 * np.eye(3), [0, 0, 0], "R: not a rotation"),
        (np.diag([1, 1, -1]), [0, 0, 0], "R: not a rotation but a reflection"),
        (np.eye(4), [0, 0, 0], r"R: expected shape \(3, 3\), got \(4, 4\)"),
        (np.eye(3)[None], [0, 0, 0], r"R: expected shape \(3, 3\), got \(1, 3, 3\)"),
        (np.eye(3), [0, 0], r"t: expected shape \(3,\) or \(3, 1\), got \(2,\)"),
        (np.eye(3), [[0, 0, 0]], r"t: expected shape \(3,\) or \(3, 1\), got \(1, 3\)"),
        (np.eye(3), [0, np.nan, 0], "t: nan at index"),
        ("R", [0, 0, 0], "R: expected"),
    ],
)
@pytest.mark.parametrize("shape, move, _plot", SHAPES)
def test_a_motion_that_is_not_rigid_is_an_error(shape, move, _plot, R, t, message):
    with pytest.raises(InputError, match=message):
        move(shape, R, t)


@pytest.mark.parametrize(
    "Ki",
    [
        [[800, 0, 320], [0, 800, 240], [0, 0, 1]],  # a matrix K for (column, row)
        [[-800, 3, 240], [0, 800, 320], [0, 0, 1]],
        [[-800, 0, 240], [0, -800, 320], [0, 0, 1]],
        [[-800, 0, 240], [0, 800, 320], [0, 0, 2]],
        np.zeros((3, 3)),
        np.eye(4),
        np.zeros((2, 3, 3)),
        np.full((3, 3), np.nan),
        "Ki",
    ],
)
def test_a_matrix_that_is_not_of_the_form_of_Ki_is_an_error_about_Ki(Ki):
    with pytest.raises(InputError, match=r"^Ki: "):
        point_view([0, 0, 100], Ki, np.eye(4))


@pytest.mark.parametrize(
    "p3D, T_c, message",
    [
        ([0, 0], np.eye(4), "p3D: expected shape"),
        ([0, 0, np.inf], np.eye(4), "p3D: inf at index"),
        ([0, 0, 100], np.eye(3), "T_c: expected shape"),
        ([0, 0, 100], np.diag([1, 1, 2, 1]), "T_c: not a rotation"),
        ([0, 0, 100], 2 * np.eye(4), "T_c: not a rotation"),
    ],
)
def test_a_point_or_a_pose_that_is_none_is_an_error(p3D, T_c, message):
    with pytest.raises(InputError, match=message):
        point_view(p3D, CAM.Ki, T_c)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: init_block(0, 1, 1, "r"), "length must be a positive number"),
        (lambda: init_circ(1, -1, 8, "r"), "width must be a positive number"),
        (lambda: init_circ(1, 1, 2, "r"), "n must be a whole number from 3"),
        (lambda: init_cam(8, 4, 0, *INTRINSICS, "b"), "height must be a positive number"),
        (lambda: init_cam(8, 4, 3, 0, 1, 1, 0, 0, 0, "b"), "f must be a positive number"),
        (lambda: init_cam(8, 4, 3, 1, 1, -1, 0, 0, 0, "b"), "py must be a positive number"),
        (lambda: init_cam(8, 4, 3, 1, 1, 1, 90, 0, 0, "b"), "alpha is the skew angle in radians"),
        (lambda: init_cam(8, 4, 3, 1, 1, 1, 0, np.nan, 0, "b"), r"alpha, u0, v0\): nan"),
    ],
)
def test_a_size_or_an_intrinsic_parameter_out_of_range_is_an_error(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_an_unknown_colour_is_an_error():
    with pytest.raises(InputError, match=r"Block\.color: no colour 'rot'"):
        init_block(1, 1, 1, "rot")


# values


def test_a_camera_is_a_value():
    same = init_cam(8, 4, 3, *INTRINSICS, "b")
    assert same == CAM
    assert hash(same) == hash(CAM)
    assert init_cam(8, 4, 3, *INTRINSICS[:-1], 321, "b") != CAM
    with pytest.raises(ValueError, match="read-only"):
        CAM.Ki[0, 0] = 1
    with pytest.raises(AttributeError):
        CAM.intrinsics = ()
