"""The figures are complete: each number in them is compared with its value in the run."""

from dataclasses import replace

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

import robsim as rs
from robsim import plot
from robsim.plot import palette
from robsim.plot.shaded_solids import SHADOW, SolidFaces

matplotlib.use("agg")

SIZE = (640, 480)
CAMERA = rs.Camera([[800, 0, 330], [0, 800, 250], [0, 0, 1]], SIZE)
BODY = rs.CameraBody(0.08, 0.05, 0.04)
CUBE = rs.Block(0.05, 0.05, 0.05, color="y")
OFFSET = np.array([0.1, 0.08, -0.1, 0.08, 0.15])
DISPLAY = rs.Pose.at(0.3, -0.2, 0.1, rpy=(0.4, -0.3, 1.2))
RHINO = rs.Robot.from_dh(
    [
        [0, 0.2604, 0, -np.pi / 2],
        [0, 0, 0.2286, 0],
        [0, 0, 0.2286, 0],
        [0, 0, 0.0095, -np.pi / 2],
        [0, 0.1683, 0, 0],
    ],
    home=[0, -np.pi / 2, np.pi / 2, 0, -np.pi / 2],
    name="rhino",
    links=["shoulder", "upper", "fore", "wrist", "tool"],
    shapes=[
        [rs.Block(0.2, 0.2, 0.12, color="k").at(rs.Pose.at(0, 0, 0.06))],
        [rs.Block(0.09, 0.14, 0.1, color="r").at(rs.Pose.at(0, 0.07, 0))],
        [rs.Block(0.2286, 0.05, 0.07, color="b").at(rs.Pose.at(-0.1143, 0, 0))],
        [rs.Block(0.2286, 0.04, 0.05, color="g").at(rs.Pose.at(-0.1143, 0, 0))],
        [rs.Wheel(0.03, 0.04, 12, color="m")],
        [rs.Block(0.06, 0.03, 0.04, color="c").at(rs.Pose.at(0, 0, -0.08))],
    ],
)


def workstation(camera=CAMERA, display=DISPLAY):
    top = CUBE.vertices[CUBE.vertices[:, 2] > 0]
    cube = rs.Object("cube", CUBE, top, rs.Pose.at(0.24, 0, 0.025))
    eye = rs.MountedCamera("eye", camera, "rhino.tool", rs.Pose.at(0, 0.05, -0.08))
    return rs.Scene(RHINO, cube, eye, display=display)


def simulated(scene, q0, **settings):
    task = rs.IBVS(goal=scene.home, law="camera", **settings.pop("task", {}))
    return rs.simulate(scene, task, q0, **{"duration": 3.0} | settings)


@pytest.fixture(scope="module")
def scene():
    return workstation()


@pytest.fixture(scope="module")
def run(scene):
    return simulated(scene, scene.home + OFFSET)


@pytest.fixture(scope="module")
def batch(scene):
    shares = np.linspace(-1, 1, 60)[:, None]
    return simulated(scene, scene.home + shares * OFFSET, duration=0.4)


@pytest.fixture(scope="module")
def still(scene):
    """A run that starts at its goal: one moment, no motion, no error."""
    return simulated(scene, scene.home)


TRIANGLE = [[0.2, 0, 1], [0.3, 0, 1], [0.2, 0.1, 1.1]]
SQUARE = [[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]]


@pytest.fixture(scope="module")
def pair_scene():
    """Two cameras of unequal images on one body, and two objects with marks."""
    fly = rs.Robot(
        "fly", [rs.joints.Link("base"), rs.joints.Link("body", "base", rs.joints.Joint("floating"))]
    )
    things = [rs.Object("triangle", marks=TRIANGLE), rs.Object("square", marks=SQUARE)]
    wide = rs.Camera([[400, 0, 400], [0, 400, 300], [0, 0, 1]], (800, 600))
    eyes = [
        rs.MountedCamera("left", CAMERA, "fly.body"),
        rs.MountedCamera("right", wide, "fly.body", rs.Pose.at(0.1, 0, 0)),
    ]
    return rs.Scene(fly, things, eyes)


@pytest.fixture(scope="module")
def pair(pair_scene):
    """Left sees the square, right both objects; errors without unit, and in pixels."""
    parts = [
        rs.features.FeatureBlock("points", "left", "square"),
        rs.features.FeatureBlock("pixels", "right", "triangle"),
        rs.features.FeatureBlock("points", "right", "square"),
    ]
    start = rs.Pose.at(0.05, 0.02, -0.2, rpy=(0, 0, 0.2))
    return rs.simulate(pair_scene, rs.IBVS(features=parts), start, duration=1.0)


def wires(figure):
    """{label: [segments (E, 2, 3) of one solid, ...]} of the lines in 3-D axes."""
    found = {}
    for artist in figure.axes[0].collections:
        if isinstance(artist, Line3DCollection) and not artist.get_label().startswith("_"):
            found.setdefault(artist.get_label(), []).append(np.array(artist._segments3d))
    return found


def faces(figure):
    """{label: [corners (n, 3) of a face, ...]} of the solids in 3-D axes."""
    found = {}
    for solids in [a for a in figure.axes[0].collections if isinstance(a, SolidFaces)]:
        for label, corners in zip(solids.labels, np.asarray(solids._faces), strict=True):
            again = (np.diff(corners, axis=0) == 0).all(axis=1)  # corners are repeated, to pad
            found.setdefault(label, []).append(corners[np.r_[True, ~again]])
    return found


def faces_of(shape, T):
    """Faces of a shape moved by T, with nothing but NumPy."""
    points = shape.vertices @ T[:3, :3].T + T[:3, 3]
    return [points[list(face)] for face in shape.faces]


