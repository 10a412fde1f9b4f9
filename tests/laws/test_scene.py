"""Scenes: everything on one tree, unique names, and the view of each camera."""

import numpy as np
import pytest

import robsim as rs

K = [[800, 0, 320], [0, 800, 240], [0, 0, 1]]
CAMERA = rs.Camera(K, size=(640, 480))
DOTS = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
PLANAR = [[0, 0, 1, 0], [0, 0, 1, 0]]


def close(a, b, tolerance=1e-14):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def arm(name="arm", **base):
    return rs.Robot.from_dh(PLANAR, limits=[[-3, 3]] * 2, home=[0.1, 0.2], name=name).at(
        rs.Pose.at(**base)
    )


def slide():
    return rs.Robot(
        "slide",
        [rs.joints.Link("rail"), rs.joints.Link("deck", "rail", rs.joints.Joint("prismatic"))],
    )


@pytest.fixture
def two_arms():
    """Arms at x = 0 and x = 5; dots two metres above the origin; a camera on the first arm."""
    return rs.Scene(
        [arm("left"), arm("right", x=5)],
        [rs.Object("dots", marks=DOTS, pose=rs.Pose.at(0, 0, 2))],
        [rs.MountedCamera("eye", CAMERA, on="left.link2")],
    )


# names


@pytest.mark.parametrize(
    "parts",
    [
        ([arm("a"), arm("a")], [], []),
        ([], [rs.Object("a"), rs.Object("a")], []),
        ([], [], [rs.MountedCamera("a", CAMERA), rs.MountedCamera("a", CAMERA)]),
        ([arm("a")], [rs.Object("a")], []),
        ([], [rs.Object("a")], [rs.MountedCamera("a", CAMERA)]),
    ],
)
def test_names_are_unique_among_everything(parts):
    with pytest.raises(
        rs.errors.InputError, match="two things in the scene are called 'a'; rename one"
    ):
        rs.Scene(*parts)


def test_nothing_else_is_called_world():
    with pytest.raises(rs.errors.InputError, match="two things in the scene are called 'world'"):
        rs.Scene([], [rs.Object("world")])


@pytest.mark.parametrize("name", ["a.b", "", "9", "a b", None])
def test_names_of_objects_and_cameras_are_safe(name):
    for make in (rs.Object, lambda n: rs.MountedCamera(n, CAMERA)):
        with pytest.raises(rs.errors.InputError, match="a name starts with a letter"):
            make(name)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda s: s.robot("lefd"),
            "no robot 'lefd' in the scene; did you mean 'left'? robots: left, right",
        ),
        (lambda s: s.object("dot"), "no object 'dot' in the scene; did you mean 'dots'? objects: "),
        (lambda s: s.camera("x"), "no camera 'x' in the scene; cameras: eye"),
        (lambda s: s.robot(), "name the robot: the scene has 2 (left, right)"),
        (lambda s: s.pose("left.link9"), "no frame 'left.link9'; did you mean 'left.link"),
        (lambda s: s.pose("left"), "frames: world, "),
        (lambda s: s.view(camera="y"), "no camera 'y' in the scene; did you mean 'eye'?"),
        (lambda s: s.view(points="dot"), "no object 'dot' in the scene"),
        (lambda s: s.coordinates({"lefd": [0, 0]}), "no robot 'lefd' in the scene; did you mean"),
        (lambda s: s.replacing(arm("lefd")), "the scene has no robot 'lefd' to replace; did you"),
        (lambda s: s.replacing(rs.Object("eye")), "the scene has no object 'eye' to replace; "),
        (lambda s: s.replacing(rs.Object("cup")), "to replace; objects: dots"),
    ],
)
def test_an_unknown_name_is_reported_with_those_that_exist(two_arms, call, message):
    with pytest.raises(rs.errors.InputError) as caught:
        call(two_arms)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "part",
    [
        rs.Object("cup", on="arm.link3"),
        rs.Object("cup", on="arm"),
        rs.MountedCamera("eye", CAMERA, on="arm.lnk2"),
        arm("second").at(rs.Pose.at(), on="arm.link"),
    ],
)
def test_a_frame_that_does_not_exist_is_an_error_when_the_scene_is_made(part):
    robots = [arm(), part] if isinstance(part, rs.Robot) else [arm()]
    objects = [part] if isinstance(part, rs.Object) else []
    cameras = [part] if isinstance(part, rs.MountedCamera) else []
    with pytest.raises(rs.errors.FrameError) as caught:
        rs.Scene(robots, objects, cameras)
    assert f"stands on '{part.on}', and there is no such frame" in str(caught.value)
    assert "did you mean 'arm." in str(caught.value)


