"""The dynamics of published URDF files and of random trees, against Pinocchio and MuJoCo."""

import warnings
from dataclasses import replace
from importlib import metadata

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from pinocchio_models import PinocchioDynamics
from rigid_trees import draw_motion, make_tree, separate

import robsim as rs

FORCES = ("inverse_dynamics", "gravity", "mass_matrix", "kinetic_energy", "potential_energy")
ROUNDING = 1e-12  # relative to the largest number of a result


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)
        return rs.Robot.from_urdf(path)


def compare(robot, theirs, q, v, a, tau):
    """Compare all quantities of a configuration with those of Pinocchio, by name."""
    arguments = {
        "inverse_dynamics": (q, v, a),
        "gravity": (q,),
        "mass_matrix": (q,),
        "kinetic_energy": (q, v),
        "potential_energy": (q,),
    }
    for name in FORCES:
        found, expected = getattr(robot, name)(*arguments[name]), np.asarray(theirs[name])
        scale = np.abs(expected).max()
        if name in ("gravity", "potential_energy"):  # sums of large terms
            scale = max(scale, 9.81 * np.abs(theirs["mass_matrix"]).max())
        bound = ROUNDING * scale
        np.testing.assert_allclose(found, expected, rtol=0, atol=bound, err_msg=name)
    M, force = theirs["mass_matrix"], np.abs(tau - robot.inverse_dynamics(q, v, 0 * v)).max()
    if np.linalg.eigvalsh(M)[0] > 1e-10:
        found, expected = robot.forward_dynamics(q, v, tau), theirs["forward_dynamics"]
        condition = np.linalg.cond(M)
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=max(ROUNDING, 1e-15 * condition) * np.abs(expected).max()
        )
        np.testing.assert_allclose(M @ found, M @ expected, rtol=0, atol=ROUNDING * force)


@pytest.mark.parametrize("first", range(0, 1000, 100))
def test_a_hundred_random_trees_have_the_dynamics_of_pinocchio(first):
    for seed in range(first, first + 100):
        robot = make_tree(seed, joints=1 + seed % 12, floating=seed % 5 == 4)
        (q,), *others = draw_motion(robot, seed, 1)
        others = [each[0] for each in others]
        compare(robot, PinocchioDynamics(robot).evaluate(q, *others), q, *others)


def test_published_robots_have_the_dynamics_of_pinocchio(published, request, pinocchio_reads):
    try:
        robot = read(published)
    except rs.errors.RobSimError:
        pytest.skip("another test shows why the file is refused")
    kinds = {link.joint.kind for link in robot.links if link.joint.moves}
    weighs = any(link.inertial is not None for link in robot.links)
    if not weighs or not kinds <= {"revolute", "prismatic", "floating"}:
        with pytest.raises(rs.errors.InputError, match=r"no inertias|has no dynamics"):
            robot.mass_matrix(robot.home)
        return
    if not kinds:
        assert robot.gravity([]).shape == (0,)
        return
    apart, G, h = separate(robot)
    theirs = pinocchio_reads(published, apart, mimic=False)
    model, data = theirs.model, theirs.data
    own = np.zeros(apart.nv, dtype=int)
    for label, joint in theirs.joints:
        names = (label, *theirs._parts(label))
        columns = [i for i, name in enumerate(apart.velocity_names) if name in names]
        own[columns] = range(joint.idx_v, joint.idx_v + joint.nv)
    (q,), (v,), (a,), (tau,) = draw_motion(apart, 1, 1)
    Q = theirs.at(q).q
    V, A, T = np.zeros((3, model.nv))
    V[own], A[own], T[own] = v, a, tau
    M = pin.crba(model, data, Q)
    M = (np.triu(M) + np.triu(M, 1).T)[np.ix_(own, own)]
    expected = {
        "inverse_dynamics": pin.rnea(model, data, Q, V, A)[own].copy(),
        "gravity": pin.computeGeneralizedGravity(model, data, Q)[own].copy(),
        "mass_matrix": M,
        "forward_dynamics": pin.aba(model, data, Q, V, T)[own].copy(),
        "kinetic_energy": pin.computeKineticEnergy(model, data, Q, V),
        "potential_energy": pin.computePotentialEnergy(model, data, Q),
    }
    compare(apart, expected, q, v, a, tau)
    if robot.nv < apart.nv:
        (q,), (v,), *_ = draw_motion(robot, 2, 1)
        M = G.T @ apart.mass_matrix(G @ q + h) @ G
        np.testing.assert_allclose(robot.mass_matrix(q), M, rtol=0, atol=ROUNDING * np.abs(M).max())


ARMS = ("ur5e", "panda", "lbr_iiwa14", "kinova_gen3", "rhino_xr4", "gantry")


def load_in_mujoco(robot, folder):
    """Return the model of the file that we write, without contacts and limits."""
    robot.to_mjcf(folder / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= flags.mjDSBL_CONTACT | flags.mjDSBL_CONSTRAINT
    model.opt.timestep, model.opt.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_RK4
    model.dof_damping[:] = 0.0
    return model


def read_arm(name):
    """Return a robot of the library, without what resists its motion."""
    robot = rs.robots.load(name)
    free = {"damping": 0.0, "friction": 0.0}
    links = [
        replace(link, joint=replace(link.joint, **free)) if link.joint.moves else link
        for link in robot.links
    ]
    return replace(robot, links=tuple(links))


@pytest.mark.parametrize("name", ARMS)
def test_mujoco_has_the_same_accelerations_and_the_same_motion(name, tmp_path):
    robot = read_arm(name)
    model = load_in_mujoco(robot, tmp_path)
    data, n = mujoco.MjData(model), robot.nv
    rng = np.random.default_rng(1)
    q, v = rng.uniform(-1, 1, n), rng.uniform(-0.5, 0.5, n)
    data.qpos[:], data.qvel[:] = q, v
    tau = rng.uniform(-5, 5, (1000, n)) * np.abs(robot.gravity(q)).max() / 50
    data.qfrc_applied[:] = tau[0]
    mujoco.mj_forward(model, data)
    found = robot.forward_dynamics(q, v, tau[0])
    np.testing.assert_allclose(found, data.qacc, rtol=0, atol=1e-9 * np.abs(found).max())
    theirs = [q]
    for each in tau:
        data.qfrc_applied[:] = each
        mujoco.mj_step(model, data)
        theirs.append(data.qpos.copy())
    ours = robot.swing(q, v, seconds=1.0, torque=tau).q
    np.testing.assert_allclose(ours, np.array(theirs), rtol=0, atol=1e-6)


def test_published_arms_keep_their_energy_for_ten_seconds():
    files, rng = metadata.files("example-robot-data"), np.random.default_rng(3)
    for name, bound in (("ur5_robot", 1e-4), ("panda", 1e-2)):
        path = next(file for file in files if file.match(f"*_description/urdf/{name}.urdf"))
        robot = read(path.locate())
        links = tuple(link for link in robot.links if "finger" not in link.name)
        robot = replace(robot, links=links, tip=links[-1].name, home=None)
        q, v = rng.uniform(-1, 1, (robot.nq, 8)), rng.uniform(-0.5, 0.5, (robot.nv, 8))
        motion = robot.swing(q.T, v.T, seconds=10, step=2e-3)
        energy = robot.kinetic_energy(motion.q, motion.v) + robot.potential_energy(motion.q)
        assert np.abs(energy - energy[:, :1]).max() < bound