def assert_same(drawn, expected):
    assert len(drawn) == len(expected)
    for one, other in zip(drawn, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def lines(axes, label):
    [line] = [line for line in axes.get_lines() if line.get_label() == label]
    return line


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def placed(shape, T):
    """Segments of a shape moved by T, with nothing but NumPy."""
    points = shape.vertices @ T[:3, :3].T + T[:3, 3]
    return points[shape.edges]


def asterisks(axes):
    return [line for line in axes.get_lines() if line.get_marker() == palette.ASTERISK]


def marked(axes, marker):
    """(N, 2) of the points that are drawn with a marker."""
    drawn = [line for line in axes.get_lines() if line.get_marker() == marker]
    return np.array([line.get_xydata()[0] for line in drawn])


# --- the 3-D window


def test_every_link_is_drawn_where_the_kinematics_put_it_seen_from_the_display_frame(scene):
    q = scene.home + OFFSET
    drawn = faces(plot.scene(scene, q))
    for link, T in zip(RHINO.links, RHINO.frames(q), strict=True):
        assert_same(drawn[link.name], faces_of(link.shapes[0], DISPLAY.matrix @ T))


def test_home_is_drawn_when_no_configuration_is_given(scene):
    first, second = faces(plot.scene(scene)), faces(plot.scene(scene, scene.home))
    assert first.keys() == second.keys() == {*(link.name for link in RHINO.links), "cube"}
    for label in first:
        assert_same(first[label], second[label])


def test_objects_stand_at_their_pose_with_asterisks_as_marks(scene):
    figure = plot.scene(scene)
    T = DISPLAY.matrix @ rs.Pose.at(0.24, 0, 0.025).matrix
    assert_same(faces(figure)["cube"], faces_of(CUBE, T))
    drawn = [line.get_data_3d() for line in asterisks(figure.axes[0])]
    marks = scene.object().marks @ T[:3, :3].T + T[:3, 3]
    np.testing.assert_allclose(np.array(drawn)[..., 0], marks, atol=1e-12)


def test_a_camera_with_a_body_is_drawn_by_it():
    scene = workstation(rs.Camera(CAMERA.K, SIZE, body=BODY))
    T = scene.display.matrix @ scene.pose("eye", scene.home).matrix
    expected = rs.Camera(CAMERA.K, SIZE, body=BODY).drawn(T)
    assert_same(faces(plot.scene(scene))["eye"], faces_of(expected, np.eye(4)))


def test_a_camera_without_a_body_is_the_pyramid_of_its_view():
    scene = workstation(rs.Camera(CAMERA.K, SIZE, distortion=(-0.1, 0.01, 1e-3, 1e-3)))
    [segments] = wires(plot.scene(scene))["eye"]
    T = rs.Pose(scene.display.matrix @ scene.pose("eye", scene.home).matrix)
    np.testing.assert_allclose(segments[:4, 0], np.tile(T.position, (4, 1)), atol=1e-12)
    corners = [(-0.5, -0.5), (639.5, -0.5), (639.5, 479.5), (-0.5, 479.5)]
    np.testing.assert_allclose(scene.camera().camera.project(segments[:4, 1], T), corners)


def test_proportions_are_true_and_the_lowest_point_is_on_the_floor(scene):
    figure = plot.scene(scene)
    axes = figure.axes[0]
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    sides = np.ptp(limits, axis=1)
    np.testing.assert_allclose(axes.get_box_aspect() / sides, axes.get_box_aspect()[0] / sides[0])
    points = np.concatenate([face for group in faces(figure).values() for face in group])
    assert (points >= limits[:, 0] - 1e-12).all()
    assert (points <= limits[:, 1] + 1e-12).all()
    assert np.isclose(points[:, 2].min(), limits[2, 0])


def test_the_axes_of_the_scene_carry_metres(scene):
    axes = plot.scene(scene).axes[0]
    labels = [axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()]
    assert labels == ["x (m)", "y (m)", "z (m)"]


def test_a_run_is_drawn_from_its_dashed_start_to_its_solid_end(scene, run):
    figure = plot.scene(scene, run=run)
    shape = RHINO.links[-1].shapes[0]
    start, end = (DISPLAY.matrix @ RHINO.fk(run[name].values) for name in ("q0", "q_end"))
    np.testing.assert_allclose(wires(figure)["tool at start"], [placed(shape, start)], atol=1e-12)
    assert_same(faces(figure)["tool"], faces_of(shape, end))
    styles = {a.get_label(): a.get_linestyle()[0] for a in figure.axes[0].collections}
    assert styles["tool at start"][1] is not None


def test_bodies_at_rest_in_a_run_are_drawn_once(scene, run):
    figure = plot.scene(scene, run=run)
    assert len(faces(figure)["base"]) == len(faces(figure)["cube"]) == 6
    assert not {"base at start", "cube at start"} & wires(figure).keys()


def test_the_path_of_the_camera_agrees_with_the_run(scene, run):
    axes = plot.scene(scene, run=run).axes[0]
    path = np.transpose(lines(axes, "path of eye").get_data_3d())
    seen = run["camera_pose"].dropna("time").values[:, :3, 3]
    expected = seen @ DISPLAY.rotation.T + DISPLAY.position
    np.testing.assert_allclose(path[1:-1], expected, atol=1e-12)  # q0 and q_end are added


def test_the_path_of_a_carried_object_is_drawn_where_the_camera_stands_still():
    cube = rs.Object("cube", CUBE, on="rhino.tool")
    watcher = rs.MountedCamera("watcher", CAMERA, pose=rs.Pose.at(0.3, 0, 1.2, rpy=(np.pi, 0, 0)))
    scene = rs.Scene(RHINO, cube, watcher)
    run = simulated(scene, scene.home + OFFSET)
    axes = plot.scene(scene, run=run).axes[0]
    path = np.transpose(lines(axes, "path of cube").get_data_3d())
    np.testing.assert_allclose(path[0], RHINO.fk(run["q0"].values)[:3, 3], atol=1e-12)
    np.testing.assert_allclose(path[-1], RHINO.fk(run["q_end"].values)[:3, 3], atol=1e-12)
    assert "path of watcher" not in legend(axes)


def test_the_legend_names_links_objects_and_cameras_once(scene, run):
    names = ["base", "shoulder", "upper", "fore", "wrist", "tool", "cube", "eye"]
    assert legend(plot.scene(scene).axes[0]) == [*names, "marks"]
    of_run = legend(plot.scene(scene, run=run.drop_vars("goal_pose", errors="ignore")).axes[0])
    assert of_run == [*names, "start", "marks", "path of eye"]


def test_a_summary_still_shows_start_and_end(scene, run):
    summary = simulated(scene, scene.home + OFFSET, record="summary")
    drawn, expected = (plot.scene(scene, run=r) for r in (summary, run))
    assert_same(faces(drawn)["tool"], faces(expected)["tool"])
    label = "tool at start"
    np.testing.assert_array_equal(wires(drawn)[label], wires(expected)[label])


def colors_of(axes):
    """{name: colour} of the legend."""
    handles = axes.get_legend().legend_handles
    return dict(zip(legend(axes), [to_hex(handle.get_color()) for handle in handles], strict=True))


def test_links_keep_their_colours_and_an_all_black_robot_gets_one_for_each():
    shapes = [[rs.Block(1, 1, 1)]] * 4
    arm = rs.Robot.from_dh([[0, 1, 0, 0]] * 3, shapes=shapes, name="arm")
    drawn = colors_of(plot.scene(rs.Scene(arm)).axes[0])
    own = [palette.BLACK, palette.BLUE, palette.VERMILLION, palette.GREEN]
    assert list(drawn.values()) == [palette.tint_color(color, 0.15) for color in own]
    drawn = colors_of(plot.scene(rs.Scene(RHINO)).axes[0])
    own = [palette.tint_color(palette.convert_color(color), 0.15) for color in "krbgmc"]
    assert list(drawn.values()) == own


def test_a_robot_of_one_colour_is_one_entry_of_the_legend():
    arm = rs.Robot.from_dh([[0, 1, 0, 0]] * 3, shapes=[[rs.Block(1, 1, 1, "c")]] * 4, name="arm")
    figure = plot.scene(rs.Scene(arm))
    assert legend(figure.axes[0]) == ["arm"]
    assert len(faces(figure)["arm"]) == 4 * 6


def test_a_legend_has_each_colour_once():
    """Links of one colour share an entry; cameras and paths take what nothing else has."""
    shapes = [[rs.Block(1, 1, 1, color)] for color in "krkgk"]
    arm = rs.Robot.from_dh([[0, 1, 0.1, 0]] * 4, shapes=shapes, name="arm")
    eyes = [rs.MountedCamera(name, CAMERA, "arm.link4") for name in ("left", "right")]
    scene = rs.Scene(arm, rs.Object("dot", marks=[[0, 0, 9]]), eyes)
    axes = plot.scene(scene).axes[0]
    names = legend(axes)
    assert names == ["base, link2, link4", "link1", "link3", "left", "right", "marks"]
    handles = axes.get_legend().legend_handles[:5]
    assert len({to_hex(handle.get_color()) for handle in handles}) == 5


def test_a_body_of_several_colours_is_named_by_one_of_its_own():
    """Also if it has more of another: the legend explains as many colours as it can."""
    head = [rs.Block(0.1, 0.1, 0.1, "m"), rs.Block(0.5, 0.5, 0.5, "k")]
    arm = rs.Robot.from_dh([[0, 1, 0, 0]], shapes=[[rs.Block(1, 1, 1)], head], links=["head"])
    colors = colors_of(plot.scene(rs.Scene(arm)).axes[0])
    own = {"base": palette.BLACK, "head": palette.PURPLE}
    assert colors == {name: palette.tint_color(color, 0.15) for name, color in own.items()}


def test_outcomes_have_colours_of_their_own_blue_where_it_worked_warm_where_not():
    assert set(palette.OUTCOMES) == set(rs.Outcome)
    assert len(set(palette.OUTCOMES.values())) == len(rs.Outcome)
    for outcome, (color, _) in palette.OUTCOMES.items():
        red, _, blue = to_rgb(color)
        assert blue > red if outcome == rs.Outcome.CONVERGED else red >= blue, outcome


@pytest.mark.full
def test_the_same_figure_has_the_same_bytes(scene, run):
    drawn = [plot.run(run, scene, goal=scene.home)._repr_png_() for _ in range(2)]
    assert drawn[0] == drawn[1]


def test_the_colours_of_links_differ_up_to_twenty_one():
    assert len({palette.cycle_color(i) for i in range(21)}) == 21
    arm = rs.Robot.from_dh([[0, 1, 0, 0]] * 20, shapes=[[rs.Block(1, 1, 1)]] * 21, name="arm")
    assert legend(plot.scene(rs.Scene(arm)).axes[0]) == ["arm"]  # more links than a legend holds


def test_two_cameras_a_held_cube_and_its_goal_have_their_colours():
    held = rs.Object("cube", rs.Block(0.05, 0.05, 0.05, "g"), on="rhino.tool")
    goal = rs.Object("goal", rs.Block(0.05, 0.05, 0.05, "c"), np.empty((0, 3)))
    body = rs.Camera(CAMERA.K, SIZE, body=BODY)
    eyes = [
        rs.MountedCamera(n, body, pose=rs.Pose.at(1, y, 0.5)) for n, y in (("a", 0), ("b", 0.3))
    ]
    arm = rs.Robot("arm", [rs.joints.Link("base")])
    scene = rs.Scene(arm, [replace(held, on="arm.base"), goal], eyes)
    figure = plot.scene(scene)
    for eye in eyes:
        assert_same(faces(figure)[eye.name], faces_of(body.drawn(eye.pose), np.eye(4)))
    colors = colors_of(figure.axes[0])
    assert colors["cube"] == palette.tint_color(palette.GREEN, 0.15)
    assert colors["goal"] == palette.tint_color(palette.SKY_BLUE, 0.15)


def test_a_face_is_the_brighter_the_more_it_looks_at_the_lamp():
    scene = rs.Scene(objects=rs.Object("cube", rs.Block(1, 1, 1, "b")))
    [solids] = [a for a in plot.scene(scene).axes[0].collections if isinstance(a, SolidFaces)]
    brightness = solids._facecolor3d.sum(axis=1)
    up = [np.ptp(corners[:, 2]) == 0 and corners[0, 2] > 0 for corners in np.array(solids._faces)]
    assert brightness[up] == brightness.max()
    assert len(np.unique(brightness.round(9))) == 4  # top, right, front; three are turned away


def test_solids_throw_their_shadow_straight_down_on_the_ground(scene):
    axes = plot.scene(scene).axes[0]
    solids = [a for a in axes.collections if isinstance(a, Poly3DCollection)]
    [shadow] = [a for a in solids if to_hex(a._facecolor3d[0]) == SHADOW]
    corners = np.asarray(shadow._faces)
    assert np.ptp(corners[..., 2]) == 0
    assert corners[0, 0, 2] == axes.get_zlim()[0]
    below = [face[:, :2] for group in faces(plot.scene(scene)).values() for face in group]
    np.testing.assert_allclose(corners[..., :2].min(axis=(0, 1)), np.vstack(below).min(axis=0))


def ghost(figure, label):
    """Segments of the goal of a thing."""
    return np.concatenate(wires(figure)[f"goal of {label}"])


def test_the_goal_is_the_outline_of_the_camera_where_the_task_wants_it(scene, run):
    q = scene.home
    T = DISPLAY.matrix @ scene.pose("eye", q).matrix
    expected = wires(plot.scene(scene, q))["eye"][0]
    goals = [
        q,
        rs.IBVS(goal=q),
        rs.IBVS(),
        rs.tasks.TaughtGoal(q),
        rs.Pose(scene.pose("eye", q).matrix),
    ]
    for goal in goals:
        figure = plot.scene(scene, q + OFFSET, goal=goal)
        drawn = ghost(figure, "eye")
        np.testing.assert_allclose(drawn[:4, 0], np.tile(T[:3, 3], (4, 1)), atol=1e-12)
        away, size = (np.linalg.norm(np.diff(s, axis=1), axis=2) for s in (drawn, expected))
        np.testing.assert_allclose(away / away[0], size / size[0])  # deeper in a larger picture
        assert "goal" in legend(figure.axes[0])
    T_c_o = rs.Pose(scene.pose("eye", q).matrix).inv() @ scene.pose("cube", q)
    drawn = ghost(plot.run(run, scene, goal=rs.GoalPose(T_c_o)), "eye")
    np.testing.assert_allclose(drawn[0, 0], T[:3, 3], atol=1e-12)


def test_a_run_that_has_its_goal_is_drawn_with_it(scene, run):
    T = scene.pose("eye", scene.home).matrix
    told = run.assign(goal_pose=(("row", "column"), T, {"frame": "eye"}))
    drawn = ghost(plot.scene(scene, run=told), "eye")
    np.testing.assert_allclose(drawn[0, 0], (DISPLAY.matrix @ T)[:3, 3], atol=1e-12)
    unknown = told.assign(goal_pose=told["goal_pose"] * np.nan)
    assert "goal" not in legend(plot.scene(scene, run=unknown).axes[0])


def test_with_a_camera_at_rest_the_goal_agrees_with_its_target():
    cube = rs.Object("cube", CUBE, on="rhino.tool")
    watcher = rs.MountedCamera("watcher", CAMERA, pose=rs.Pose.at(0.3, 0, 1.2, rpy=(np.pi, 0, 0)))
    scene = rs.Scene(RHINO, cube, watcher)
    T = scene.pose("cube", RHINO.home)
    T_c_o = rs.Pose(scene.pose("watcher").matrix).inv() @ T
    for goal in (RHINO.home, rs.GoalPose(T_c_o), rs.Pose(T.matrix)):
        drawn = ghost(plot.scene(scene, RHINO.home + OFFSET, goal=goal), "cube")
        np.testing.assert_allclose(drawn, placed(CUBE, T.matrix), atol=1e-12)


def test_without_a_camera_the_goal_agrees_with_the_tip():
    goal = rs.Pose.at(0.3, 0.1, 0.4)
    drawn = ghost(plot.robot(RHINO, goal=goal), "rhino.tool")
    np.testing.assert_allclose(drawn, placed(RHINO.links[-1].shapes[0], goal.matrix), atol=1e-12)
    arm = rs.Robot.from_dh([[0, 0.3, 0.1, 0], [0, 0, 0.4, 0]], name="arm")
    axes = ghost(plot.robot(arm, goal=[0.3, 0.5]), "arm.link2")  # no shapes: x, y and z
    T = arm.fk([0.3, 0.5])
    np.testing.assert_allclose(axes[:, 0], np.tile(T[:3, 3], (3, 1)), atol=1e-12)
    ways = axes[:, 1] - axes[:, 0]
    np.testing.assert_allclose(
        ways / np.linalg.norm(ways, axis=1)[:, None], T[:3, :3].T, atol=1e-12
    )


@pytest.mark.parametrize("goal", [rs.GoalFeatures([0.1, 0.2]), rs.IBVS(rs.GoalFeatures([0.1]))])
def test_a_goal_without_a_pose_is_not_drawn(goal, scene):
    assert "goal" not in legend(plot.scene(scene, goal=goal).axes[0])


def test_a_goal_that_is_none_is_refused(scene):
    with pytest.raises(rs.errors.InputError, match=r"goal q: expected shape \(5,\)|goal q"):
        plot.scene(scene, goal=[0, 1])
    with pytest.raises(rs.errors.InputError, match="goal q"):
        plot.scene(scene, goal=[scene.home, scene.home])
    with pytest.raises(rs.errors.InputError, match="no robot, camera or object"):
        plot.scene(rs.Scene(), goal=rs.Pose.at(0, 0, 1))


@pytest.mark.parametrize("view", [None, (10, 30), (60, -120)])
@pytest.mark.parametrize("size", [None, (4, 3), (12, 4), (4, 9)])
def test_the_box_fills_its_page_from_any_side(view, size, scene):
    figure = plot.scene(scene, view=view, size=size)
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]
    assert (axes.elev, axes.azim) == (view or (22, -55))
    limits = [axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]
    corners = np.array(np.meshgrid(*limits)).reshape(3, -1)
    x, y, _ = proj3d.proj_transform(*corners, axes.get_proj())
    seen = axes.transData.transform(np.column_stack([x, y])) / figure.dpi
    left = axes.get_legend().get_window_extent().x0 / figure.dpi
    page = np.array([left, figure.get_figheight()])
    assert (seen.min(axis=0) > 0).all() and (seen.max(axis=0) < page).all()
    rest = page - np.ptp(seen, axis=0)
    assert rest[0] < 1.6 or rest[1] < 0.8  # but for labels one side is full


