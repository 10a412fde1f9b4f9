"""A local minimum: a pixel from the goal in the image, half a metre in space."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot.palette import BLUE, GREEN, LINES, VERMILLION

COLOURS = {"current": VERMILLION, "desired": BLUE, "mean": GREEN}

plt.rcParams["font.size"] = 9
fig, (error, away) = plt.subplots(1, 2, figsize=(7, 3.2), dpi=240, layout="constrained")
for (interaction, colour), line in zip(COLOURS.items(), LINES, strict=False):
    scenario = rs.load_scenario(
        rs.examples.path("local_minimum"), [f"task.interaction={interaction}", "run.duration=15 s"]
    )
    run = scenario.run(hold=True)  # to the end of the duration, also after the stop
    place = run.camera_pose.values[:, :3, 3]
    metres = np.linalg.norm(place - scenario.task.goal.q[:3], axis=1)
    error.semilogy(run.time, run.error_norm, line, color=colour, label=f"L {interaction}")
    away.plot(run.time, metres, line, color=colour, label=f"L {interaction}")
    print(
        f"L {interaction:8} ||e|| = {float(run.error_norm[-1]):.3g}, largest error of a mark "
        f"{float(run.pixel_error):.2g} px, camera {metres[-1]:.3f} m from its goal"
    )
error.set(xlabel="time (s)", ylabel="||e||, normalised", ylim=(1e-5, 1))
away.set(xlabel="time (s)", ylabel="camera to its goal (m)", ylim=(0, None))
error.legend()
fig.savefig("local_minimum.png")
