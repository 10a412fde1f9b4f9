"""The robot library: its numbers, their sources, its shapes, and access to it."""

import json
import subprocess
import sys
import tomllib
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim import robots
from robsim.robot.dh_row import compute_dh_constants

NAMES = (
    "car",
    "conveyor",
    "differential_drive",
    "free_camera",
    "gantry",
    "holonomic_base",
    "inspection_a",
    "inspection_b",
    "kinova_gen3",
    "lbr_iiwa14",
    "mobile_arm",
    "pan_tilt",
    "panda",
    "planar_2r",
    "planar_3r",
    "puma560",
    "rhino_gripper",
    "rhino_xr4",
    "scara",
    "stanford_arm",
    "turntable",
    "unicycle",
    "ur5e",
)
ARMS = ("rhino_xr4", "puma560", "planar_2r")
DRAWN = (  # their links must hang together
    *(*ARMS, "panda", "mobile_arm", "planar_3r", "stanford_arm", "scara", "ur5e", "lbr_iiwa14"),
    *("kinova_gen3", "gantry"),
)
BELOW = {"planar_2r": -0.14, "planar_3r": -0.085}  # arms in the plane z = 0, on a foot
HANG = "inspection_a", "inspection_b"  # from a cable
ORACLE = Path(__file__).parents[1] / "oracles" / "pinocchio_dh.json"
TABLES = {spec["name"]: spec for spec in json.loads(ORACLE.read_text())["robots"]}


def raw(name):
    return tomllib.loads(robots.file(name).read_text(encoding="utf-8"))


def test_the_robots_are_these():
    assert robots.names() == NAMES
    assert set(NAMES) <= set(dir(robots))
    assert all(robots.load(name).name == name for name in NAMES)
    assert robots.puma560() is robots.load("puma560")


def test_a_robot_that_does_not_exist_names_the_nearest():
    with pytest.raises(rs.errors.InputError, match="did you mean 'puma560'"):
        robots.load("puma56")
    with pytest.raises(AttributeError, match="robots: car, conveyor"):
        _ = robots.puma56


@pytest.mark.parametrize("name", ARMS)
def test_the_table_agrees_with_the_oracle_bit_for_bit(name):
    spec, robot = TABLES[name], robots.load(name)
    assert len(robot.links) == 1 + len(spec["rows"])
    for link, row, letter in zip(robot.links[1:], spec["rows"], spec["joints"], strict=True):
        kind = {"R": "revolute", "P": "prismatic"}[letter]
        place, tail = compute_dh_constants(np.array(row), spec["convention"], letter == "R")
        assert link.joint.kind == kind
        np.testing.assert_array_equal(link.joint.place.matrix, place.matrix)
        np.testing.assert_array_equal(link.joint.tail.matrix, tail.matrix)


@pytest.mark.parametrize("name", ARMS)
def test_poses_agree_with_pinocchio(name):
    cases = TABLES[name]["cases"]
    frames = robots.load(name).frames([case["q"] for case in cases])[:, 1:]
    np.testing.assert_allclose(frames, [case["poses"] for case in cases], rtol=0, atol=1e-12)


def test_the_rhino_at_home_agrees_with_the_table():
    rhino = robots.rhino_xr4()
    T = rhino.fk(rhino.home)
    np.testing.assert_allclose(T[:3, 3], [0.2381, 0, 0.3207], rtol=0, atol=1e-15)
    np.testing.assert_allclose(T[:3, :3], [[0, 1, 0], [1, 0, 0], [0, 0, -1]], rtol=0, atol=1e-15)
    assert [link.name for link in rhino.links] == [
        *("base", "shoulder", "upper_arm", "forearm", "wrist", "tool")
    ]
    travel = np.degrees(rhino.limits[:, 1] - rhino.limits[:, 0])
    np.testing.assert_allclose(travel, [350, 150, 180, 250, 360], rtol=0, atol=1e-9)
    middle = rhino.limits.mean(axis=1)
    np.testing.assert_allclose(middle, rhino.home, rtol=0, atol=1e-12)