def test_bounds_and_view_stay_from_figure_to_figure(scene):
    bounds = [[-1, -1, -0.5], [1, 1, 1]]
    for q in (scene.home, scene.home + OFFSET):
        axes = plot.scene(scene, q, bounds=bounds).axes[0]
        limits = [axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]
        np.testing.assert_allclose(np.transpose(limits), bounds)


@pytest.mark.parametrize("sides", [(2, 0.2, 0.2), (0.2, 0.2, 2), (1, 1, 1), (30, 20, 4)])
def test_labels_of_any_box_are_on_the_page(sides):
    """Matplotlib puts them at a share of the sides of the box away from it."""
    figure = plot.scene(rs.Scene(objects=rs.Object("box", rs.Block(*sides))))
    FigureCanvasAgg(figure).draw()
    solid, renderer = figure.axes[0], figure.canvas.get_renderer()
    for axis in (solid.xaxis, solid.yaxis, solid.zaxis):
        low, high = np.array(axis.get_tightbbox(renderer)) / figure.dpi
        assert (low > -0.05).all() and (high < figure.get_size_inches() + 0.05).all()


def test_faces_of_unequal_size_are_padded_by_their_own_corners():
    """Matplotlib would pad them with uninitialised memory: a warning now and then."""
    shape = rs.Wheel(0.1, 0.05, n=12)
    drawn = faces(plot.scene(rs.Scene(objects=rs.Object("wheel", shape))))
    assert_same(drawn["wheel"], faces_of(shape, np.eye(4)))


