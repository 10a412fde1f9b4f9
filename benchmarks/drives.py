"""The loop with drives: microseconds a run and step, beside MuJoCo's step in the same process.

    python benchmarks/drives.py                   # six joints, ten sub-steps of 1 ms in a period
    python benchmarks/drives.py --robot panda --runs 1024

The servo loop of a camera in the hand runs without drives and with each kind of drive, alone and in
a batch on one thread. The peer integrates the same arm, written by `Robot.to_mjcf`, by ten steps of
1 ms without contacts. Times are CPU times, the least of several rounds.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import robsim as rs

DRIVES = {
    "no drive": None,
    "velocity loop, gravity fed": rs.drives.VelocityLoop(),
    "velocity loop": rs.drives.VelocityLoop(gravity=False),
    "position loop": rs.drives.PositionLoop(),
    "PD with gravity": rs.drives.GravityCompensatedPD(),
    "computed torque": rs.drives.ComputedTorque(),
    "industrial servo": rs.drives.IndustrialServo(),
}
ALONE, TOGETHER = 20.0, 2.0  # simulated seconds
ROUNDS = 5


def make_experiment(robot, runs):
    """Return a servo loop of one run, or of a batch, that goes on for all of its time."""
    base = rs.load_scenario(rs.examples.path("joint_lag"))
    arm = replace(getattr(rs.robots, robot)(), base=base.scene.robots[0].base)
    if robot == base.scene.robots[0].name:
        base = base.with_(scene=base.scene.replacing(arm))
    else:
        task = rs.FollowJoints(by=dict.fromkeys(arm.coordinate_names, 0.1), duration=TOGETHER)
        base = rs.Experiment(rs.Scene([arm]), task, arm.home)
    start = np.asarray(base.scene.home if base.start is None else base.start)
    if runs > 1:
        start = start + 1e-3 * np.random.default_rng(0).normal(size=(runs, start.size))
    seconds = ALONE if runs == 1 else TOGETHER
    settings = {"dt": 0.01, "duration": seconds, "hold": True, "record": "summary"}
    return base.with_(start=start, actuation=rs.Actuation(), **settings)


def measure_loop(experiment, runs):
    """Return the least CPU time in microseconds for a run and step."""
    experiment.run(threads=1)
    seconds = []
    for _ in range(ROUNDS):
        before = time.process_time()
        experiment.run(threads=1)
        seconds.append(time.process_time() - before)
    return 1e6 * min(seconds) / (runs * experiment.duration / experiment.dt)


def measure_mujoco(robot):
    """Return the least CPU time in microseconds for ten steps of MuJoCo, by integrator."""
    import mujoco

    arm = getattr(rs.robots, robot)()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "arm.xml")
        arm.to_mjcf(path)
        model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep = 1e-3
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    times = {}
    for name in ("EULER", "IMPLICITFAST", "RK4"):
        model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{name}")
        data = mujoco.MjData(model)
        rounds = []
        for _ in range(ROUNDS):
            before = time.process_time()
            mujoco.mj_step(model, data, 2000)
            rounds.append(time.process_time() - before)
        times[name.lower()] = 10 * 1e6 * min(rounds) / 2000
    return times


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", default="puma560")
    parser.add_argument("--runs", type=int, default=4096)
    given = parser.parse_args()
    peers = measure_mujoco(given.robot)
    print(f"{'ten steps of MuJoCo':32}", *(f"{name} {us:.1f} us" for name, us in peers.items()))
    print(f"{'loop with ten sub-steps':32}   alone   batch  (us a run and step)")
    for name, drive in DRIVES.items():
        times = []
        for runs in (1, given.runs):
            experiment = make_experiment(given.robot, runs)
            driven = experiment.with_(actuation=rs.Actuation(drive=drive))
            times.append(measure_loop(driven, runs))
        print(f"{name:32} {times[0]:7.2f} {times[1]:7.2f}", flush=True)


if __name__ == "__main__":
    main()
