"""A kind of joint from outside the package can do everything that built-in kinds do."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import robsim as rs
from robsim.declare import register
from robsim.testing import check_joint


@dataclass(frozen=True)
class Helical(rs.joints.JointKind):
    """A screw: one turn about z for `pitch` metres along it."""

    name: ClassVar[str] = "helical"
    coordinates: ClassVar[tuple[str, ...]] = ("",)
    units: ClassVar[tuple[str, ...]] = ("rad",)
    pitch: float

    def motion(self, q):
        T = np.tile(np.eye(4), (len(q), 1, 1))
        c, s = np.cos(q[:, 0]), np.sin(q[:, 0])
        T[:, 0, 0], T[:, 0, 1], T[:, 1, 0], T[:, 1, 1] = c, -s, s, c
        T[:, 2, 3] = self.pitch * q[:, 0] / (2 * np.pi)
        return T

    def twists(self, q):
        return np.tile([0, 0, self.pitch / (2 * np.pi), 0, 0, 1], (len(q), 1, 1))


@dataclass(frozen=True)
class Universal(rs.joints.JointKind):
    """Two axes that meet at right angles: about x, and then about the new y; each within 1 rad."""

    name: ClassVar[str] = "universal"
    coordinates: ClassVar[tuple[str, ...]] = (".bend", ".sway")
    units: ClassVar[tuple[str, ...]] = ("rad", "rad")

    def motion(self, q):
        (ca, cb), (sa, sb) = np.cos(q.T), np.sin(q.T)
        T = np.zeros((len(q), 4, 4))
        T[:, 0, 0], T[:, 0, 2] = cb, sb
        T[:, 1, 0], T[:, 1, 1], T[:, 1, 2] = sa * sb, ca, -sa * cb
        T[:, 2, 0], T[:, 2, 1], T[:, 2, 2] = -ca * sb, sa, ca * cb
        T[:, 3, 3] = 1
        return T

    def twists(self, q):
        V = np.zeros((len(q), 2, 6))
        V[:, 0, 3], V[:, 0, 5] = np.cos(q[:, 1]), np.sin(q[:, 1])  # x before the turn about y
        V[:, 1, 4] = 1
        return V

    def ranges(self, limits, part):
        return np.tile([-1.0, 1.0], (2, 1))


@dataclass(frozen=True)
class Spherical(rs.joints.JointKind):
    """A ball: a unit quaternion, and the angular velocity in the axes of the carried body."""

    name: ClassVar[str] = "spherical"
    coordinates: ClassVar[tuple[str, ...]] = (".qx", ".qy", ".qz", ".qw")
    units: ClassVar[tuple[str, ...]] = ("1",) * 4
    velocities: ClassVar[tuple[str, ...]] = (".wx", ".wy", ".wz")
    rates: ClassVar[tuple[str, ...]] = ("rad/s",) * 3

    def motion(self, q):
        return rs.Pose.from_quaternion(np.zeros(3), q).matrix

    def twists(self, q):
        return np.tile(np.eye(6)[3:], (len(q), 1, 1))

    def integrate(self, q, v, dt):
        turn = rs.Pose.exp(np.concatenate([np.zeros(v.shape), dt * v], axis=1))
        return (rs.Pose.from_quaternion(np.zeros(3), q) @ turn).quaternion

    @property
    def rest(self):
        return np.array([0.0, 0.0, 0.0, 1.0])

    def sample(self, share, home, limits):
        q = 2 * share - 1
        return q / np.linalg.norm(q, axis=1, keepdims=True)


KINDS_OF_OWN = [Helical(0.1), Universal(), Spherical()]
BESIDE = rs.Pose.at(0.1, -0.2, 0.3, rpy=(0.4, -0.2, 0.9))


def arm(kind, limits=None):
    """A joint of a kind between a revolute and a prismatic one, all askew."""
    own = rs.joints.Joint(kind, BESIDE, rs.Pose.at(0.2, 0.1, 0.05, rpy=(-0.3, 0.5, 0.1)), limits)
    slide = rs.joints.Joint(
        "prismatic", rs.Pose.at(0.3, 0, 0, rpy=(0.2, 1.0, 0)), limits=(-0.5, 0.5)
    )
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("turn", "base", rs.joints.Joint("revolute", limits=(-2.0, 2.0))),
        rs.joints.Link("own", "turn", own),
        rs.joints.Link("slide", "own", slide),
    ]
    return rs.Robot("arm", links)


def some_q(robot, runs, seed=0):
    rng = np.random.default_rng(seed)
    kind = robot.links[2].joint.model
    n = len(kind.coordinates)
    q = rng.uniform(-0.5, 0.5, (runs, robot.nq))
    home, limits = robot.home[1 : 1 + n], robot.limits[1 : 1 + n]
    q[:, 1 : 1 + n] = kind.sample(rng.random((runs, n)), home, limits)
    return q


each_kind = pytest.mark.parametrize("kind", KINDS_OF_OWN, ids=lambda kind: kind.name)


@each_kind
def test_its_twists_are_the_derivatives_of_its_motion(kind):
    assert check_joint(kind, bits=True) == []


@each_kind
def test_forward_kinematics_are_products_along_the_chain(kind):
    robot = arm(kind)
    q = some_q(robot, 5)
    n = len(kind.coordinates)
    turn = rs.Pose.exp(q[:, :1] * np.eye(6)[5])
    own = robot.links[2].joint
    there = turn @ own.place @ rs.Pose(kind.motion(q[:, 1 : 1 + n])) @ own.tail
    slid = np.tile(np.eye(4), (5, 1, 1))
    slid[:, 2, 3] = q[:, -1]
    tip = there @ robot.links[3].joint.place @ rs.Pose(slid)
    np.testing.assert_allclose(robot.fk(q, "own"), there.matrix, rtol=0, atol=1e-14)
    np.testing.assert_allclose(robot.fk(q), tip.matrix, rtol=0, atol=1e-14)
    for i in range(5):
        np.testing.assert_array_equal(robot.fk(q)[i], robot.fk(q[i]))
        np.testing.assert_array_equal(robot.jacobian(q)[i], robot.jacobian(q[i]))
    assert robot.frames(q[:0]).shape == (0, 4, 4, 4)


@each_kind
@pytest.mark.parametrize("link", ["own", "slide"])
def test_jacobians_are_derivatives_of_second_order(kind, link):
    robot = arm(kind)
    q, steps = some_q(robot, 1)[0], np.array([0.1, 0.05, 0.025])
    J, errors = robot.jacobian(q, link), []
    for h in steps:
        columns = []
        for v in np.eye(robot.nv):
            ahead, behind = (robot.fk(robot.integrate(q, v, step), link) for step in (h, -h))
            turn = np.eye(4)
            turn[:3, :3] = ahead[:3, :3] @ behind[:3, :3].T
            moved = np.append(ahead[:3, 3] - behind[:3, 3], rs.Pose(turn).rotvec)
            columns.append(moved / (2 * h))
        errors.append(np.abs(np.stack(columns, axis=-1) - J).max())
    assert (np.diff(np.log(errors)) / np.diff(np.log(steps)) >= 1.9).all()
    assert errors[-1] < 1e-3


def test_a_screw_rises_by_its_pitch_in_a_turn():
    robot = rs.Robot(
        "jack",
        [rs.joints.Link("base"), rs.joints.Link("top", "base", rs.joints.Joint(Helical(0.02)))],
    )
    lifted = robot.fk(robot.integrate([0.0], [np.pi], 2.0))
    np.testing.assert_allclose(lifted, rs.Pose.at(0, 0, 0.02).matrix, atol=1e-15)
    rise = [0, 0, 0.02 / (2 * np.pi), 0, 0, 1]
    np.testing.assert_array_equal(robot.jacobian([0.3])[:, 0], rise)


def test_names_units_home_and_limits_agree_with_the_kind():
    universal, ball, screw = arm(Universal()), arm(Spherical()), arm(Helical(0.1), (-7.0, 7.0))
    assert universal.coordinate_names == ("turn", "own.bend", "own.sway", "slide")
    assert universal.velocity_units == ("rad/s", "rad/s", "rad/s", "m/s")
    assert ball.velocity_names[1:4] == ("own.wx", "own.wy", "own.wz")
    np.testing.assert_array_equal(ball.home, [0, 0, 0, 0, 1, 0])
    np.testing.assert_array_equal(universal.limits[1:3], [[-1, 1], [-1, 1]])
    np.testing.assert_array_equal(screw.limits[1], [-7, 7])
    with pytest.raises(
        rs.errors.InputError, match=r"joint 'own.sway' of 'arm' is 1.2 rad, outside"
    ):
        universal.coordinates([0, 0, 1.2, 0])
    with pytest.raises(rs.errors.InputError, match="a universal joint has no limits"):
        rs.joints.Joint(Universal(), limits=(-1, 1))


@each_kind
def test_inverse_kinematics_invert_forward_kinematics(kind):
    robot = arm(kind)
    q = some_q(robot, 20, seed=3)
    found = robot.ik(robot.fk(q), restarts=20)
    assert found.success.all() and found.error.max() < 1e-8
    np.testing.assert_allclose(robot.fk(found.q), robot.fk(q), atol=1e-7)
    assert ((found.q >= robot.limits[:, 0]) & (found.q <= robot.limits[:, 1])).all()
    alone = robot.ik(robot.fk(q[7]), restarts=20)
    np.testing.assert_array_equal(alone.q, found.q[7])


def test_a_chain_of_compiled_kinds_is_searched_with_the_same_bits_in_python(monkeypatch):
    from robsim.robot.tree import Tree

    robot = rs.robots.puma560()
    T = robot.fk(robot.home + np.linspace(-0.5, 0.5, 70)[:, None])
    compiled = robot.ik(T, restarts=5)
    monkeypatch.setattr(Tree, "compiled", property(lambda tree: False))
    stepwise = robot.ik(T, restarts=5)
    for part in ("q", "error", "reason", "iterations", "restarts"):
        np.testing.assert_array_equal(getattr(stepwise, part), getattr(compiled, part))


CAMERA = rs.Camera([[400, 0, 319.5], [0, 400, 239.5], [0, 0, 1]], (640, 480))
MARKS = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.08, 0], [-0.1, 0.1, 0]]


def scene(kind):
    """A camera on the arm, and a plate in front of it at home."""
    robot = arm(kind)
    T = rs.Pose(robot.fk(robot.home))
    plate = rs.Object("plate", marks=MARKS, pose=T @ rs.Pose.at(0, 0, 0.8, rpy=(0.1, 0, 0.2)))
    return rs.Scene([robot], [plate], [rs.MountedCamera("eye", CAMERA, "arm.slide")])


@each_kind
def test_a_servo_task_converges_with_it_alone_and_in_a_batch(kind):
    made = scene(kind)
    v = np.random.default_rng(1).uniform(-0.1, 0.1, (3, made.nv))
    starts = made.robots[0].integrate(made.home, v, 1.0)
    task = rs.IBVS(gain=2.0)
    batch = rs.simulate(made, task, starts, duration=20.0)
    assert (batch.outcome == rs.Outcome.CONVERGED).all()
    alone = rs.simulate(made, task, starts[1], duration=20.0)
    both = np.isfinite(alone.q.values)
    np.testing.assert_array_equal(batch.q.values[1][: len(both)][both], alone.q.values[both])
    assert alone.camera_velocity.values[0] == pytest.approx(body_twist(made, alone))
    assert "is Python code" in batch.attrs["no_scenario"]


def body_twist(made, run):
    """The twist of the camera at the start, by central differences of the pose along qd."""
    robot, q, qd, h = made.robots[0], run.q.values[0], run.qd.values[0], 1e-5
    ahead, behind = (rs.Pose(robot.fk(robot.integrate(q, qd, step))) for step in (h, -h))
    between = (behind.inv() @ ahead).matrix
    turned = (rs.Pose(robot.fk(q)).inv() @ behind).rotation
    omega = turned @ rs.Pose(between).rotvec / (2 * h)
    v = (rs.Pose(robot.fk(q)).rotation.T @ (ahead.position - behind.position)) / (2 * h)
    return np.append(v, omega)


def test_it_is_analysed_and_drawn():
    made, task = (
        scene(Helical(0.1)),
        rs.IBVS(features=[rs.features.FeatureBlock("points", marks=[0, 1])]),
    )
    task = rs.IBVS(features=[rs.features.FeatureBlock("decoupled_moments", components=[0, 1, 2])])
    found = rs.equilibria(made, task, count=10, duration=8.0)
    assert found[0].kind == "goal"
    run = rs.simulate(made, task, made.home + 0.05, duration=2.0)
    assert rs.explain(run, rs.Experiment(made, task), trials=False).what
    assert rs.plot.scene(made, run=run).axes and rs.plot.run(run, made).axes
    work = rs.kinematics.sample_workspace(arm(Universal()), count=50, link="own")
    assert (np.abs(work.q[:, 1:3]) <= 1).all()


def test_nothing_follows_it_but_its_coordinate_may_be_followed():
    ratio, offset = -2.0, 0.1
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("screw", "base", rs.joints.Joint(Helical(0.1))),
        rs.joints.Link(
            "gear",
            "base",
            rs.joints.Joint("revolute", follows=rs.joints.Mimic("screw", ratio, offset)),
        ),
    ]
    robot = rs.Robot("gears", links)
    np.testing.assert_allclose(robot.fk([0.3]), rs.Pose.at(rpy=(0, 0, -0.5)).matrix, atol=1e-15)
    np.testing.assert_array_equal(robot.jacobian([0.3])[:, 0], [0, 0, 0, 0, 0, ratio])
    with pytest.raises(
        rs.errors.InputError,
        match="a helical joint cannot follow others; prismatic, rail, revolute can",
    ):
        rs.joints.Joint(Helical(0.1), follows=rs.joints.Mimic("screw"))
    several = rs.joints.Link("u", "base", rs.joints.Joint(Universal()))
    gear = rs.joints.Link(
        "gear", "base", rs.joints.Joint("revolute", follows=rs.joints.Mimic("u.bend"))
    )
    with pytest.raises(
        rs.errors.InputError, match=r"'gear' must follow one coordinate of one joint"
    ):
        rs.Robot("gears", [rs.joints.Link("base"), several, gear])


def test_robots_with_it_are_values():
    a, b = arm(Helical(0.1)), arm(Helical(0.1))
    assert a == b and hash(a) == hash(b) and a != arm(Helical(0.2))
    assert "own" in str(a) and a.links[2].joint.kind == Helical(0.1)


def test_a_registered_kind_goes_by_its_name():
    register("joint kind")(Universal)
    register("joint kind")(Helical)
    assert rs.joints.Joint("universal").model == Universal()
    assert arm("universal").fk([0.1, 0.2, 0.3, 0.0]).tolist() == (
        arm(Universal()).fk([0.1, 0.2, 0.3, 0.0]).tolist()
    )
    with pytest.raises(
        rs.errors.InputError, match="'helical' has parameters: give the joint Helical"
    ):
        rs.joints.Joint("helical")
    with pytest.raises(
        rs.errors.InputError, match="no joint kind 'helicl'; did you mean 'helical'"
    ):
        rs.joints.Joint("helicl")


def test_an_invalid_kind_is_refused():
    for given, words in (
        (Universal, "no joint kind <class .*; write Universal"),
        (
            "universl",
            "no joint kind 'universl'; did you mean 'unicycle'\\? joint kinds: car, fixed",
        ),
        (3, "no joint kind 3; joint kinds: car, fixed"),
    ):
        with pytest.raises(rs.errors.InputError, match=words):
            rs.joints.Joint(given)
    with pytest.raises(rs.errors.InputError, match="joint kind: expected a class, got 3"):
        register("joint kind")(3)
    with pytest.raises(
        rs.errors.InputError, match="there is a joint kind 'revolute' already: Revolute"
    ):
        register("joint kind")(type("Mine", (Universal,), {"name": "revolute"}))


LACKING = {
    "no name": ({"name": ""}, "Mine.name: expected a word"),
    "a shipped stage": (
        {"fused": rs.joints.Joint("revolute").model.fused},
        "Mine derives from a kind that is compiled; derive from JointKind",
    ),
    "no motion": ({"motion": rs.joints.JointKind.motion}, "Mine.motion is missing"),
    "no coordinates": ({"coordinates": ()}, "expected coordinates and their units, velocities"),
    "a unit too few": ({"units": ("rad",)}, "expected coordinates and their units"),
    "degrees": ({"units": ("deg", "deg")}, "Mine.units: expected rad, m, 1, got 'deg'"),
    "names without a dot": (
        {"coordinates": ("a", "b")},
        "begin with a dot, as in '.roll', got 'a'",
    ),
    "velocities that are no rates": (
        {"velocities": (".w",), "rates": ("rad/s",)},
        r"2 coordinates and 1 velocities need an integrate\(q, v, dt\)",
    ),
}


@pytest.mark.parametrize("changes", LACKING)
def test_a_kind_that_lacks_something_is_refused(changes):
    made, words = LACKING[changes]
    with pytest.raises(rs.errors.InputError, match=words):
        rs.joints.Joint(type("Mine", (Universal,), made)())


def test_a_result_of_another_shape_is_reported():
    kind = type("Mine", (Universal,), {"twists": lambda self, q: np.zeros((len(q), 6))})()
    with pytest.raises(
        rs.errors.InputError, match=r"Mine.twists: expected shape \(1, 2, 6\), got shape"
    ):
        arm(kind).jacobian([0, 0, 0, 0])


def test_a_wrong_kind_is_found_out():
    def flipped(self, q):
        return -Universal.twists(self, q)

    def askew(self, q):
        return 1.1 * Universal.motion(self, q)

    wrong = check_joint(type("Mine", (Universal,), {"twists": flipped})())
    assert len(wrong) == 2 and "velocity '.bend'" in wrong[0] and "the sign is flipped" in wrong[0]
    assert "is not a pose" in check_joint(type("Mine", (Universal,), {"motion": askew})())[0]