def test_a_robot_without_shapes_is_a_stick_figure():
    arm = rs.Robot.from_dh([[0, 0.3, 0.1, 0], [0, 0, 0.4, 0]], name="arm")
    q = [0.3, 0.5]
    drawn = wires(plot.scene(rs.Scene(arm), q))
    points = arm.frames(q)[:, :3, 3]
    np.testing.assert_allclose(drawn["link1"][0], [points[:2]], atol=1e-12)
    np.testing.assert_allclose(drawn["link2"][0], [points[1:]], atol=1e-12)


def test_two_robots_are_distinguished_by_name():
    pair = rs.Scene([RHINO, RHINO.named("other").at(rs.Pose.at(0, 1, 0))])
    assert legend(plot.scene(pair).axes[0])[:2] == ["rhino", "other"]


def test_a_camera_that_flies_is_drawn_without_lines_to_its_base():
    fly = rs.Robot(
        "fly", [rs.joints.Link("base"), rs.joints.Link("body", "base", rs.joints.Joint("floating"))]
    )
    scene = rs.Scene(fly, cameras=rs.MountedCamera("eye", rs.Camera(np.eye(3)), "fly.body"))
    assert list(wires(plot.scene(scene, rs.Pose.at(0, 0, -1)))) == ["eye"]


@pytest.mark.parametrize("color", ["k", "0.4", "C0", "#e69f00", "tab:blue", (0.1, 0.2, 0.3)])
def test_a_colour_may_be_any_of_matplotlib(color):
    block = rs.Block(1, 1, 1, color=color)
    assert block.color == color
    plot.scene(rs.Scene(RHINO, rs.Object("thing", block)))


def test_swapped_arguments_are_named():
    scene = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)
    run = scene.run()
    with pytest.raises(rs.errors.InputError, match="got a Scene: the run is the first argument"):
        plot.run(scene.scene, run)
    with pytest.raises(rs.errors.InputError, match="expected a Scene, got a run: see `help`"):
        plot.scene(run)


@pytest.mark.parametrize("letter", "krgbcmyw")
def test_the_letters_of_the_primitives_have_colours_of_their_own(letter):
    others = [palette.convert_color(other) for other in "krgbcmyw" if other != letter]
    assert palette.convert_color(letter) not in others


# --- the image window


def test_the_ways_of_the_marks_are_the_pixels_of_the_run(run):
    axes = plot.image(run).axes[0]
    pixels = run["pixels"].dropna("time").values
    ways = [line.get_xydata() for line in axes.get_lines() if len(line.get_xydata()) > 1]
    np.testing.assert_array_equal(ways, np.moveaxis(pixels, 1, 0))


def test_start_end_goal_and_centre_have_markers_of_their_own(run):
    axes = plot.image(run).axes[0]
    pixels = run["pixels"].dropna("time").values
    np.testing.assert_array_equal(marked(axes, palette.ASTERISK), pixels[0])
    np.testing.assert_array_equal(marked(axes, "o"), pixels[-1])
    np.testing.assert_array_equal(marked(axes, "s"), run["pixels_goal"].values)
    np.testing.assert_array_equal(marked(axes, "+"), [(330, 250)])
    assert legend(axes) == ["start", "end", "goal", "image centre"]


def test_the_outline_of_the_goal_goes_around_its_marks(run):
    [rim] = [patch for patch in plot.image(run).axes[0].patches if isinstance(patch, Polygon)]
    goal = run["pixels_goal"].values
    assert sorted(map(tuple, rim.get_xy()[:-1])) == sorted(map(tuple, goal))
    assert to_hex(rim.get_edgecolor()) == palette.GOAL


def test_with_its_scene_the_image_shows_the_target_at_start_and_end(run, scene):
    axes = plot.image(run, scene=scene).axes[0]
    drawn = [line for line in axes.get_lines() if line.get_color() == palette.GREY]
    for some, q in ((drawn[:12], run["q0"].values), (drawn[12:], run["q_end"].values)):
        corners = scene.view(q, "eye", scene.pose("cube", q) @ CUBE.vertices).pixels
        segments = [line.get_xydata() for line in some]
        np.testing.assert_allclose(segments, corners[CUBE.edges], atol=1e-9)
    assert [line.get_linestyle() for line in (drawn[0], drawn[12])] == ["--", "-"]


def test_the_border_is_in_view_rows_grow_downwards_and_pixels_are_square(run):
    axes = plot.image(run).axes[0]
    [border] = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert border.get_bbox().extents.tolist() == [-0.5, -0.5, 639.5, 479.5]
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert left < -0.5 < 639.5 < right
    assert bottom > 479.5 > -0.5 > top
    assert axes.get_aspect() == 1
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("column (px)", "row (px)")


def test_the_image_shows_the_end_of_the_run(run):
    assert plot.image(run).axes[0].get_title() == "image: time limit after 3 s"