def test_the_puma_at_home_looks_straight_down():
    puma = robots.puma560()
    np.testing.assert_allclose(puma.fk(puma.home)[:3, 2], [0, 0, -1], rtol=0, atol=1e-12)
    upper, fore = puma.fk(puma.home, "upper_arm"), puma.fk(puma.home, "wrist_roll")
    assert upper[2, 3] > fore[2, 3] > 0.67183  # elbow up, wrist above the shoulder


def test_the_panda_agrees_with_its_documentation():
    """Ready pose, added up by hand, and limits of the Franka Control Interface."""
    panda, h = robots.panda(), np.sqrt(0.5)
    x = -0.316 * h + 0.0825 * h + 0.384 + 0.088  # upper arm 45 degrees back, forearm level
    z = 0.333 + 0.316 * h + 0.0825 * h + 0.0825 - 0.107
    ready = [[h, -h, 0, x], [-h, -h, 0, 0], [0, 0, -1, z], [0, 0, 0, 1]]
    np.testing.assert_allclose(panda.fk(panda.home), ready, rtol=0, atol=1e-15)
    lowest = [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]
    highest = [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]
    np.testing.assert_array_equal(panda.limits, np.transpose([lowest, highest]))
    assert panda.links[-1].name == "flange"


def test_the_mobile_arm_at_home_looks_straight_down_in_front_of_its_base():
    robot = robots.mobile_arm()
    assert (robot.nq, robot.nv) == (9, 9)
    T = robot.fk(robot.home)
    np.testing.assert_allclose(T[:3, 2], [0, 0, -1], rtol=0, atol=1e-12)
    assert T[0, 3] > 0.29 + 0.2 and T[2, 3] > 0.26  # before the body, above its deck
    assert robot.fk(robot.home, "forearm")[2, 3] > T[2, 3]  # elbow up


FORWARD = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]  # x to the right, y down, z along x of the base


@pytest.mark.parametrize(
    ("name", "link", "where"),
    [
        ("pan_tilt", "head", [0, 0, 0.25]),
        ("holonomic_base", "camera_mount", [0.27, 0, 0.46]),
        ("unicycle", "camera_mount", [0.14, 0, 0.38]),
        ("differential_drive", "camera_mount", [0.03, 0, 0.13]),
        ("car", "camera_mount", [0.2, 0, 0.22]),
    ],
)
def test_a_camera_mounted_on_it_looks_forward(name, link, where):
    robot = robots.load(name)
    T = robot.fk(robot.home, link)
    np.testing.assert_array_equal(T[:3], np.column_stack([FORWARD, where]))


def test_pan_turns_to_the_left_and_tilt_looks_up_about_one_centre():
    head = robots.pan_tilt()
    pan, tilt = np.radians([50, 20])
    T = head.fk([pan, tilt])
    aim = [np.cos(tilt) * np.cos(pan), np.cos(tilt) * np.sin(pan), np.sin(tilt)]
    np.testing.assert_allclose(T[:3, 2], aim, rtol=0, atol=1e-15)
    np.testing.assert_allclose(T[:3, 3], [0, 0, 0.25], rtol=0, atol=1e-15)
    assert T[2, 0] == pytest.approx(0, abs=1e-15)  # the horizon stays level
    np.testing.assert_allclose(np.degrees(head.limits), [[-170, 170], [-85, 85]], atol=1e-12)


