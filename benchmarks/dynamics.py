"""Dynamics of arms beside Pinocchio and MuJoCo, in one process (see README.md).

    python benchmarks/dynamics.py

The robots are URDF files of example-robot-data. Both sides evaluate the same random numbers, in
turns. Single calls are calls from Python, by Pinocchio also. The batch has a thousand
configurations in one call; Pinocchio has no batch, and a loop of single calls is its time. The free
motion is integrated by both Runge-Kutta methods of order 4. Times are processor times, the least of
several turns.
"""

import tempfile
import time
import warnings
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

import robsim as rs

TURNS, ALONE, BATCH, STEPS = 15, 500, 1000, 1000
ROBOTS = {
    "ur5_robot": "*_description/urdf/ur5_robot.urdf",
    "panda": "*_description/urdf/panda.urdf",
    "talos_reduced": "talos_data/robots/talos_reduced.urdf",
}


def read_pair(pattern):
    """A robot without its fingers, and its model of Pinocchio."""
    files = metadata.files("example-robot-data")
    path = str(next(file for file in files if file.match(pattern)).locate())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)
        robot = rs.Robot.from_urdf(path)
    model = pin.buildModelFromUrdf(path)
    fingers = [i for i, name in enumerate(model.names) if "finger" in name]
    links = tuple(link for link in robot.links if "finger" not in link.name)
    robot = replace(robot, links=links, tip=links[-1].name, home=None)
    return robot, pin.buildReducedModel(model, fingers, pin.neutral(model))


def measure(calls, count):
    """Microseconds of each call, the least of several turns."""
    times = np.empty((TURNS, len(calls)))
    for turn in range(TURNS):
        for i, call in enumerate(calls):
            began = time.thread_time_ns()
            for _ in range(count):
                call()
            times[turn, i] = time.thread_time_ns() - began
    return times.min(axis=0) / count / 1e3


def measure_algorithms(robot, model):
    """Rows (name, Pinocchio, alone, batch) in microseconds for a configuration."""
    rng, data = np.random.default_rng(0), model.createData()
    q, v, a = rng.uniform(-1.0, 1.0, (3, BATCH, robot.nv))
    one, Q = (q[0], v[0], a[0]), pin.integrate(model, pin.neutral(model), q[0])
    rows = {
        "RNEA": (lambda: pin.rnea(model, data, Q, *one[1:]), robot.inverse_dynamics, 3),
        "CRBA": (lambda: pin.crba(model, data, Q), robot.mass_matrix, 1),
        "ABA": (lambda: pin.aba(model, data, Q, *one[1:]), robot.forward_dynamics, 3),
    }
    for name, (theirs, ours, count) in rows.items():
        ours(*one[:count])
        peer, alone = measure([theirs, lambda f=ours, n=count: f(*one[:n])], ALONE)
        (batch,) = measure([lambda f=ours, n=count: f(*(q, v, a)[:n])], 1)
        yield name, peer, alone, batch / BATCH


def measure_motion(robot):
    """Microseconds of a step by MuJoCo, alone and in a batch of eight runs."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.xml"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", rs.errors.FileWarning)  # of meshes
            robot.to_mjcf(path)
        model = mujoco.MjModel.from_xml_path(str(path))
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= flags.mjDSBL_CONTACT | flags.mjDSBL_CONSTRAINT
    model.opt.timestep, model.opt.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_RK4
    model.dof_damping[:] = 0.0
    data, q = mujoco.MjData(model), np.full((8, robot.nv), 0.1)
    seconds = STEPS * 1e-3
    calls = (
        lambda: mujoco.mj_step(model, data, STEPS),
        lambda: robot.swing(q[0], seconds=seconds),
        lambda: robot.swing(q, seconds=seconds),
    )
    theirs, alone, batch = measure(calls, 1) / STEPS
    return theirs, alone, batch / 8


def main():
    """Print the table."""
    print("microseconds for a configuration; ratios to Pinocchio's call, and to a step of MuJoCo")
    for name, pattern in ROBOTS.items():
        robot, model = read_pair(pattern)
        rows = [(*row[:1], "Pinocchio", *row[1:]) for row in measure_algorithms(robot, model)]
        rows.append(("RK4 step", "MuJoCo", *measure_motion(robot)))
        for quantity, peer, theirs, alone, batch in rows:
            print(
                f"{name:13s} {robot.nv:2d} joints {quantity:8s}: {peer} {theirs:6.2f}, "
                f"alone {alone:6.2f} ({alone / theirs:.2f}), batch {batch:6.3f} "
                f"({batch / theirs:.3f})"
            )


if __name__ == "__main__":
    main()