def test_a_mark_has_the_same_colour_in_the_image_and_in_the_scene(scene, run):
    image, solid = plot.image(run).axes[0], plot.scene(scene).axes[0]
    colors = [[line.get_color() for line in asterisks(axes)] for axes in (image, solid)]
    assert colors[0] == colors[1]
    assert len(set(colors[0])) == 4


def test_marks_are_numbered_as_in_the_data(run):
    axes = plot.image(run).axes[0]
    assert [text.get_text() for text in axes.texts] == ["0", "1", "2", "3"]
    np.testing.assert_array_equal([text.xy for text in axes.texts], run["pixels"].values[0])


def test_without_an_image_size_there_is_no_border(run):
    bare = run.drop_attrs(deep=False)
    axes = plot.image(bare).axes[0]
    assert not [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert legend(axes) == ["start", "end", "goal"]
    pixels = run["pixels"].dropna("time").values
    assert axes.get_xlim()[0] < pixels[..., 0].min() < pixels[..., 0].max() < axes.get_xlim()[1]


def test_marks_that_fly_far_out_of_the_image_do_not_shrink_it(run):
    far = run.copy(deep=True)
    far["pixels"][5] = 1e7
    left, right = plot.image(far).axes[0].get_xlim()
    assert -800 < left < right < 1500


def test_a_batch_is_laid_over_each_other_up_to_fifty_runs(batch):
    axes = plot.image(batch).axes[0]
    ways = [line.get_xydata() for line in axes.get_lines() if len(line.get_xydata()) > 1]
    assert len(ways) == 50 * 4
    np.testing.assert_array_equal(ways[0], batch["pixels"].values[0, :, 0])
    np.testing.assert_array_equal(ways[-1], batch["pixels"].values[-1, :, 3])
    assert axes.get_title() == "image: 50 of 60 runs"


def test_a_batch_of_one_is_a_run(batch, scene):
    first = batch.isel(run=[0])
    [one, same] = [plot.velocity(r).axes[0] for r in (first, batch.isel(run=0))]
    for label in ("$v_x$", "$v_y$", "$v_z$"):
        np.testing.assert_array_equal(lines(one, label).get_ydata(), lines(same, label).get_ydata())
    assert plot.image(first).axes[0].get_title().endswith("time limit after 0.4 s")


@pytest.mark.parametrize(
    ("camera", "numbers", "extents", "centre"),
    [
        (None, [0, 1, 2, 3], [-0.5, -0.5, 639.5, 479.5], (330, 250)),
        ("left", [0, 1, 2, 3], [-0.5, -0.5, 639.5, 479.5], (330, 250)),
        ("right", [4, 5, 6, 0, 1, 2, 3], [-0.5, -0.5, 799.5, 599.5], (400, 300)),
    ],
)
def test_of_several_cameras_one_is_shown(pair, camera, numbers, extents, centre):
    axes = plot.image(pair, camera).axes[0]
    mine = pair["mark_camera"].values == (camera or "left")
    pixels, goal = pair["pixels"].values[:, mine], pair["pixels_goal"].values[mine]
    ways = [line.get_xydata() for line in axes.get_lines() if len(line.get_xydata()) > 1]
    np.testing.assert_array_equal(ways, np.moveaxis(pixels, 1, 0))
    np.testing.assert_array_equal(marked(axes, "s"), goal)
    np.testing.assert_array_equal(marked(axes, "+"), [centre])
    [border] = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert border.get_bbox().extents.tolist() == extents
    assert [text.get_text() for text in axes.texts] == [str(number) for number in numbers]
    assert axes.get_title() == f"{camera or 'left'}: time limit after 1 s"
    assert legend(axes) == ["start", "end", "goal", "image centre"]


def test_marks_of_two_targets_differ_and_keep_their_colours_in_all_windows(pair, pair_scene):
    left, right = (plot.image(pair, name).axes[0] for name in ("left", "right"))
    [left, right] = [[line.get_color() for line in asterisks(axes)] for axes in (left, right)]
    triangle, square = right[:3], right[3:]
    assert square == left
    assert len({*triangle, *square}) == 7
    solid = plot.scene(pair_scene, run=pair).axes[0]
    assert [line.get_color() for line in asterisks(solid)] == [*triangle, *square]


def test_a_batch_shows_one_camera_too(pair_scene, pair):
    starts = np.stack([pair["q0"].values] * 2)
    task = rs.IBVS(
        features=[rs.features.FeatureBlock("points", name, "square") for name in ("left", "right")]
    )
    runs = rs.simulate(pair_scene, task, starts, duration=0.2)
    axes = plot.image(runs, "right").axes[0]
    ways = [line.get_xydata() for line in axes.get_lines() if len(line.get_xydata()) > 1]
    np.testing.assert_array_equal(ways[-1], runs["pixels"].values[1, :, 7])
    assert len(ways) == 2 * 4


@pytest.mark.parametrize("name", ["rihgt", "", 3, ["right"]])
def test_a_camera_that_is_not_in_the_run_is_refused_with_those_that_are(name, pair, pair_scene):
    with pytest.raises(
        rs.errors.InputError, match=r"no camera .* in the run;.* cameras: left, right"
    ):
        plot.image(pair, name)
    with pytest.raises(rs.errors.InputError, match="cameras: left, right"):
        plot.run(pair, pair_scene, name)


# --- the velocity window


def test_velocities_and_error_over_time_agree_with_the_run(run):
    v, w, e = plot.velocity(run).axes
    alive = run.dropna("time")
    for i, axis in enumerate("xyz"):
        for axes, symbol, column in ((v, "v", i), (w, r"\omega", i + 3)):
            line = lines(axes, f"${symbol}_{axis}$")
            np.testing.assert_array_equal(line.get_xdata(), alive["time"])
            np.testing.assert_array_equal(line.get_ydata(), alive["camera_velocity"][:, column])
    np.testing.assert_array_equal(lines(e, "norm").get_ydata(), alive["error_norm"])
    sizes = [line.get_ydata() for line in e.get_lines()[1:]]
    np.testing.assert_array_equal(sizes, np.abs(alive["error"].values).T)
    assert e.get_yscale() == "log"


def test_time_ends_with_the_run(scene):
    short = simulated(scene, scene.home + OFFSET, duration=20.0)
    assert int(short["outcome"]) == rs.Outcome.CONVERGED
    figure = plot.velocity(short)
    assert figure.axes[0].get_xlim() == (0, pytest.approx(float(short["end_time"])))
    assert figure.get_suptitle() == f"converged after {float(short['end_time']):.3g} s"


def test_velocity_labels_carry_units_also_for_the_features(run, scene):
    labels = [axes.get_ylabel() for axes in plot.velocity(run).axes]
    assert labels == ["v (m/s)", "ω (rad/s)", "error (–)"]
    task = {"features": rs.features.PixelPoints()}
    in_pixels = simulated(scene, scene.home + OFFSET, task=task, duration=0.2)
    axes = plot.velocity(in_pixels).axes[2]
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("error (px)", "time (s)")


def test_units_of_error_may_be_mixed(pair):
    e = plot.velocity(pair).axes[2]
    assert e.get_ylabel() == "error (–, px)"
    assert legend(e) == ["norm", "|–|", "|px|"]
    np.testing.assert_array_equal(lines(e, "norm").get_ydata(), pair["error_norm"])
    sizes, units = np.abs(pair["error"].values), pair["feature_unit"].values
    for unit, style in (("1", "-"), ("px", "--")):
        drawn = [line.get_ydata() for line in e.get_lines()[1:] if line.get_linestyle() == style]
        np.testing.assert_array_equal(drawn, sizes[:, units == unit].T)


@pytest.mark.parametrize("frame", ["rhino.tool", "rhino.fore", "eye"])
def test_the_velocity_of_a_frame_agrees_with_its_origin_in_world_axes(frame, scene, run):
    """Against differences of the poses along the run, which are good to the square of the step."""
    step, lived = 1e-6, run.dropna("time").isel(time=slice(0, None, 20))
    v, w, e = plot.velocity(lived, scene, frame).axes
    q, qd = lived["q"].values, lived["qd"].values
    before, after = (scene.pose(frame, q + sign * step * qd) for sign in (-1, 1))
    moved = (after.position - before.position) / (2 * step)
    turned = (after.rotation @ np.swapaxes(before.rotation, 1, 2)) / (2 * step)
    spun = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
    for i, axis in enumerate("xyz"):
        drawn = lines(v, f"$v_{axis}$"), lines(w, rf"$\omega_{axis}$")
        np.testing.assert_allclose(drawn[0].get_ydata(), moved[:, i], atol=1e-8)
        np.testing.assert_allclose(drawn[1].get_ydata(), spun[:, i], atol=1e-8)
    np.testing.assert_array_equal(lines(e, "norm").get_ydata(), lived["error_norm"])
    labels = [f"v of {frame}\nin world axes (m/s)", f"ω of {frame}\nin world axes (rad/s)"]
    assert [axes.get_ylabel() for axes in (v, w)] == labels


def test_a_frame_needs_its_scene_and_must_be_in_it(scene, run, pair_scene):
    with pytest.raises(rs.errors.InputError, match=r"frame 'rhino\.tool' needs the scene"):
        plot.velocity(run, frame="rhino.tool")
    with pytest.raises(
        rs.errors.InputError, match=r"no frame 'rhino\.tol'; did you mean 'rhino\.tool'"
    ):
        plot.velocity(run, scene, "rhino.tol")
    with pytest.raises(rs.errors.InputError, match="another scene: its coordinates are shoulder"):
        plot.velocity(run, pair_scene, "fly.body")
    with pytest.raises(rs.errors.InputError, match=r"expected a Scene, got 'rhino\.tool'"):
        plot.velocity(run, "rhino.tool", "rhino.tool")


def test_components_differ_in_line_style_for_black_and_white_print(run):
    axes = plot.velocity(run).axes[0]
    styles = {lines(axes, f"$v_{axis}$").get_linestyle() for axis in "xyz"}
    assert len(styles) == 3
    assert legend(axes) == ["$v_x$", "$v_y$", "$v_z$"]


# --- the joints


def test_joints_agree_with_the_run_in_degrees_and_metres(run, scene):
    figure = plot.joints(run, scene)
    alive = run.dropna("time")
    assert figure.get_suptitle() == "time limit after 3 s"
    spans = set()
    for axes, name, q in zip(
        figure.axes, scene.coordinate_names, alive["q"].values.T, strict=False
    ):
        line = lines(axes, name)
        np.testing.assert_array_equal(line.get_xdata(), alive["time"])
        np.testing.assert_allclose(line.get_ydata(), np.degrees(q), rtol=1e-14)
        assert axes.get_ylabel() == f"{name} (deg)"
        spans.add(round(float(np.ptp(axes.get_ylim())), 9))
    assert len(spans) == 1  # ways can be compared


def test_the_region_beyond_the_limits_of_a_joint_is_grey():
    limits = np.radians([[-10, 20], [-90, 90]])
    arm = rs.Robot.from_dh([[0, 0.3, 0.4, 0]] * 2, limits=limits, name="arm")
    task = rs.FollowJoints({"link1": np.radians(20), "link2": np.radians(5)}, duration=1)
    run = rs.simulate(rs.Scene(arm), task, duration=2)
    first, second = plot.joints(run, rs.Scene(arm)).axes[:2]
    assert (first.get_title(loc="right"), second.get_title(loc="right")) == (
        "within -10 to 20 deg",
        "within -90 to 90 deg",
    )
    [beyond] = first.patches
    assert beyond.get_y() + beyond.get_height() == pytest.approx(first.get_ylim()[1])
    assert min(beyond.get_y(), beyond.get_y() + beyond.get_height()) == pytest.approx(20)
    assert not second.patches
    assert plot.joints(run).axes[0].get_title(loc="right") == ""


# --- into the user's own axes


def test_figures_are_drawn_into_the_axes_that_are_given(scene, run, examined):
    figure = Figure((12, 9))
    solid = figure.add_subplot(331, projection="3d")
    flat = [figure.add_subplot(3, 3, i) for i in range(2, 10)]
    assert plot.scene(scene, ax=solid, title="mine") is figure
    assert solid.get_title() == "mine" and len(solid.collections) > 2
    assert plot.robot(RHINO, ax=solid) is figure
    assert plot.image(run, ax=flat[0], title="camera") is figure
    assert flat[0].get_title() == "camera" and len(flat[0].lines) > 4
    assert plot.velocity(run, axes=flat[1:4]) is figure
    assert [axes.get_ylabel()[0] for axes in flat[1:4]] == ["v", "ω", "e"]
    assert plot.joints(run, axes=Figure().subplots(5, 1)).axes[4].get_ylabel() == "tool (deg)"
    panels = Figure().subplots(2, 2)
    plot.diagnosis(examined, axes=panels)
    assert panels[0, 0].get_ylabel() == "V (–)"
    pictures = Figure().subplots(1, 2)
    plot.moments(scene, [scene.home, scene.home + OFFSET], axes=pictures)
    assert all(axes.get_aspect() == 1 for axes in pictures)
    sides = Figure().subplots(1, 2)
    plot.workspace(rs.kinematics.sample_workspace(RHINO, 50), axes=sides)
    assert sides[0].get_title() == "from the side"


def test_axes_that_do_not_fit_are_refused(scene, run):
    flat = Figure().subplots(1, 2)
    with pytest.raises(
        rs.errors.InputError, match=r"ax: expected 3-D axes, as plt.subplots\(subplot_kw="
    ):
        plot.scene(scene, ax=flat[0])
    with pytest.raises(
        rs.errors.InputError, match="expected 3 Axes of Matplotlib to draw into, got"
    ):
        plot.velocity(run, axes=flat)
    with pytest.raises(
        rs.errors.InputError, match="expected one Axes of Matplotlib to draw into, got"
    ):
        plot.image(run, ax=3)
    with pytest.raises(rs.errors.InputError, match="size applies to a new figure"):
        plot.image(run, ax=flat[0], size=(3, 3))


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"size": (0, 1)}, r"size: expected \(width, height\), each 0.5 to 100 inches"),
        ({"size": 3}, r"size \(width, height\) in inches: expected shape"),
        ({"view": (1, 2, 3)}, r"view \(elevation, azimuth\) in degrees: expected shape"),
        ({"view": [(1, 2)]}, r"view: expected \(elevation, azimuth\) in degrees"),
        ({"bounds": [[0, 0, 0], [1, 0, 1]]}, "bounds: expected the lowest and the highest corner"),
        ({"bounds": [0, 1]}, r"bounds \(lowest, highest\) in metres: expected shape"),
    ],
)
def test_sizes_views_and_bounds_that_are_none_are_refused(settings, told, scene):
    with pytest.raises(rs.errors.InputError, match=told):
        plot.scene(scene, **settings)


