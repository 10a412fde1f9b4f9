"""The error that a pixel of noise leaves when the camera is at rest, for several gains."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

DT, RUNS, GOAL = 0.04, 1000, rs.Pose.at(0, 0, -0.5)


def at_rest(gain_dt):
    """Return the final errors of many runs, which are long enough to forget their starts."""
    scenario = rs.load_scenario(rs.examples.path("noise_floor"), [f"task.gain={gain_dt / DT}"])
    starts, long = np.tile(GOAL.q, (RUNS, 1)), 4 / scenario.task.gain + 10 * DT
    return scenario.run(start=starts, duration=long, record="summary")


def interaction():
    """Return L (8, 6) of the pixels of the marks at the goal."""
    scene = rs.load_scenario(rs.examples.path("noise_floor")).scene
    view = scene.view(GOAL.q, points="plate")
    seen = rs.features.Observation.of(view.pixels, view.depth, scene.camera().camera)
    return rs.features.PixelPoints().interaction(seen)[0]


gains, grid = np.array([0.05, 0.1, 0.2, 0.4, 0.7, 1, 1.3, 1.6]), np.geomspace(0.04, 1.8, 100)
floor = grid / (2 - grid)  # variance in the loop / variance of the noise
pose = np.sqrt(np.diag(np.linalg.inv(interaction().T @ interaction())))  # for one pixel
plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
left.loglog(grid, np.sqrt(0.75 * floor), color=palette.GREY)  # six motions for eight numbers
right.loglog(grid, 1000 * pose[0] * np.sqrt(floor), color=palette.GREY)
right.loglog(grid, 1000 * pose[2] * np.sqrt(floor), color=palette.GREY)
print("gain times dt   marks (px)   predicted   x (mm)   predicted   z (mm)   predicted")
for gain_dt in gains:
    run = at_rest(gain_dt)
    marks = np.sqrt(((run.pixels_end - run.pixels_goal) ** 2).mean()).item()
    x, _, z = 1000 * run.q_end.values[:, :3].std(axis=0)
    scale = np.sqrt(gain_dt / (2 - gain_dt))
    told = marks, np.sqrt(0.75) * scale, x, 1000 * pose[0] * scale, z, 1000 * pose[2] * scale
    print(
        "{:13}   {:10.3f}   {:9.3f}   {:6.3f}   {:9.3f}   {:6.3f}   {:9.3f}".format(gain_dt, *told)
    )
    left.plot(gain_dt, marks, "o", color=palette.BLUE)
    right.plot(gain_dt, x, "o", color=palette.VERMILLION)
    right.plot(gain_dt, z, "s", color=palette.GREEN)
left.set(xlabel="gain times dt", ylabel="marks from their goal, rms (px)")
left.set_title("noise: 1 px; lines: closed forms", fontsize=9)
left.set_yticks([0.2, 0.5, 1, 2], labels=["0.2", "0.5", "1", "2"])
right.set(xlabel="gain times dt", ylabel="camera from its goal, rms (mm)")
right.set_yticks([0.3, 1, 3, 10, 30], labels=["0.3", "1", "3", "10", "30"])
right.text(0.06, 3.5, "sideways", color=palette.VERMILLION)
right.text(0.25, 0.3, "along the axis", color=palette.GREEN)
for axes in (left, right):
    axes.minorticks_off()
    axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1, 2], labels=["0.05", "0.1", "0.2", "0.5", "1", "2"])
figure.savefig("noise_floor.png", dpi=240)
