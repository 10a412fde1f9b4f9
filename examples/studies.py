"""Run two studies: schemes over the rotation at the start, and the effect of wrong numbers."""

from dataclasses import replace

import matplotlib.pyplot as plt

import robsim as rs
from robsim.units import deg

one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=20)
tasks = {"IBVS": rs.IBVS(), "IBVS, L mean": rs.IBVS(interaction="mean"), "PBVS": rs.PBVS()}
schemes = rs.study(
    one,
    2000,
    seed=1,
    start=rs.starts.LookAt(distance=(0.6, 1.4), roll=(-180, 180) * deg, aside=0.15),
    vary={"task": {name: replace(task, goal=one.task.goal) for name, task in tasks.items()}},
)
print(schemes)
print(schemes.paired("task"))
figure = rs.plot.study_success(schemes, "start_angle", by="task")
figure.savefig("study_success.png", dpi=230)
plt.close(figure)

wrong = rs.study(
    rs.load_scenario(rs.examples.path("calibration_errors"), ["belief.cameras.camera.focal=500"]),
    4000,
    seed=1,
    start=rs.starts.LookAt(distance=(0.8, 1.4), roll=(-60, 60) * deg),
    vary={
        "task.gain": rs.samplers.LogUniform(0.8, 2.0),
        "belief.cameras.camera.focal": rs.samplers.Sum(rs.samplers.Normal(0.0, 10.0)),
        "belief.cameras.camera.center": rs.samplers.Sum(rs.samplers.Normal(0.0, [4.0, 4.0])),
        "belief.cameras.camera.rpy": rs.samplers.Normal(0.0, [1 * deg] * 3),
    },
)
print(wrong)
found = wrong.sensitivity("distance_to_goal")
print(found)
figure = rs.plot.study_sensitivity(found)
figure.savefig("study_sensitivity.png", dpi=230)
