"""Dynamics of robots: closed forms, properties of the equation of motion, batches and errors."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from rigid_trees import draw_inertia, draw_motion, make_tree, separate

import robsim as rs
from robsim.joints import Joint, Link
from robsim.kernels.machine.program import evaluate_stages
from robsim.robot.dynamics_stages import DynamicsStages
from robsim.robot.rigid_bodies import RigidBodies, measure_moments

POINT = np.zeros((3, 3))
TREE = make_tree(5, joints=7)


def pendulum(lengths, masses, armature=0.0):
    """Points on massless rods, which turn about the y axis; q = 0 hangs down."""
    turned = rs.Pose.at(rpy=(np.pi / 2, 0.0, 0.0))
    links = [Link("base")]
    for i, (length, mass) in enumerate(zip(lengths, masses, strict=True)):
        place = turned if not i else rs.Pose.at(y=-lengths[i - 1])
        joint = Joint("revolute", place, armature=armature)
        weight = rs.shapes.Inertia(mass, (0.0, -length, 0.0), POINT)
        links.append(Link(f"rod{i}", links[-1].name, joint, inertia=weight))
    return rs.Robot("pendulum", links)


def test_a_double_pendulum_has_its_closed_form():
    """Craig, Introduction to Robotics, section 6.7, with the angles from the vertical."""
    (l1, l2), (m1, m2), g, J = (0.7, 0.4), (2.0, 3.0), 9.81, 0.3
    robot = pendulum((l1, l2), (m1, m2), armature=J)
    q, v, a = np.array([0.3, -1.1]), np.array([1.5, -0.7]), np.array([0.2, 2.0])
    c, s = np.cos(q[1]), np.sin(q[1])
    far, cross = m2 * l2**2, m2 * l1 * l2
    M = [[(m1 + m2) * l1**2 + far + 2 * cross * c, far + cross * c], [far + cross * c, far]]
    load = m2 * l2 * g * np.sin(q.sum())
    weight = np.array([(m1 + m2) * l1 * g * np.sin(q[0]) + load, load])
    products = cross * s * np.array([-v[1] * (2 * v[0] + v[1]), v[0] ** 2])
    expected = M + J * np.eye(2)
    np.testing.assert_allclose(robot.mass_matrix(q), expected, rtol=1e-14)
    np.testing.assert_allclose(robot.gravity(q), weight, rtol=1e-13)
    tau = expected @ a + products + weight
    np.testing.assert_allclose(robot.inverse_dynamics(q, v, a), tau, rtol=1e-13)
    np.testing.assert_allclose(robot.forward_dynamics(q, v, tau), a, rtol=1e-12)
    energy = -g * ((m1 + m2) * l1 * np.cos(q[0]) + m2 * l2 * np.cos(q.sum()))
    np.testing.assert_allclose(robot.potential_energy(q), energy, rtol=1e-14)


ROBOTS = {
    "tree": TREE,
    "floating": make_tree(6, joints=4, floating=True),
    "mimics": make_tree(7, joints=8, mimics=True),
}


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_forward_dynamics_inverts_inverse_dynamics(robot):
    q, v, a, _ = draw_motion(robot, 0, 20)
    M = robot.mass_matrix(q)
    assert (M.swapaxes(1, 2) == M).all()
    assert (np.linalg.eigvalsh(M) > 0).all()
    tau = robot.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(robot.forward_dynamics(q, v, tau), a, rtol=0, atol=1e-10)
    rest = robot.inverse_dynamics(q, v, 0 * a) + np.einsum("bij,bj->bi", M, a)
    np.testing.assert_allclose(tau, rest, rtol=0, atol=1e-11)
    np.testing.assert_allclose(
        robot.gravity(q), robot.inverse_dynamics(q, 0 * v, 0 * a), atol=1e-12
    )


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
@pytest.mark.few(1)
def test_the_energy_changes_by_the_power_of_the_forces(robot):
    """The power v'tau is the rate of T + V, and v'(dM/dt - 2 C)v = 0 (passivity)."""
    (q,), (v,), _, (tau,) = draw_motion(robot, 1, 1)

    def energies(seconds):
        after = robot.swing(q, v, seconds=seconds, step=seconds, torque=tau)
        return robot.kinetic_energy(after.q, after.v) + robot.potential_energy(after.q)

    rates = [(energies(h)[1] - energies(h)[0]) / h for h in (1e-4, 5e-5)]
    assert 2 * rates[1] - rates[0] == pytest.approx(v @ tau, rel=1e-5)  # Richardson
    h = 1e-5
    ahead, behind = (robot.mass_matrix(robot.integrate(q, v, s)) for s in (h, -h))
    products = robot.inverse_dynamics(q, v, 0 * v, gravity=(0.0, 0.0, 0.0))
    assert v @ (ahead - behind) @ v / (2 * h) == pytest.approx(2 * v @ products, rel=1e-6, abs=1e-6)


def test_gravity_is_the_gradient_of_the_potential_energy():
    (q,), *_ = draw_motion(TREE, 2, 1)
    errors = []
    for h in (1e-3, 5e-4):
        ahead, behind = (TREE.potential_energy(q + s * np.eye(TREE.nq)) for s in (h, -h))
        errors.append(np.abs((ahead - behind) / (2 * h) - TREE.gravity(q)).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=1e-2)


def test_mimicking_joints_move_all_their_bodies():
    robot = ROBOTS["mimics"]
    assert any(link.joint.follows for link in robot.links)
    apart, G, h = separate(robot)
    (q,), (v,), (a,), _ = draw_motion(robot, 3, 1)
    at = G @ q + h
    np.testing.assert_allclose(
        robot.mass_matrix(q), G.T @ apart.mass_matrix(at) @ G, rtol=0, atol=1e-12
    )
    forces = apart.inverse_dynamics(at, G @ v, G @ a)
    np.testing.assert_allclose(robot.inverse_dynamics(q, v, a), G.T @ forces, rtol=0, atol=1e-11)


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_bits_do_not_depend_on_the_batch_or_on_threads(robot):
    q, v, a, tau = draw_motion(robot, 4, 13)
    calls = {
        robot.mass_matrix: (q,),
        robot.gravity: (q,),
        robot.inverse_dynamics: (q, v, a),
        robot.forward_dynamics: (q, v, tau),
        robot.kinetic_energy: (q, v),
        robot.potential_energy: (q,),
    }
    with ThreadPoolExecutor(4) as pool:
        for method, arguments in calls.items():
            batch = method(*arguments)
            rows = list(zip(*arguments, strict=True))
            alone = np.array(list(map(lambda row, call=method: call(*row), rows)))
            assert (batch == alone).all()
            assert (
                np.array(list(pool.map(lambda row, call=method: call(*row), rows))) == alone
            ).all()
    motion = robot.swing(q, v, seconds=0.003, torque=tau[:3])
    one = robot.swing(q[5], v[5], seconds=0.003, torque=tau[:3])
    assert (motion.q[5] == one.q).all()
    assert (motion.v[5] == one.v).all()


def test_leading_axes_are_broadcast_and_lists_are_converted():
    q, v, a, _ = draw_motion(TREE, 5, 6)
    pairs = TREE.inverse_dynamics(q.reshape(2, 3, -1), v[0], a[3:])
    assert pairs.shape == (2, 3, TREE.nv)
    alone = TREE.inverse_dynamics(q[4].tolist(), v[0], a[4][::1])
    assert (pairs[1, 1] == alone).all()
    assert TREE.gravity(q[:0]).shape == (0, TREE.nv)
    assert (TREE.gravity(np.asfortranarray(q)) == TREE.gravity(q)).all()


def test_a_tilted_base_turns_gravity():
    arm = pendulum((0.5,), (2.0,))
    lying = arm.at(rs.Pose.at(rpy=(np.pi / 2, 0.0, 0.0)))
    np.testing.assert_allclose(arm.gravity([0.5]), 0.5 * 2.0 * 9.81 * np.sin(0.5))
    np.testing.assert_allclose(lying.gravity([0.5]), 0.0, atol=1e-14)
    np.testing.assert_allclose(
        lying.gravity([0.5], gravity=(0.0, 9.81, 0.0)), arm.gravity([0.5]), rtol=1e-14
    )


def test_a_payload_is_a_part_of_its_link():
    (q,), *_ = draw_motion(TREE, 6, 1)
    load, pose = draw_inertia(np.random.default_rng(1)), rs.Pose.at(0.1, 0.2, rpy=(1.0, 2.0, 3.0))
    loaded = TREE.with_payload(load, pose)
    tip = next(link for link in TREE.links if link.name == TREE.tip)
    heavier = replace(tip, inertia=tip.inertia + load.at(pose))
    same = replace(TREE, links=tuple(heavier if link is tip else link for link in TREE.links))
    np.testing.assert_allclose(loaded.mass_matrix(q), same.mass_matrix(q), rtol=0, atol=1e-13)
    assert loaded.tip == TREE.tip
    with pytest.raises(rs.errors.InputError, match="has a link 'payload'"):
        loaded.with_payload(1.0)


def test_a_free_body_keeps_its_momentum_and_falls():
    body = Link("body", "base", Joint("floating"), inertia=draw_inertia(np.random.default_rng(2)))
    robot = rs.Robot("body", [Link("base"), body])
    q = np.array([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0])
    v = np.array([0.5, -0.2, 0.1, 2.0, -3.0, 1.0])
    motion = robot.swing(q, v, seconds=1.0)
    energy = robot.kinetic_energy(motion.q, motion.v) + robot.potential_energy(motion.q)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)
    T = robot.fk(motion.q)
    momentum = np.einsum("bij,bj->bi", robot.mass_matrix(motion.q), motion.v)
    linear = np.einsum("bij,bj->bi", T[:, :3, :3], momentum[:, :3])
    fall = body.inertia.mass * np.outer(motion.times, [0.0, 0.0, -9.81])
    np.testing.assert_allclose(linear - fall, np.broadcast_to(linear[0], linear.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(motion.q[:, 3:], axis=1), 1.0, rtol=1e-15)


def test_an_arm_that_swings_for_ten_seconds_keeps_its_energy():
    rng = np.random.default_rng(3)
    for robot, bound in ((rs.robots.ur5e(), 5e-2), (rs.robots.panda(), 1e-2)):
        motion = robot.swing(
            rng.uniform(-1, 1, (8, robot.nq)),
            rng.uniform(-0.5, 0.5, robot.nv),
            seconds=10,
            step=2e-3,
        )
        energy = robot.kinetic_energy(motion.q, motion.v) + robot.potential_energy(motion.q)
        assert np.abs(energy - energy[:, :1]).max() < bound


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_the_motion_has_the_order_of_the_method(robot):
    (q,), (v,), _, (tau,) = draw_motion(robot, 7, 1)
    ends = [
        robot.swing(q, 0.3 * v, seconds=0.08, step=h, torque=0.1 * tau).q[-1]
        for h in (4e-3, 2e-3, 1e-3)
    ]
    first, second = (np.abs(a - b).max() for a, b in pairwise(ends))
    assert first / second == pytest.approx(16.0, rel=0.25)


def test_a_carrier_that_turns_acts_like_a_joint_with_this_motion():
    """Bodies on a turntable: once as a carrier, once on a further joint with a constant speed."""
    turntable = rs.Pose.at(0.3, rpy=(0.4, 0.2, 0.1))
    links = [Link("floor"), Link("table", "floor", Joint("revolute", turntable))]
    others = [replace(link, parent=link.parent or "table") for link in TREE.links]
    robot = rs.Robot("both", [*links, *others])
    q, v, a, _ = draw_motion(robot, 8, 3)
    a[:, 0] = 0.0
    weights = [(link.name, link.inertial) for link in TREE.links]
    bodies = RigidBodies.of(robot.tree, weights, range(1, robot.nv))
    assert bodies.carriers == (1,)

    def add(program, q, v, a, rotation, omega):
        dynamics, tau = DynamicsStages(program, bodies, q), program.rows(bodies.n)
        (carrier,) = dynamics.carriers
        for rows, to in ((rotation, carrier.rotation), (omega, carrier.omega)):
            program.add(rs.kernels.control.control_law.copy_rows, rows=rows, to=to)
        dynamics.place()
        dynamics.add_inverse(v, a, tau)
        return [tau]

    rotation = robot.fk(q, link="table")[:, :3, :3].reshape(3, 9)
    omega = v[:, :1] * [0.0, 0.0, 1.0]
    arrays = [
        np.ascontiguousarray(each.T) for each in (q[:, 1:], v[:, 1:], a[:, 1:], rotation, omega)
    ]
    (tau,) = evaluate_stages(add, arrays, [(bodies.n,)])
    np.testing.assert_allclose(tau.T, robot.inverse_dynamics(q, v, a)[:, 1:], atol=1e-11)


def test_inertias_may_differ_from_run_to_run():
    (q, *_), *_ = draw_motion(TREE, 9, 1)
    weights = [(link.name, link.inertial) for link in TREE.links]
    bodies = RigidBodies.of(TREE.tree, weights)
    body, pose = bodies.locate(TREE.tree, TREE.tip)
    load = draw_inertia(np.random.default_rng(5))
    inertias = np.repeat(bodies.inertias[..., None], 3, axis=2)
    inertias[body, :, 1] += measure_moments(load, pose)
    many = replace(bodies, inertias=inertias)

    def add(program, q):
        dynamics, tau = DynamicsStages(program, many, q), program.rows(many.n)
        dynamics.place()
        dynamics.add_inverse(None, None, tau)
        return [tau]

    (tau,) = evaluate_stages(add, [np.repeat(q[:, None], 3, axis=1)], [(many.n,)])
    assert (tau[:, 0] == TREE.gravity(q)).all()
    np.testing.assert_allclose(tau[:, 1], TREE.with_payload(load).gravity(q), rtol=0, atol=1e-12)


def refuse(call, match):
    with pytest.raises(rs.errors.InputError, match=match):
        call()


def test_robots_without_dynamics_are_refused():
    bare = rs.Robot.from_dh([[0, 0, 1, 0]], name="bare")
    refuse(lambda: bare.gravity([0.0]), "robot 'bare' has no inertias")
    tip = Link("tip", "link6", Joint("revolute"))
    with_tip = replace(TREE, links=(*TREE.links, tip), home=None)
    q = np.zeros(with_tip.nq)
    assert with_tip.gravity(q).shape == (8,)
    refuse(lambda: with_tip.forward_dynamics(q, q, q), r"joint 'tip' moves no inertia.*\('tip'\)")
    refuse(lambda: with_tip.swing(q, seconds=1.0), "joint 'tip' moves no inertia")
    geared = replace(tip, joint=Joint("revolute", armature=0.1))
    moved = replace(TREE, links=(*TREE.links, geared), home=None)
    assert np.isfinite(moved.forward_dynamics(q, q, q)).all()
    refuse(lambda: rs.robots.car().with_payload(1.0).gravity(np.zeros(4)), "on a car joint")
    heavy = rs.robots.scara(), rs.robots.stanford_arm()
    for robot in heavy:
        refuse(lambda r=robot: r.mass_matrix(r.home), rf"'{robot.name}' \(from .*has no inertias")


def test_invalid_numbers_are_refused():
    q, v, a, _ = draw_motion(TREE, 10, 2)
    bad = q.copy()
    bad[1, 2] = np.nan
    refuse(lambda: TREE.gravity(bad), "q: nan")
    refuse(lambda: TREE.inverse_dynamics(q[0], v[0], np.full(7, np.inf)), "a: inf")
    refuse(lambda: TREE.inverse_dynamics(q[0], v[0, :3], a[0]), "v: expected shape")
    refuse(lambda: TREE.inverse_dynamics(q, v, np.zeros((3, 7))), "q and a: batches")
    refuse(lambda: TREE.inverse_dynamics(q, 1e200 * v, a), "not finite")
    refuse(lambda: TREE.gravity(q, gravity=9.81), "gravity: expected")
    refuse(lambda: TREE.swing(q[0], seconds=1.0, step=0.3), "does not divide")
    refuse(lambda: TREE.swing(q[0], seconds=1.0, torque=np.zeros((3, 7))), "torque: expected shape")
    refuse(lambda: TREE.swing(q[0], 5.0 * v[0], seconds=40.0, step=1.0), "step of 1 s: too large")