def test_a_frame_that_hangs_in_a_circle_hangs_from_itself():
    a, b = rs.Object("a", on="b"), rs.Object("b", on="a")
    with pytest.raises(rs.errors.FrameError, match="'a' is its own ancestor, through 'b'"):
        rs.Scene([], [a, b])


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((["arm"], [], []), "robots must be a list of Robot"),
        (([], [arm()], []), "objects must be a list of Object"),
        (([], [], [CAMERA]), "cameras must be a list of MountedCamera"),
    ],
)
def test_parts_come_in_their_own_lists(parts, words):
    with pytest.raises(rs.errors.InputError, match=words):
        rs.Scene(*parts)


def test_one_part_needs_no_list():
    scene = rs.Scene(arm(), rs.Object("dots", marks=DOTS), rs.MountedCamera("eye", CAMERA))
    assert (scene.robot().name, scene.object().name, scene.camera().name) == ("arm", "dots", "eye")


# poses


def test_every_frame_stands_where_its_chain_puts_it(two_arms):
    q = np.array([0.3, -0.4, 0.5, 0.6])
    left, right = two_arms.robots
    close(two_arms.pose("left.link2", q), left.fk(q[:2]))
    close(two_arms.pose("right.link1", q), rs.Pose.at(5, 0, 0) @ right.fk(q[2:], "link1"))
    close(two_arms.pose("eye", q), left.fk(q[:2]))
    close(two_arms.pose("dots", q), rs.Pose.at(0, 0, 2))
    close(two_arms.pose("world", q), np.eye(4))
    assert two_arms.pose("eye", q).frames == ("world", "eye")


def test_without_q_the_robots_are_at_home(two_arms):
    close(two_arms.home, [0.1, 0.2, 0.1, 0.2], 0)
    assert two_arms.pose("left.link2") == two_arms.pose("left.link2", [0.1, 0.2, 0.1, 0.2])


def test_poses_join_by_their_names(two_arms):
    T_eye_dots = two_arms.pose("eye").inv() @ two_arms.pose("dots")
    assert T_eye_dots.frames == ("eye", "dots")
    with pytest.raises(rs.errors.FrameError, match="cannot join world<-eye with world<-dots"):
        two_arms.pose("eye") @ two_arms.pose("dots")


def test_objects_stand_on_objects_on_links_on_robots():
    """A slide carries an arm, the arm a tray, the tray a cup, the cup a camera."""
    scene = rs.Scene(
        [arm().at(rs.Pose.at(0, 1, 0), on="slide.deck"), slide()],
        [
            rs.Object("cup", on="tray", pose=rs.Pose.at(0, 0, 0.3)),
            rs.Object("tray", on="arm.link2", pose=rs.Pose.at(0.1, 0, 0)),
        ],
        [rs.MountedCamera("eye", CAMERA, on="cup", pose=rs.Pose.at(rpy=(np.pi, 0, 0)))],
    )
    q = {"arm": [0.3, 0.4], "slide": [0.7]}
    by_hand = (
        rs.Pose.at(0, 0, 0.7)
        @ rs.Pose.at(0, 1, 0)
        @ scene.robot("arm").fk([0.3, 0.4])
        @ rs.Pose.at(0.1, 0, 0.3)
        @ rs.Pose.at(rpy=(np.pi, 0, 0))
    )
    close(scene.pose("eye", q), by_hand)


# coordinates


def test_coordinates_agree_with_the_robots_one_after_the_other(two_arms):
    assert (two_arms.nq, two_arms.nv) == (4, 4)
    names = ("left.link1", "left.link2", "right.link1", "right.link2")
    assert two_arms.coordinate_names == two_arms.velocity_names == names
    assert two_arms.coordinate_units == ("rad",) * 4
    close(two_arms.limits, [[-3, 3]] * 4, 0)
    assert rs.Scene([arm()]).coordinate_names == ("link1", "link2")  # of one robot, its own


def test_robots_may_be_named_and_those_left_out_stay_at_home(two_arms):
    close(two_arms.coordinates({"right": [0.5, 0.6]}), [0.1, 0.2, 0.5, 0.6], 0)
    close(two_arms.coordinates({}), two_arms.home, 0)
    named = two_arms.coordinates({"right": [1, 2], "left": [0, 1]})
    close(named, two_arms.coordinates([0, 1, 1, 2]), 0)