def test_sizes_and_titles_are_the_users(scene, run, compared, examined):
    draws = {
        plot.scene: (scene,),
        plot.velocity: (run,),
        plot.joints: (run,),
        plot.run: (run, scene),
        plot.comparison: (compared,),
        plot.diagnosis: (examined,),
        plot.workspace: (rs.kinematics.sample_workspace(RHINO, 50),),
        plot.moments: (scene, [scene.home]),
    }
    for draw, given in draws.items():
        figure = draw(*given, size=(9, 6), title="my own")
        assert (*figure.get_size_inches(), figure.get_suptitle()) == (9, 6, "my own")


# --- all together, and refusals


def test_the_summary_shows_scene_image_velocities_and_error(run, scene):
    figure = plot.run(run, scene)
    solid, image, v, w, e = figure.axes
    path = np.transpose(lines(solid, "path of eye").get_data_3d())
    assert len(path) == run["time"].size + 2  # q0 and q_end are added
    assert image.get_xlabel() == "column (px)"
    labels = [axes.get_ylabel() for axes in (v, w, e)]
    assert labels == ["v (m/s)", "ω (rad/s)", "error (–)"]
    way = float(run["path_length"])
    assert figure.get_suptitle() == f"time limit after 3 s; path {way:.3g} m"


@pytest.mark.full
def test_the_summary_shows_the_camera_and_the_frame_that_are_requested(pair, pair_scene, tmp_path):
    figure = plot.run(pair, pair_scene, "right", "fly.body")
    solid, image, v, _, e = figure.axes
    assert {"left", "right"} <= set(legend(solid))
    np.testing.assert_array_equal(marked(image, "+"), [(400, 300)])
    assert v.get_ylabel() == "v of fly.body\nin world axes (m/s)"
    assert e.get_ylabel() == "error (–, px)"
    figure.savefig(tmp_path / "pair.png")