def test_the_belt_slides_along_x_and_the_plate_turns_about_z():
    belt, plate = robots.conveyor(), robots.turntable()
    np.testing.assert_array_equal(belt.fk([1.5]), rs.Pose.at(1.5, 0, 0.6).matrix)
    np.testing.assert_array_equal(belt.limits, [[-2, 2]])
    turned = rs.Pose.at(0, 0, 0.15, rpy=(0, 0, 0.7)).matrix
    np.testing.assert_allclose(plate.fk([0.7]), turned, rtol=0, atol=1e-15)
    assert (plate.limits == [-np.inf, np.inf]).all()
    cup = rs.Object("cup", marks=[[0, 0, 0]], on="conveyor.belt")
    scene = rs.Scene([belt], [cup])
    np.testing.assert_array_equal(scene.pose("cup", [-1]).position, [-1, 0, 0.6])


@pytest.mark.parametrize("name", sorted(set(NAMES) - {"free_camera", *HANG}))
def test_each_robot_is_drawn_and_no_wheel_goes_through_the_floor(name):
    robot = robots.load(name)
    frames = robot.frames(robot.home)
    pairs = zip(robot.links, frames, strict=True)
    corners = [shape.at(T).vertices for link, T in pairs for shape in link.shapes]
    lowest = np.concatenate(corners)[:, 2].min()
    assert lowest == pytest.approx(BELOW.get(name, 0), abs=1e-12)


@pytest.mark.parametrize("name", HANG)
def test_the_parts_of_a_robot_on_a_cable_hold_together(name):
    """Closed and with every arm open: no link is drawn apart from the one that carries it."""
    robot, scene = robots.load(name), rs.Scene(robots.load(name))
    links = {link.name: link for link in robot.links}
    wide = [0.08 if n.endswith("lift") else 1.5 for n in robot.coordinate_names]
    arm = [n.endswith(("lift", "swing")) for n in robot.coordinate_names]
    q = np.stack([robot.home, np.where(arm, wide, robot.home)])
    drawn = [link for link in robot.links if link.shapes]
    for link in drawn:
        above = links[link.parent]
        while not above.shapes and above.parent is not None:
            above = links[above.parent]
        if above.shapes:
            assert (
                rs.kinematics.clearance(
                    scene, q, f"{name}.{link.name}", f"{name}.{above.name}"
                ).max()
                < 0
            )
    assert len(drawn) == {"inspection_a": 8, "inspection_b": 13}[name]


@pytest.mark.parametrize("name", HANG)
def test_a_robot_on_a_cable_hangs_below_it(name):
    robot = robots.load(name)
    cable = robot.links[1].joint.curve
    middle = cable.at(cable.length / 2).position
    assert -middle[1] == pytest.approx(1.01, abs=0.005)  # the sag that its file mentions
    hang = dict(zip((k.name for k in robot.links), robot.frames(robot.home), strict=True))
    np.testing.assert_allclose(hang["rear"][:3, 3][[0, 2]], cable.at(3.0).position[:2], atol=1e-15)
    wheels = [link for link in hang if link.endswith("wheel")]
    assert len(wheels) == (2 if name == "inspection_a" else 3)
    for wheel in wheels:
        away = cable.nearest(hang[wheel][:3, 3][[0, 2]])[1]
        assert away == pytest.approx(0.05, abs=1e-12)
        assert hang["centre"][2, 3] < hang[wheel][2, 3] - 0.15


@pytest.mark.parametrize("name", NAMES)
def test_home_is_well_within_the_limits(name):
    robot = robots.load(name)
    low, high = robot.limits.T
    assert (robot.home > low).all() and (robot.home < high).all()


@pytest.mark.parametrize("name", NAMES)
def test_each_kind_of_number_has_a_source(name):
    tables = raw(name)
    words = {key for link in tables["links"] for key in ("dh", "limits", "shapes") if key in link}
    words |= {"home"} & tables.keys()
    said = " ".join(tables["sources"]).lower()
    assert tables["sources"] and all(word in said for word in words), words
    assert robots.about(name) == tables["about"]