def test_a_batch_for_one_robot_is_a_batch_for_all(two_arms):
    q = two_arms.coordinates({"left": [[0, 0], [1, 1], [2, 2]]})
    close(q, [[0, 0, 0.1, 0.2], [1, 1, 0.1, 0.2], [2, 2, 0.1, 0.2]], 0)


def test_a_floating_robot_among_others_takes_a_pose():
    free = rs.Robot(
        "free",
        [rs.joints.Link("base"), rs.joints.Link("body", "base", rs.joints.Joint("floating"))],
    )
    scene, T = rs.Scene([arm(), free]), rs.Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3))
    close(scene.pose("free.body", {"free": T}), T, 1e-15)
    assert (scene.nq, scene.nv) == (9, 8)


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([0, 0, 0], "q: expected shape (..., 4), got (3,)"),
        ([0, 0, 0, np.nan], "q: nan at index (3,); every number must be finite"),
        ([0, 0, 0, 4], "q: joint 'link2' of 'right' is 4 rad, outside its limits [-3, 3] rad"),
        ({"left": [0, -4]}, "q: joint 'link2' of 'left' is -4 rad, outside its limits [-3, 3] rad"),
        ({"left": [0]}, "q: expected shape (..., 2), got (1,)"),
    ],
)
def test_coordinates_are_checked_robot_by_robot(two_arms, q, words):
    with pytest.raises(rs.errors.InputError) as caught:
        two_arms.coordinates(q)
    assert str(caught.value) == words


# views


def test_a_view_is_pixels_depth_and_visibility():
    """A camera looking down from three metres: its x is the world's x, its y the world's -y."""
    eye = rs.MountedCamera("eye", CAMERA, pose=rs.Pose.at(1, 2, 3, rpy=(np.pi, 0, 0)))
    scene = rs.Scene([], [], [eye])
    points = [[1, 2, 0], [1.3, 2, 0], [1, 2.3, 1], [9, 2, 0], [1, 2, 4]]
    view = scene.view(points=points)
    close(view.pixels[:4], [[320, 240], [400, 240], [320, 120], [320 + 800 * 8 / 3, 240]], 1e-11)
    assert np.isnan(view.pixels[4]).all()
    close(view.depth, [3, 3, 2, 3, -1])
    assert view.visibility.tolist() == [0, 0, 0, 1, 2]


def test_a_camera_on_a_link_sees_by_its_hand_eye_pose(two_arms):
    hand_eye = rs.Pose.at(0.05, 0, 0.1, rpy=(0.1, 0.2, 0.3))
    scene = two_arms.replacing(rs.MountedCamera("eye", CAMERA, "left.link2", hand_eye))
    q = [0.1, 1.2, 0, 0]
    T_w_c, marks = rs.Pose(scene.robot("left").fk(q[:2])) @ hand_eye, DOTS + np.array([0, 0, 2])
    view = scene.view(q)
    close(view.pixels, CAMERA.project(marks, T_w_c), 1e-10)
    close(view.depth, (T_w_c.inv() @ marks)[:, 2])


def test_marks_ride_on_the_link_that_holds_them(two_arms):
    held = rs.Object("dots", marks=DOTS, pose=rs.Pose.at(0, 0, 0.5), on="right.link2")
    scene = two_arms.replacing(held)
    q = [0, 0, 0.3, 0.4]
    marks = rs.Pose.at(5, 0, 0.5) @ scene.robot("right").fk(q[2:]) @ DOTS
    close(scene.view(q).depth, (scene.pose("eye", q).inv() @ marks)[:, 2])
    close(scene.view(q).pixels, scene.view(q, points=marks).pixels, 1e-10)


def test_a_camera_on_another_robot_watches_the_first(two_arms):
    """The camera rides on the right arm, the marks on the left one; each moves its own."""
    scene = two_arms.replacing(
        rs.MountedCamera("eye", CAMERA, "right.link2", rs.Pose.at(0, 0, -2)),
        rs.Object("dots", marks=DOTS, on="left.link2"),
    )
    meeting = {"left": [0, 0], "right": [np.pi, 0]}  # tips at x = 2 and x = 3
    view = scene.view(scene.coordinates(meeting, limits=False))
    close(view.pixels[0], [320 + 800 * 1 / 2, 240], 1e-10)  # one metre along its x, two deep
    close(view.depth, [2, 2, 2])


def test_a_view_of_a_batch_is_a_loop(two_arms):
    q = np.random.default_rng(0).uniform(-1, 1, (2, 3, 4))
    whole = two_arms.view(q)
    assert [a.shape for a in whole] == [(2, 3, 3, 2), (2, 3, 3), (2, 3, 3)]
    for i in np.ndindex(2, 3):
        for a, b in zip(whole, two_arms.view(q[i]), strict=True):
            close(a[i], b, 1e-10)