@pytest.mark.parametrize("draw", [plot.velocity, plot.run, plot.scene])
def test_a_batch_is_refused_where_one_run_is_shown(draw, batch, scene):
    given = {plot.velocity: (batch,), plot.run: (batch, scene), plot.scene: (scene, None, batch)}
    with pytest.raises(
        rs.errors.InputError, match=r"expected one run, got 60: pick one, as in run.isel\(run=0\)"
    ):
        draw(*given[draw])


@pytest.mark.parametrize("draw", [plot.velocity, plot.image])
def test_figures_over_time_refuse_a_summary(draw, scene):
    summary = simulated(scene, scene.home + OFFSET, record="summary")
    with pytest.raises(rs.errors.InputError, match="record='all'"):
        draw(summary)


@pytest.mark.parametrize("draw", [plot.velocity, plot.image])
def test_what_is_no_run_is_refused(draw):
    with pytest.raises(
        rs.errors.InputError, match="expected a run as simulate returns it, got a list"
    ):
        draw([1, 2, 3])


def test_a_scene_is_drawn_at_one_configuration_or_over_a_run_of_its_own(scene, run):
    with pytest.raises(rs.errors.InputError, match="q or run, not both"):
        plot.scene(scene, scene.home, run)
    with pytest.raises(rs.errors.InputError, match=r"one configuration \(5,\), got \(2, 5\)"):
        plot.scene(scene, [scene.home, scene.home])
    other = rs.Scene(rs.Robot.from_dh([[0, 0, 1, 0]], name="arm"))
    with pytest.raises(rs.errors.InputError, match="another scene: its coordinates are shoulder"):
        plot.scene(other, run=run)


@pytest.mark.full
def test_a_run_of_one_moment_can_be_drawn(still, scene, tmp_path):
    figure = plot.run(still, scene)
    figure.savefig(tmp_path / "still.png")
    assert lines(figure.axes[2], "$v_x$").get_marker() == "."
    assert figure.get_suptitle() == "converged after 0 s; path 0 m"


def test_a_start_that_does_not_see_its_target_can_be_drawn(scene, tmp_path):
    blind = simulated(scene, scene.home - np.array([0, 0, 0, 2.0, 0]))
    assert int(blind["outcome"]) == rs.Outcome.BEHIND_CAMERA
    figure = plot.run(blind, scene)
    figure.savefig(tmp_path / "blind.pdf")
    assert figure.get_suptitle().startswith("behind camera after 0 s")


def test_figures_leave_no_trace(scene, run, batch):
    before = dict(matplotlib.rcParams)
    drawn = [plot.scene(scene), plot.image(batch), plot.velocity(run), plot.run(run, scene)]
    assert all(isinstance(figure, Figure) for figure in drawn)
    assert dict(matplotlib.rcParams) == before
    assert plt.get_fignums() == []


def test_drawing_leaves_pyplot_as_it_is(scene, run):
    """A figure drawn first must not switch off what choosing the backend has switched on."""
    with plt.ion():
        figure = plot.run(run, scene)
        assert plt.isinteractive() and plt.get_fignums() == []
        plt.plot([1, 2])  # into a figure of its own
        assert figure.axes != plt.gcf().axes
        plt.close()


@pytest.mark.parametrize("backend", ["agg", "module://matplotlib_inline.backend_inline"])
def test_a_notebook_shows_a_figure_once_as_the_value_of_its_cell(backend, scene, monkeypatch):
    monkeypatch.setattr(plt, "get_backend", lambda: backend)
    figure = plot.scene(scene)
    assert plt.get_fignums() == []  # or the notebook would show it at the end of the cell as well
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_a_backend_chosen_while_drawing_may_switch_to_interactive(scene, monkeypatch):
    """As the backend of a notebook does when pyplot is first used."""
    monkeypatch.setattr(plt, "get_backend", lambda: (plt.ion(), "agg")[1])
    try:
        plot.scene(scene)
        assert plt.isinteractive()
    finally:
        plt.ioff()


def test_where_windows_open_pyplot_shows_the_figure(scene, monkeypatch):
    monkeypatch.setattr(plt, "get_backend", lambda: "QtAgg")
    figure = plot.scene(scene)
    assert [plt.figure(n) for n in plt.get_fignums()] == [figure]
    plt.close(figure)


# --- several schemes beside each other


@pytest.fixture(scope="module")
def compared(scene):
    """Three schemes; one of them is too slow to arrive."""
    tasks = {
        "current": rs.IBVS(scene.home, gain=2),
        "pose": rs.PBVS(scene.home, gain=2),
        "slow": rs.IBVS(scene.home, gain=0.2),
    }
    return rs.compare(scene, tasks, scene.home + OFFSET, duration=8)


def test_each_scheme_has_its_image_with_the_pixels_of_its_run(compared):
    figure = plot.comparison(compared)
    for axes, (name, run) in zip(figure.axes, compared.runs.items(), strict=False):
        pixels = run["pixels"].dropna("time").values
        ways = [line.get_xydata() for line in axes.get_lines()[: pixels.shape[1]]]
        np.testing.assert_array_equal(ways, np.moveaxis(pixels, 1, 0))
        [starts] = [line.get_xydata() for line in asterisks(axes)]
        [goals] = [line.get_xydata() for line in axes.get_lines() if line.get_marker() == "s"]
        np.testing.assert_array_equal(starts, pixels[0])
        np.testing.assert_array_equal(goals, run["pixels_goal"].values)
        assert axes.get_title().startswith(name)
    assert figure.axes[2].get_title() == "slow\ntime limit after 8 s"


def test_the_distance_of_the_farthest_mark_is_drawn_over_time(compared):
    axes = plot.comparison(compared).axes[3]
    assert (axes.get_xlabel(), axes.get_yscale()) == ("time (s)", "log")
    assert axes.get_ylabel() == "farthest feature point from its goal (px)"
    for name, run in compared.runs.items():
        lived = run.dropna("time")
        away = np.linalg.norm(lived["pixels"].values - run["pixels_goal"].values, axis=2).max(
            axis=1
        )
        np.testing.assert_allclose(lines(axes, name).get_xdata(), lived["time"].values)
        np.testing.assert_allclose(lines(axes, name).get_ydata(), away, rtol=1e-12)
    (names,) = axes.figure.legends
    assert [text.get_text() for text in names.get_texts()] == ["current", "pose", "slow"]