def test_the_links_of_the_arms_of_textbooks_are_drawn_in_different_colours():
    for name in ("rhino_xr4", "planar_2r", "planar_3r", "gantry"):
        drawn = [link.shapes for link in robots.load(name).links if link.shapes]
        colors = [{shape.color for shape in shapes} for shapes in drawn]
        assert all(len(own) == 1 for own in colors)
        assert all(a != b for a, b in pairwise(colors))
    assert [len(link.shapes) for link in robots.rhino_xr4().links] == [1, 1, 1, 1, 1, 3]


def spans(link, T, line):
    """The interval (enter, leave) of a line (point, direction) in the boxes around shapes."""
    for shape in link.shapes:
        box = (rs.Pose(T) @ shape.pose).inv()
        point, along = box @ line[0], box.rotation @ line[1]
        half = shape.at(shape.pose.inv()).vertices.max(axis=0) + 1e-9
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far = np.sort([(-half - point) / along, (half - point) / along], axis=0)
        still = np.abs(along) < 1e-12
        near[still] = np.where(np.abs(point[still]) <= half[still], -np.inf, np.inf)
        far[still] = np.inf
        if near.max() <= far.min():
            yield near.max(), far.min()


@pytest.mark.parametrize("name", DRAWN)
def test_the_shapes_of_two_links_meet_on_the_axis_of_their_joint(name):
    robot = robots.load(name)
    frames = robot.frames(robot.home)
    for i, link in enumerate(robot.links[1:], start=1):
        if link.joint.kind != "revolute":
            continue
        axis = frames[i - 1] @ link.joint.place.matrix
        line = axis[:3, 3], axis[:3, 2]
        above = i - 1 if robot.links[i - 1].shapes else i - 2  # a frame of a table has no shape
        gaps = [
            max(a[0], b[0]) - min(a[1], b[1])
            for a in spans(robot.links[above], frames[above], line)
            for b in spans(link, frames[i], line)
        ]
        assert gaps and min(gaps) < 1e-6, (link.name, gaps)


def carriers(robot):
    """Pairs of the links with shapes: one, and the nearest that carries it and has some."""
    links = {link.name: link for link in robot.links}
    for link in robot.links[1:]:
        above = links[link.parent]
        while not above.shapes and above.parent is not None:
            above = links[above.parent]
        if link.shapes and above.shapes:
            yield f"{robot.name}.{link.name}", f"{robot.name}.{above.name}"


@pytest.mark.full
@pytest.mark.parametrize("name", DRAWN)
def test_links_hang_together_however_the_arm_stands(name):
    robot, rng = robots.load(name), np.random.default_rng(3)
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    q = np.vstack([robot.home, rng.uniform(low, high, (60, robot.nq))])
    for link, above in carriers(robot):
        assert rs.kinematics.clearance(rs.Scene(robot), q, link, above).max() < 1e-9, (link, above)


@pytest.mark.parametrize("name", DRAWN)
def test_at_home_no_link_stands_in_another_than_those_it_is_joined_to(name):
    robot = robots.load(name)
    joined, scene = set(carriers(robot)), rs.Scene(robot)
    drawn = [f"{name}.{link.name}" for link in robot.links if link.shapes]
    for one, other in combinations(drawn, 2):
        if (other, one) not in joined:
            assert rs.kinematics.clearance(scene, robot.home, one, other) > -1e-9, (one, other)


def test_no_camera_of_an_example_is_hidden_in_the_robot_that_carries_it():
    for name in rs.examples.names():
        experiment = rs.load_scenario(rs.examples.path(name))
        scene, start = experiment.scene, experiment.start
        q = scene.home if start is None else np.atleast_2d(start)[0]
        for eye in scene.cameras:
            robot = eye.on.split(".")[0]
            shown = [r for r in scene.robots if r.name == robot and any(k.shapes for k in r.links)]
            if eye.camera.body is not None and shown:
                away = rs.kinematics.clearance(
                    scene, scene.coordinates(q, limits=False), eye.name, robot
                )
                assert away > -1e-9, (name, eye.name)