def test_the_only_object_with_marks_is_the_default_target(two_arms):
    scene = rs.Scene(two_arms.robots, [*two_arms.objects, rs.Object("table")], two_arms.cameras)
    np.testing.assert_array_equal(scene.view().pixels, scene.view(points="dots").pixels)
    other = rs.Object("other", marks=DOTS)
    more = rs.Scene(two_arms.robots, [*two_arms.objects, other], two_arms.cameras)
    with pytest.raises(
        rs.errors.InputError, match=r"name the object: the scene has 2 \(dots, other\)"
    ):
        more.view()


def test_without_marks_the_vertices_of_the_shapes_are_the_marks():
    cube, wheel = rs.Block(0.1, 0.1, 0.1), rs.Wheel(0.1, 0.1, n=5)
    thing = rs.Object("thing", [cube, wheel])
    close(thing.marks, np.concatenate([cube.vertices, wheel.vertices]), 0)
    assert rs.Object("thing", cube).shapes == (cube,)
    assert rs.Object("bare").marks.shape == (0, 3)
    assert rs.Object("chosen", cube, marks=DOTS).marks.tolist() == DOTS.tolist()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: rs.Object("dots", marks=[[0, 0]]), "marks of 'dots': expected shape"),
        (lambda: rs.Object("dots", marks=[0, 0, 0]), "marks of 'dots': expected shape"),
        (lambda: rs.Object("dots", marks=np.zeros((2, 3, 3))), "marks of 'dots': expected shape"),
        (lambda: rs.Object("dots", marks=[[0, 0, np.nan]]), "marks of 'dots': nan at index"),
        (lambda: rs.Object("dots", pose=np.eye(3)), "pose: expected shape"),
        (lambda: rs.MountedCamera("eye", K), "camera 'eye' needs a Camera, got"),
        (lambda: rs.MountedCamera("eye", CAMERA, pose=2 * np.eye(4)), "not a rotation"),
    ],
)
def test_objects_and_cameras_are_checked_by_name(make, words):
    with pytest.raises(rs.errors.InputError, match=words):
        make()


# replacing, display, values


def test_replacing_changes_the_named_part_and_nothing_else(two_arms):
    wide = rs.Camera([[400, 0, 320], [0, 400, 240], [0, 0, 1]])
    belief = two_arms.replacing(rs.MountedCamera("eye", wide, "left.link2"), arm("right", x=6))
    assert belief.camera().camera == wide
    assert belief.robot("right").base.position.tolist() == [6, 0, 0]
    assert belief.robot("left") is two_arms.robot("left")
    assert belief.object() is two_arms.object()
    assert two_arms.camera().camera == CAMERA  # the original stays
    close(belief.view().depth, two_arms.view().depth)
    centre = np.array([320, 240])
    close(belief.view().pixels - centre, (two_arms.view().pixels - centre) / 2, 1e-10)


def test_replacing_nothing_changes_nothing(two_arms):
    q = [0.1, -0.2, 0.3, 0.4]
    assert two_arms.replacing().pose("eye", q) == two_arms.pose("eye", q)


def test_a_replaced_part_must_stand_on_something_too(two_arms):
    with pytest.raises(rs.errors.FrameError, match="'eye' stands on 'middle"):
        two_arms.replacing(rs.MountedCamera("eye", CAMERA, on="middle.link2"))


def test_the_display_frame_is_kept_and_moves_nothing(two_arms):
    """The chapter's gT0 is for the figures only."""
    gT0 = rs.Pose.at(1, 2, 3, rpy=(0.1, 0.2, 0.3))
    parts = two_arms.robots, two_arms.objects, two_arms.cameras
    shown = rs.Scene(*parts, display=gT0.matrix)
    assert shown.display == gT0
    assert shown.replacing(arm("left")).display == gT0
    assert shown.pose("eye") == two_arms.pose("eye")
    np.testing.assert_array_equal(shown.view().pixels, two_arms.view().pixels)
    assert two_arms.display == rs.Pose.at()


def test_a_scene_is_a_value(two_arms):
    with pytest.raises(AttributeError):
        two_arms.robots = ()
    with pytest.raises(ValueError, match="read-only"):
        two_arms.object().marks[0, 0] = 1.0


def test_an_empty_scene_has_a_world():
    scene = rs.Scene()
    assert (scene.nq, scene.nv, scene.limits.shape) == (0, 0, (0, 2))
    assert scene.pose("world").matrix.tolist() == np.eye(4).tolist()