def test_measures_are_drawn_as_shares_of_the_largest_and_hollow_where_nothing_converged(compared):
    axes = plot.comparison(compared).axes[4]
    labels = [text.get_text() for text in axes.get_yticklabels()]
    shown = [text.split("\n")[0] for text in labels]
    assert shown[:2] == ["time to converge", "image excursion"] and "angular effort" in shown
    dots = [line for line in axes.get_lines() if line.get_marker() not in ("None", None)]
    values = compared.data["path_length"].values
    row = shown.index("camera path")
    assert labels[row] == f"camera path\n1 = {values.max():.3g} m"
    for dot, value in zip(dots, values, strict=True):
        x, y = dot.get_xydata()[row]
        assert x == pytest.approx(value / values.max()) and abs(y - row) < 0.5
    assert [dot.get_markerfacecolor() == "none" for dot in dots] == [False, False, True]
    assert len({dot.get_marker() for dot in dots}) == len({dot.get_color() for dot in dots}) == 3


def test_the_way_agrees_with_the_camera_in_the_two_axes_of_its_largest_extent(compared):
    axes = plot.comparison(compared).axes[5]
    ways = [run["camera_pose"].dropna("time").values[:, :3, 3] for run in compared.runs.values()]
    spans = np.ptp(np.concatenate(ways), axis=0)
    drawn = sorted(np.argsort(spans)[1:])
    assert [axes.get_xlabel(), axes.get_ylabel()] == [f"{'xyz'[i]} (m)" for i in drawn]
    tracks = [line.get_xydata() for line in axes.get_lines() if len(line.get_xydata()) > 1]
    for track, way in zip(tracks, ways, strict=True):
        np.testing.assert_allclose(track, way[:, drawn], atol=1e-12)
    assert axes.get_aspect() == 1


def test_the_boxes_of_batches_are_the_quartiles_of_converged_runs(scene):
    shares = np.linspace(0.1, 1.2, 12)[:, None]
    tasks = {"current": rs.IBVS(scene.home, gain=2), "slow": rs.IBVS(scene.home, gain=1)}
    found = rs.compare(scene, tasks, scene.home + shares * OFFSET, duration=8)
    figure = plot.comparison(found)
    bars = figure.axes[0].patches
    assert to_hex(bars[0].get_facecolor()) == palette.OUTCOMES[rs.Outcome.CONVERGED][0]
    assert sum(bar.get_width() for bar in bars) == pytest.approx(200)
    arrived = 100 * found.converged().values
    np.testing.assert_allclose([bar.get_width() for bar in bars[:2]], arrived)
    assert figure.axes[1].get_xlabel() == "time to converge (s)"
    for i, box in enumerate(figure.axes[1].patches):
        times = found.data["time"].values[i]
        quartiles = np.quantile(times[np.isfinite(times)], [0.25, 0.75])
        np.testing.assert_allclose(np.unique(box.get_path().vertices[:, 0]), quartiles)
    assert arrived[0] == 100 and 0 < arrived[1] < 100
    assert figure.get_suptitle() == "12 starts; boxes: runs that converged"


def test_an_invalid_comparison_is_refused(run):
    with pytest.raises(rs.errors.InputError, match="expected a Comparison as compare returns it"):
        plot.comparison(run)


@pytest.mark.parametrize("count", [1, 2, 6, 8])
def test_any_number_of_schemes_has_room(scene, count):
    tasks = {f"scheme {i}": rs.IBVS(scene.home, gain=1 + i) for i in range(count)}
    figure = plot.comparison(rs.compare(scene, tasks, scene.home + OFFSET, duration=0.4))
    assert len(figure.axes) == count + 3
    boxes = [axes.get_window_extent() for axes in figure.axes]
    assert min(box.width for box in boxes) > 20


def test_schemes_whose_goal_has_no_image_show_their_relative_error(scene, run):
    given = rs.IBVS(rs.GoalFeatures(run["s_goal"].values))
    found = rs.compare(scene, {"given": given}, scene.home + OFFSET, duration=1)
    axes = plot.comparison(found).axes[1]
    assert axes.get_ylabel() == "error / error at the start"
    norm = found.runs["given"]["error_norm"].values
    np.testing.assert_allclose(lines(axes, "given").get_ydata(), norm / norm[0])


# ---- diagnosis ----


@pytest.fixture(scope="module")
def examined(run):
    return rs.diagnose(run)


def test_a_diagnosis_is_drawn_as_it_is(examined):
    V, condition, stability, border = plot.diagnosis(examined).axes
    time = examined["time"].values
    for axes, names in (
        (V, ["lyapunov"]),
        (condition, ["condition_interaction", "condition_task_jacobian"]),
        (stability, ["stability_motion", "contraction"]),
        (border, ["border_margin"]),
    ):
        for line, name in zip(axes.get_lines(), names, strict=False):
            np.testing.assert_array_equal(line.get_xdata(), time)
            np.testing.assert_array_equal(line.get_ydata(), examined[name])
    assert V.get_yscale() == condition.get_yscale() == "log"


def test_a_diagnosis_shows_its_outcome_and_has_units(examined, run):
    figure = plot.diagnosis(examined)
    assert figure.get_suptitle() == f"time limit after {float(run['end_time']):.3g} s"
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["V (–)", "largest / smallest σ", "eigenvalue", "to the border (px)"]
    assert [axes.get_xlabel() for axes in figure.axes[2:]] == ["time (s)"] * 2


def test_joint_limits_have_an_axis_of_their_own():
    scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    found = rs.diagnose(scenario.run(duration=0.4))
    right = plot.diagnosis(found).axes[4]
    np.testing.assert_array_equal(right.get_lines()[0].get_ydata(), 100 * found["limit_margin"])
    assert right.get_ylabel() == "to a joint limit (% of its range)"
    assert right.get_ylim()[0] == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda found: found.drop_vars("lyapunov"), "it has no lyapunov"),
        (lambda found: found.drop_vars("time"), "it has no time"),
        (lambda found: found.isel(time=0), r"no instants; take some, as in diagnosis\.isel"),
        (lambda found: found.isel(time=slice(0)), "no instants"),
    ],
)
def test_a_diagnosis_that_is_not_whole_is_refused(examined, change, message):
    with pytest.raises(rs.errors.InputError, match=message):
        plot.diagnosis(change(examined))


def test_v_of_features_with_several_units_has_none():
    visp = rs.load_scenario(rs.examples.path("visp_tutorial"))
    task = replace(visp.task, features=["points", "theta_u"])
    run = rs.simulate(visp.scene, task, visp.start, duration=0.4)
    assert plot.diagnosis(rs.diagnose(run)).axes[0].get_ylabel() == "V"


def test_a_diagnosis_of_one_moment_and_of_nothing_known_is_drawn(scene, still):
    assert plot.diagnosis(rs.diagnose(still)).axes[0].get_lines()[0].get_marker() == "."
    both = rs.Priorities([rs.IBVS(), rs.PBVS()])
    found = rs.diagnose(rs.simulate(scene, both, scene.home + OFFSET, duration=0.2))
    assert np.isnan(plot.diagnosis(found).axes[2].get_lines()[0].get_ydata()).all()


@pytest.mark.parametrize("given", [3, [1]])
def test_an_invalid_diagnosis_is_refused(given, run):
    with pytest.raises(
        rs.errors.InputError, match="expected a diagnosis as diagnose returns it, got"
    ):
        plot.diagnosis(given)
    with pytest.raises(rs.errors.InputError, match="got Run"):
        plot.diagnosis(run)


def test_a_scene_beyond_all_measure_is_reported():
    far = rs.Object("far", rs.Block(1, 1, 1), pose=rs.Pose.at(1e31, 0, 0))
    with pytest.raises(rs.errors.InputError, match=r"1e\+31 m wide cannot be drawn"):
        rs.plot.scene(rs.Scene(objects=[rs.Object("near", rs.Block(1, 1, 1)), far]))