def boxes(link, T):
    """The boxes along the axes of the base around the shapes of a link: (lowest, highest)."""
    corners = [shape.at(T).vertices for shape in link.shapes]
    return [(each.min(axis=0) - 1e-9, each.max(axis=0) + 1e-9) for each in corners]


@pytest.mark.parametrize("name", ["gantry", "stanford_arm", "scara"])
@pytest.mark.parametrize("end", [0, 1])
def test_sliding_parts_stay_in_their_carriers_at_both_ends_of_their_travel(name, end):
    robot = robots.load(name)
    slides = [link.joint.kind == "prismatic" for link in robot.links if link.joint.kind != "fixed"]
    frames = robot.frames(np.where(slides, robot.limits[:, end], robot.home))
    for i, link in enumerate(robot.links):
        if link.joint.kind == "prismatic":
            pairs = [
                (low, high, least, most)
                for low, high in boxes(robot.links[i - 1], frames[i - 1])
                for least, most in boxes(link, frames[i])
            ]
            assert any((a <= d).all() and (c <= b).all() for a, b, c, d in pairs), link.name


def test_new_arms_at_home_agree_with_their_files():
    """Tools that point straight down, levels and homes of the makers, added up by hand."""
    for name in ("ur5e", "lbr_iiwa14", "scara", "gantry"):
        robot = robots.load(name)
        np.testing.assert_allclose(robot.fk(robot.home)[:3, 2], [0, 0, -1], rtol=0, atol=1e-12)
    h = np.sqrt(0.5)
    iiwa = [0.42 * h + 0.4 * h, 0, 0.36 + 0.42 * h - 0.4 * h - 0.126]
    flange = robots.lbr_iiwa14().fk(robots.lbr_iiwa14().home)
    np.testing.assert_allclose(flange[:3, 3], iiwa, rtol=0, atol=1e-12)
    stanford = robots.stanford_arm()
    boom, tool = stanford.fk(stanford.home, "boom"), stanford.fk(stanford.home)
    np.testing.assert_allclose(boom[:3, [2, 3]], [[1, 0.6], [0, 0.154], [0, 0.412]], atol=1e-12)
    np.testing.assert_allclose(tool[:3, 2], [0.5, 0, -np.sqrt(0.75)], atol=1e-12)
    gen3 = robots.kinova_gen3()
    level = gen3.fk(gen3.home)
    np.testing.assert_allclose(level[:3, 2], [1, 0, 0], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(robots.gantry().fk([0.3, -0.2, 0.5])[:3, 3], [0.3, -0.2, 0.5])
    np.testing.assert_allclose(robots.scara().fk(robots.scara().home)[2, 3], 0.877 - 0.1 - 0.2)


def test_limits_of_the_new_arms_agree_with_their_sources():
    ways = {
        "ur5e": [360] * 6,
        "lbr_iiwa14": [170, 120, 170, 120, 170, 120, 175],
        "kinova_gen3": [np.inf, 128.9, np.inf, 147.8, np.inf, 120.3, np.inf],
    }
    for name, degrees in ways.items():
        np.testing.assert_allclose(np.degrees(robots.load(name).limits[:, 1]), degrees, atol=1e-12)
        np.testing.assert_array_equal(
            robots.load(name).limits[:, 0], -robots.load(name).limits[:, 1]
        )
    scara, boom = robots.scara().limits, robots.stanford_arm().limits[2]
    np.testing.assert_allclose(np.degrees(np.diff(scara[[0, 1, 3]])[:, 0]), [300, 294, 554])
    np.testing.assert_allclose([*scara[2], *boom], [0, 0.195, 12 * 0.0254, 50 * 0.0254])


def test_robsim_reads_robots_only_on_demand():
    """`import robsim` and a robot leave the slow libraries alone."""
    code = """
import sys, robsim
slow = {"xarray", "matplotlib", "scipy.linalg", "scipy.stats"}  # numba asks for "scipy" itself
assert not slow & sys.modules.keys(), slow & sys.modules.keys()
robsim.robots.rhino_xr4()
assert not slow & sys.modules.keys(), slow & sys.modules.keys()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_car_agrees_with_the_f1tenth_gym():
    """Wheelbase lf + lr, steering and its rate, and the size that its shapes fill."""
    car = robots.car()
    assert car.links[1].joint.steering == rs.joints.Steering(0.15875 + 0.17145, 0.4189, 3.2)
    front = car.fk(car.home, "front_left")[:3, 3]
    np.testing.assert_allclose(front, [0.3302, 0.1325, 0.055], rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.ptp(corners_of(car), axis=0)[:2], [0.58, 0.31], atol=1e-12)


def test_the_differential_drive_has_the_wheels_of_a_burger():
    robot = robots.differential_drive()
    left, right = (robot.fk(robot.home, f"wheel_{side}") for side in ("left", "right"))
    np.testing.assert_allclose(left[:3, 3] - right[:3, 3], [0, 0.16, 0], rtol=0, atol=1e-15)
    assert left[2, 3] == 0.033 and robot.links[2].joint.follows == rs.joints.Rolling(0.033)
    np.testing.assert_allclose(np.ptp(corners_of(robot), axis=0)[1:], [0.178, 0.192], atol=1e-12)


def corners_of(robot):
    """(V, 3) of all its shapes at home."""
    pairs = zip(robot.links, robot.frames(robot.home), strict=True)
    return np.concatenate([shape.at(T).vertices for link, T in pairs for shape in link.shapes])


MASSES = {  # kg, of all links
    "gantry": 73.572,
    "inspection_a": 26.530,
    "inspection_b": 31.154,
    "kinova_gen3": 8.1885,
    "lbr_iiwa14": 30.61,
    "mobile_arm": 49.611,
    "pan_tilt": 2.2988,
    "panda": 16.691622,
    "planar_2r": 14.0,
    "planar_3r": 3.736,
    "puma560": 23.45,
    "rhino_gripper": 0.11094,
    "rhino_xr4": 8.0693,
    "ur5e": 17.7,
}


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_has_its_mass_or_says_that_it_has_none(name):
    masses = [link.inertial.mass for link in robots.load(name).links if link.inertial]
    assert sum(masses) == pytest.approx(MASSES.get(name, 0.0), rel=1e-3)
    sources = " ".join(raw(name)["sources"])
    word = "Weight: none; " if name not in MASSES else "Weight: the drawn solids"
    assert word in sources or ("Inertias: " in sources and name in MASSES)


def test_every_moving_link_of_an_arm_has_an_inertia():
    """Links that a frame alone makes, such as a row of a table, are not heavy."""
    for name in (*ARMS, "panda", "ur5e", "lbr_iiwa14", "kinova_gen3", "mobile_arm", "gantry"):
        links = [link for link in robots.load(name).links if link.joint.moves]
        assert all(link.inertial is not None for link in links), name


def test_the_puma_has_the_motors_of_its_sources():
    joints = [link.joint for link in robots.puma560().links if link.joint.moves]
    inertias, gears = (
        [200e-6] * 3 + [33e-6] * 3,
        [62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686],
    )
    viscous = [1.48e-3, 0.817e-3, 1.38e-3, 71.2e-6, 82.6e-6, 36.7e-6]
    coulomb = [0.415, 0.0985, 0.1185, 14.05e-3, 11.88e-3, 7.23e-3]
    for joint, J, G, B, f in zip(joints, inertias, gears, viscous, coulomb, strict=True):
        assert joint.armature == pytest.approx(J * G**2, abs=1e-6)
        assert joint.damping == pytest.approx(B * G**2, abs=1e-4)
        assert joint.friction == pytest.approx(f * G, abs=1e-4)
    assert [joint.effort for joint in joints] == [97.6, 186.4, 89.4, 24.2, 20.1, 21.3]
