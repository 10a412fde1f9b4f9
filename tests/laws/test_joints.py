"""Rails, coordinates that follow others, wheels that roll: derivatives, and motion without slip."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim import Pose, Robot
from robsim.errors import InputError
from robsim.joints import Chord, Joint, Link, Mimic, Rolling, Steering
from robsim.shapes import curves

steady = settings(derandomize=True, max_examples=20, deadline=None)
seeds = st.integers(0, 2**32)

CABLE = curves.Catenary((0, 0), (30, 2), 30.4)
UPRIGHT = Pose.at(rpy=(np.pi / 2, 0, 0))  # the plane of the curve stands
LEFT, RIGHT = Pose.at(rpy=(-np.pi / 2, 0, 0)), Pose.at(rpy=(np.pi / 2, 0, 0))
WHEEL, SPAN = 0.05, 0.9


def close(a, b, tolerance=1e-12):
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def crawler(curve=CABLE):
    """Hangs from a rail by two wheels, a third between them on a slide, an arm on its body."""
    return Robot(
        "crawler",
        [
            Link("base"),
            Link("rear", "base", Joint("rail", UPRIGHT, curve=curve)),
            Link(
                "rear_wheel",
                "rear",
                Joint("revolute", Pose.at(0, WHEEL, 0), follows=Mimic("rear", -1 / WHEEL)),
            ),
            Link(
                "body",
                "rear",
                Joint(
                    "revolute",
                    Pose.at(0, WHEEL, 0),
                    follows=Chord("rear", SPAN, WHEEL, gives="angle"),
                ),
            ),
            Link(
                "front",
                "base",
                Joint("rail", UPRIGHT, curve=curve, follows=Chord("rear", SPAN, WHEEL)),
            ),
            Link(
                "front_hub",
                "body",
                Joint(
                    "revolute",
                    Pose.at(SPAN, 0, 0),
                    follows=Chord("rear", SPAN, WHEEL, gives="tilt"),
                ),
            ),
            Link("front_wheel", "front_hub", Joint("revolute", follows=Mimic("front", -1 / WHEEL))),
            Link(
                "middle",
                "body",
                Joint(
                    "prismatic",
                    Pose.at(0.3, 0, 0, rpy=(-np.pi / 2, 0, 0)),
                    follows=Chord("rear", SPAN, WHEEL, at=0.3, gives="height"),
                ),
            ),
            Link(
                "touch",
                "base",
                Joint("rail", UPRIGHT, curve=curve, follows=Chord("rear", SPAN, WHEEL, at=0.3)),
            ),
            Link("arm", "body", Joint("revolute", Pose.at(0.4, -0.3, 0.1))),
            Link("eye", "arm", Joint(place=Pose.at(0.2, 0.1, 0, rpy=(0.3, 0.2, 0.1)))),
        ],
    )


def car(wheelbase=0.5, track=0.4, radius=0.1):
    """Rear wheels roll, front wheels are steered by the rule of Ackermann and roll too."""
    half = track / 2
    links = [
        Link("floor"),
        Link("body", "floor", Joint("car", steering=Steering(wheelbase, 0.6, 2.0))),
    ]
    for name, y in (("left", half), ("right", -half)):
        links += [
            Link(
                f"rear_{name}",
                "body",
                Joint("revolute", Pose.at(0, y, radius) @ LEFT, follows=Rolling(radius)),
            ),
            Link(
                f"knuckle_{name}",
                "body",
                Joint(
                    "revolute",
                    Pose.at(wheelbase, y, radius),
                    follows=rs.joints.Ackermann("body.steering"),
                ),
            ),
            Link(
                f"front_{name}",
                f"knuckle_{name}",
                Joint("revolute", RIGHT, follows=Rolling(radius)),
            ),
        ]
    return Robot("car", links)


def differential_drive(base=0.3, radius=0.1):
    wheels = [
        Link(
            f"wheel_{name}",
            "body",
            Joint("revolute", Pose.at(0, y, radius) @ turned, follows=Rolling(radius)),
        )
        for name, y, turned in (("left", base / 2, LEFT), ("right", -base / 2, RIGHT))
    ]
    return Robot("cart", [Link("floor"), Link("body", "floor", Joint("unicycle")), *wheels])


def gripper():
    across = Pose.at(rpy=(0, np.pi / 2, 0))
    return Robot(
        "gripper",
        [
            Link("palm"),
            Link("finger_left", "palm", Joint("prismatic", across, limits=(0.0, 0.05))),
            Link(
                "finger_right",
                "palm",
                Joint("prismatic", across, limits=(-0.04, 0.0), follows=Mimic("finger_left", -1)),
            ),
        ],
    )


# derivatives


def slope_of(robot, link, q, v):
    """Twist of a link by central differences, and the order of their convergence."""
    twists = []
    for step in (1e-2, 5e-3):
        ahead, behind = (robot.fk(robot.integrate(q, v, h), link) for h in (step, -step))
        R = robot.fk(q, link)[:3, :3]
        turn = Pose(_rigid(R.T @ ahead[:3, :3])).rotvec - Pose(_rigid(R.T @ behind[:3, :3])).rotvec
        twists.append(np.r_[ahead[:3, 3] - behind[:3, 3], R @ turn] / (2 * step))
    return twists


def _rigid(R):
    T = np.eye(4)
    T[:3, :3] = R
    return T


ROBOTS = {
    "crawler": (crawler, [[7.0, 0.3], [21.0, -1.0]], [[0.5, 0.7], [-0.3, 0.2]]),
    "on an arc": (lambda: crawler(curves.Arc(3.0, -2.0)), [[1.0, 0.3]], [[0.5, 0.7]]),
    "cart": (differential_drive, [[0.3, -0.2, 0.7, 0.1, 0.2]], [[0.5, 0.7], [0.0, 1.0]]),
    "gripper": (gripper, [[0.02]], [[0.1]]),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_the_jacobian_is_the_derivative_to_second_order(name):
    make, qs, vs = ROBOTS[name]
    robot = make()
    for q in qs:
        for v in vs:
            for link in robot.links[1:]:
                exact = robot.jacobian(q, link.name) @ v
                coarse, fine = (np.abs(t - exact).max() for t in slope_of(robot, link.name, q, v))
                assert fine < 2e-4
                assert coarse < 2e-10 or 3.5 < coarse / fine < 4.5


def test_the_jacobian_of_a_car_is_the_derivative_along_the_arc_that_it_drives():
    robot, q = car(), np.zeros(8)
    q[2:4] = 0.4, 0.3
    v = np.array([0.7, 0.7 * np.tan(0.3) / 0.5])
    for link in robot.links[1:]:
        exact = robot.jacobian(q, link.name) @ v
        coarse, fine = (np.abs(t - exact).max() for t in slope_of(robot, link.name, q, v))
        assert coarse < 2e-10 or 3.5 < coarse / fine < 4.5


def test_a_batch_gives_the_same_bits_as_each_run_alone():
    robot, rng = crawler(), np.random.default_rng(3)
    q = np.column_stack([rng.uniform(0, 29, 40), rng.normal(size=40)])
    whole = robot.frames(q), robot.jacobian(q), robot.integrate(q, q, 0.1)
    for i in range(0, 40, 7):
        alone = robot.frames(q[i]), robot.jacobian(q[i]), robot.integrate(q[i], q[i], 0.1)
        for mine, all_of_them in zip(alone, whole, strict=True):
            np.testing.assert_array_equal(mine, all_of_them[i])


def both(first, second):
    """Two robots in one scene, the second on the first; q and v of both, and their frames."""
    base = Pose.at(0.3, -0.2, 0.5, rpy=(0.1, 0.2, 0.3))
    one, other = first.named("one"), second.named("other").at(base, on=f"one.{first.tip}")
    return rs.Scene([one, other])


def test_in_a_scene_joints_follow_joints_of_their_own_robot():
    """Names get the prefix of the robot; poses are products, and Jacobians derivatives."""
    scene = both(crawler(), crawler(curves.Arc(3.0, -2.0)))
    q, v = np.array([[7.0], [0.3], [1.0], [-0.4]]), np.array([[0.5], [0.7], [0.4], [-0.3]])
    one, other = scene.robots
    T = one.fk(q[:2, 0]) @ other.base.matrix @ other.fk(q[2:, 0], "middle")
    close(scene.pose("other.middle", q[:, 0]).matrix, T)
    J = scene.tree.jacobian(scene.tree.bodies(q), "other.middle")[..., 0] @ v[:, 0]
    errors = []
    for step in (1e-2, 5e-3):
        moved = [scene.pose("other.middle", (q + h * v)[:, 0]).position for h in (step, -step)]
        errors.append(np.abs((moved[0] - moved[1]) / (2 * step) - J[:3]).max())
    assert 3.5 < errors[0] / errors[1] < 4.5 and errors[1] < 1e-3


def test_a_link_may_be_called_steering():
    """In a scene its coordinate is "robot.steering", and still no steering angle."""
    links = [
        Link("base"),
        Link("steering", "base", Joint("revolute", tail=Pose.at(1, 0, 0))),
        Link("b", "base", Joint("revolute", tail=Pose.at(0, 1, 0), follows=Mimic("steering", -2))),
    ]
    robot = Robot("column", links)
    tree = rs.Scene([robot]).tree
    J = tree.jacobian(tree.bodies(np.array([[0.3]])), "column.b")[..., 0]
    np.testing.assert_array_equal(J, robot.jacobian([0.3], "b"))
    assert J[5, 0] == -2.0
    with pytest.raises(InputError, match="must follow the steering angle of a car"):
        knuckle = Link("k", "b", Joint("revolute", follows=rs.joints.Ackermann("steering")))
        rs.Scene([Robot("column", [*links, knuckle])])


def test_followers_are_found_in_any_order():
    names = ["d", "a", "c", "b"]  # a is followed by b, b by c, c by d
    links = [Link("base"), Link("root", "base", Joint("revolute"))]
    for name in names:
        of = {"a": "root", "b": "a", "c": "b", "d": "c"}[name]
        links.append(Link(name, "base", Joint("revolute", follows=Mimic(of, -0.5, 0.1))))
    angles = {
        name: Pose(T).rotvec[2]
        for name, T in zip(
            [link.name for link in links], Robot("r", links).frames([0.8]), strict=True
        )
    }
    expected = 0.8
    for name in "abcd":
        expected = 0.1 - 0.5 * expected
        assert angles[name] == pytest.approx(expected, abs=1e-15)


# wheels


def slip(robot, q, v, wheel, down, radius):
    """Velocity of the point of a wheel that touches, `down` from its hub."""
    twist = robot.jacobian(q, wheel) @ v
    return twist[:3] + np.cross(twist[3:], radius * np.asarray(down))


@steady
@given(seeds)
def test_no_wheel_of_a_vehicle_slips_along_or_aside(seed):
    rng = np.random.default_rng(seed)
    cart, q, v = differential_drive(), rng.normal(size=5), rng.normal(size=2)
    for wheel in ("wheel_left", "wheel_right"):
        close(slip(cart, q, v, wheel, [0, 0, -1], 0.1), 0, 1e-14)
    robot, q = car(), rng.normal(size=8)
    q[3] = rng.uniform(-0.6, 0.6)
    v = rng.normal() * np.array([1.0, np.tan(q[3]) / 0.5])
    for wheel in ("rear_left", "rear_right", "front_left", "front_right"):
        close(slip(robot, q, v, wheel, [0, 0, -1], 0.1), 0, 1e-14)


@pytest.mark.parametrize("x", [-0.3, 0.2, 0.5, 0.9])
def test_a_steered_wheel_may_be_anywhere_on_its_car(x):
    steered = rs.joints.Ackermann("body.steering")
    links = [
        Link("floor"),
        Link("body", "floor", Joint("car", steering=Steering(0.5, 0.6, 2.0))),
        Link("k", "body", Joint("revolute", Pose.at(x, 0.2), follows=steered)),
        Link("wheel", "k", Joint("revolute", LEFT, follows=Rolling(0.1))),
    ]
    robot, q = Robot("truck", links), [0.3, -0.1, 0.7, 0.4, 0.2]
    v = 0.8 * np.array([1.0, np.tan(0.4) / 0.5])
    close(slip(robot, q, v, "wheel", [0, 0, -1], 0.1), 0, 1e-15)


@steady
@given(st.floats(0.1, 29), st.floats(-2, 2))
def test_no_wheel_on_a_cable_slips(s, speed):
    robot, q = crawler(), [s, 0.0]
    frames = dict(zip([link.name for link in robot.links], robot.frames(q), strict=True))
    for wheel, touch in (("rear_wheel", "rear"), ("front_wheel", "front")):
        down = frames[touch][:3, 3] - frames[wheel][:3, 3]
        close(np.linalg.norm(down), WHEEL, 1e-14)
        close(slip(robot, q, [speed, 0.0], wheel, down / WHEEL, WHEEL), 0, 1e-13)


@steady
@given(seeds)
def test_wheels_of_a_vehicle_turn_by_the_way_of_their_hubs(seed):
    """Along one arc the hubs go constant ways; the sum over many arcs is theirs."""
    rng = np.random.default_rng(seed)
    cart, q = differential_drive(), np.zeros(5)
    ways = np.zeros(2)
    for _ in range(10):
        v = rng.normal(size=2)
        q = cart.integrate(q, v, 0.1)
        ways += 0.1 * (v[0] + np.array([-0.15, 0.15]) * v[1])
    close(q[3:], ways / 0.1 * np.array([1, -1]), 1e-12)  # the right axle points the other way
    assert cart.velocity_names == ("body.v", "body.omega")


def test_two_wheels_and_a_third_between_them_stay_on_the_cable():
    robot = crawler()
    names = [link.name for link in robot.links]
    for s in np.linspace(0, 29.4, 50):
        frames = robot.frames([s, 0.2])
        places = {name: frames[i][:3, 3] for i, name in enumerate(names)}
        close(np.linalg.norm(places["front_wheel"] - places["rear_wheel"]), SPAN)
        for hub in ("rear_wheel", "front_wheel", "middle"):
            away = CABLE.nearest(places[hub][[0, 2]])[1]
            close(away, WHEEL, 1e-12)


# steering


def test_a_car_steers_at_its_rate_and_then_holds_an_arc():
    robot, q, dt = car(), np.zeros(8), 0.05
    wanted = np.arctan(0.5 * 1.0 / 1.0)
    for _ in range(3):
        before = q
        q = robot.integrate(q, [1.0, 1.0], dt)
        assert q[3] == pytest.approx(min(before[3] + 2.0 * dt, wanted), abs=1e-15)
        turn = np.tan(q[3]) / 0.5 * dt  # of an arc with the angle that it has now
        assert q[2] - before[2] == pytest.approx(turn, abs=1e-15)
        chord = np.hypot(*(q[:2] - before[:2]))
        assert chord == pytest.approx(2 * np.sin(turn / 2) / (turn / dt), abs=1e-14)


def test_a_car_keeps_within_its_steering_angle_backs_up_and_stands():
    robot = car()
    q = robot.integrate(np.zeros(8), [1.0, 9.0], 1.0)
    assert q[3] == 0.6
    back = robot.integrate(np.zeros(8), [-1.0, 0.5], 1.0)  # turns left by steering right
    assert back[3] == pytest.approx(-np.arctan(0.25), abs=1e-15) and back[2] == pytest.approx(0.5)
    stands = robot.integrate(q, [0.0, 1.0], 1.0)
    np.testing.assert_array_equal(stands, q)


# limits, names, mistakes


def test_a_coordinate_that_is_mimicked_keeps_both_within_their_limits():
    np.testing.assert_allclose(gripper().limits, [[0.0, 0.04]])
    with pytest.raises(InputError, match=r"outside its limits \[0, 0.04\] m"):
        gripper().coordinates([0.045])


def test_limits_of_mimics_hold_through_all_joints_that_they_mimic():
    links = [
        Link("base"),
        Link("a", "base", Joint("prismatic", limits=(-1.0, 1.0))),
        Link("b", "base", Joint("prismatic", follows=Mimic("a", -2.0, 0.1))),
        Link("c", "base", Joint("prismatic", limits=[-0.5, 0.9], follows=Mimic("b", 0.5, 0.2))),
    ]
    close(Robot("r", links).limits, [[-0.65, 0.75]], 1e-15)  # c = 0.25 - a
    assert links[3].joint == Joint("prismatic", limits=(-0.5, 0.9), follows=links[3].joint.follows)


def test_a_rail_has_the_limits_of_its_curve_and_goes_on_straight_beyond():
    robot = Robot("cart", [Link("floor"), Link("car", "floor", Joint("rail", curve=CABLE))])
    np.testing.assert_array_equal(robot.limits, [[0.0, 30.4]])
    end, beyond = robot.fk([30.4]), robot.fk([31.4])
    close(beyond[:3, 3], end[:3, 3] + end[:3, 0])
    assert robot.coordinate_units == ("m",) and robot.velocity_units == ("m/s",)


def test_a_rounded_polyline_is_smooth_and_as_long_as_its_parts():
    way = curves.Polyline([(0, 0), (2, 0), (2, 2), (4, 3)], radius=0.3)
    s = np.linspace(0, way.length, 2001)
    T = way.at(s)
    steps = np.diff(T.position, axis=-2)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), way.length / 2000, rtol=5e-6)
    angles = np.unwrap(np.arctan2(T.rotation[:, 1, 0], T.rotation[:, 0, 0]))
    assert np.abs(np.diff(angles)).max() <= way.length / 2000 / 0.3 + 1e-12
    close(T.position[-1], [4, 3, 0])


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Joint("rail"), "a rail joint needs a curve"),
        (lambda: Joint("revolute", curve=CABLE), "a revolute joint has no curve"),
        (lambda: Joint("car"), "a car joint needs a steering"),
        (lambda: Joint("planar", follows=Mimic("a")), "cannot follow others"),
        (lambda: Joint("prismatic", follows=Rolling(0.1)), "Rolling gives an angle"),
        (lambda: Joint("revolute", follows=Chord("a", 1.0)), "Chord gives a length"),
        (lambda: Chord("a", 1.0, at=2.0), "must not exceed its length"),
        (lambda: Chord("a", 1.0, gives="angel"), "did you mean 'angle'"),
        (lambda: Mimic("a", np.nan), "must be finite"),
        (lambda: Steering(0.5, limit=2.0), "below a right angle"),
        (lambda: curves.Catenary((0, 0), (3, 4), 5.0), "does not hang between points 5 m apart"),
        (lambda: curves.Catenary((3, 0), (0, 0), 5.0), "goes to larger x"),
        (lambda: curves.Polyline([(0, 0), (1, 0), (1, 1)], 2.0), "do not fit between points"),
        (lambda: curves.Polyline([(0, 0), (0, 0)], 1.0), "are equal"),
        (lambda: curves.Arc(1.0, 0.0), "must not be 0"),
        (lambda: curves.Line(-1.0), "must be a positive number"),
        (lambda: curves.Catenary((0, 0), (1, 0), 1e200), "too large or too small"),
        (lambda: curves.Catenary((0, 0), (1e-200, -1), 2.0), "too large or too small"),
        (lambda: curves.Polyline([(-1e308, 0), (1e308, 0)], 0.1), "too large or too small"),
        (lambda: curves.Arc(1e-320, 1.0), "too large or too small"),
        (lambda: curves.Polyline([(0, 0), (1, 0), (0, 0)], 0.01), "do not fit between points"),
        (
            lambda: Joint("revolute", limits=(0, 1), follows=Chord("a", 1.0, gives="angle")),
            "limits of a joint that follows by Chord are not checked: limit 'a'",
        ),
        (lambda: Steering(0.5).rates([1, 2], [0.1, 0.2, 0.3]), "batches of unequal shapes"),
    ],
)
def test_a_joint_or_curve_that_cannot_be_is_refused(make, told):
    with pytest.raises(InputError, match=told):
        make()


def hung(curve, chord):
    return Robot(
        "r",
        [
            Link("a"),
            Link("s", "a", Joint("rail", curve=curve)),
            Link("b", "s", Joint("revolute", follows=chord)),
            Link("t", "a", Joint("rail", curve=curve, follows=replace(chord, gives="arc"))),
        ],
    )


@pytest.mark.parametrize(
    ("curve", "chord", "told"),
    [
        (curves.Arc(0.1, 60 * np.pi), (0.2, 0.0), "chord of 0.2 m does not fit on a circle of"),
        (curves.Arc(0.2, -4.0), (0.3, -0.06), "does not fit on a circle of radius 0.2 m"),
        (curves.Arc(0.1, 1.0), (0.05, 0.1), "wheel of radius 0.1 m does not fit into a bend"),
        (curves.Catenary((0, 0), (1, 0), 9.0), (0.5, 0.2), "wheel of radius 0.2 m does not fit"),
    ],
)
def test_a_chord_that_does_not_fit_is_refused(curve, chord, told):
    length, radius = chord
    with pytest.raises(InputError, match=told):
        hung(curve, Chord("s", length, radius, gives="angle"))


@pytest.mark.parametrize(
    ("curve", "chord"),
    [
        (curves.Arc(0.1, 60 * np.pi), (0.199, 0.0)),
        (curves.Arc(0.2, -4.0), (0.3, 0.06)),
        (curves.Catenary((0, 0), (1, 0), 9.0), (0.5, -0.2)),
        (curves.Line(1.0), (3.0, 0.5)),
        (curves.Polyline([(0.001 * i, 0.2 * (i % 2)) for i in range(400)], 4e-4), (0.3, 0.0)),
    ],
)
def test_a_chord_is_found_wherever_its_wheels_are(curve, chord):
    """Also beyond the ends, and on a curve that goes to and fro many times before it is so far."""
    length, radius = chord
    robot = hung(curve, Chord("s", length, radius, gives="angle"))
    for s in (-5.0, 0.0, 0.3 * curve.length, curve.length, curve.length + 5.0):
        T, T_s, T_t = (robot.fk([s], link) for link in "bst")
        first, second = (touch[:3, 3] + radius * touch[:3, 1] for touch in (T_s, T_t))
        close(first + length * T[:3, 0], second, 1e-12)
        assert np.isfinite(robot.jacobian([s])).all()


def linked(joint, *more):
    return Robot("r", [Link("a"), Link("b", "a", joint), *more])


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (
            lambda: linked(
                Joint("revolute", follows=Mimic("d")), Link("c", "a", Joint("revolute"))
            ),
            "follows 'd', which does not exist",
        ),
        (lambda: linked(Joint("revolute", follows=Mimic("b"))), "'b' follows itself"),
        (lambda: linked(Joint("revolute", follows=Rolling(0.1))), "stands on no vehicle"),
        (
            lambda: linked(
                Joint("planar"), Link("c", "b", Joint("revolute", follows=Rolling(0.1)))
            ),
            "stands on no vehicle",
        ),
        (
            lambda: linked(
                Joint("unicycle"), Link("c", "b", Joint("revolute", follows=Rolling(0.1)))
            ),
            "must lie across its vehicle",
        ),
        (
            lambda: linked(
                Joint("planar"), Link("c", "b", Joint("revolute", follows=Mimic("b.x")))
            ),
            "must follow one coordinate of one joint",
        ),
        (
            lambda: linked(
                Joint("prismatic"), Link("c", "b", Joint("prismatic", follows=Chord("b", 1.0)))
            ),
            "must follow a rail",
        ),
        (
            lambda: linked(
                Joint("revolute"),
                Link("c", "b", Joint("revolute")),
                Link("d", "b", Joint("revolute", name="c", follows=Mimic("b"))),
            ),
            "two coordinates are called 'c'",
        ),
        (
            lambda: linked(
                Joint("revolute"),
                Link("c", "b", Joint("revolute", name="e", follows=Mimic("b"))),
                Link("d", "b", Joint("revolute", name="e", follows=Mimic("b", 2.0))),
            ),
            "two coordinates are called 'e'",
        ),
        (
            lambda: linked(
                Joint("car", steering=Steering(0.5)),
                Link("c", "b", Joint("prismatic", follows=Mimic("b.steering"))),
                Link("d", "c", Joint("revolute", LEFT, follows=Rolling(0.1))),
            ),
            "its steering joint must turn about the vertical",
        ),
        (
            lambda: linked(
                Joint("rail", curve=CABLE),
                Link("c", "b", Joint("revolute", follows=Chord("b", 1.0, gives="angle"))),
                Link("d", "b", Joint("revolute", limits=(0, 1), follows=Mimic("c"))),
            ),
            "limits of 'd' are not checked, because 'c' follows by Chord: limit 'b'",
        ),
    ],
)
def test_a_follower_of_an_impossible_leader_is_refused(make, told):
    with pytest.raises(InputError, match=told):
        _ = make().tree
