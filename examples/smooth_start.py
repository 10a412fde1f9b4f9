"""A command that grows from zero, and the time that it costs (Mansard and Chaumette 2007)."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

scenario = rs.load_scenario(rs.examples.path("smooth_start"))
goal, gain = scenario.task.goal, scenario.task.gain
tasks = {f"smooth_start={mu}": rs.PBVS(goal, gain=gain, smooth_start=mu) for mu in (2, 4)}
tasks = {"without": rs.PBVS(goal, gain=gain), **tasks}
found = rs.compare(scenario.scene, tasks, scenario.start, dt=0.01, duration=15)
print(found)

plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
colors = (palette.VERMILLION, palette.BLUE, palette.GREEN)
for (name, run), color, line in zip(found.runs.items(), colors, palette.LINES, strict=False):
    lived = run.dropna("time")
    speed = 100 * np.linalg.norm(lived.camera_velocity.values[:, :3], axis=1)
    left.plot(lived.time, speed, line, color=color, label=name)
    right.semilogy(lived.time, lived.error_norm, line, color=color)
time = np.linspace(0, 12, 25)
for mu in (2, 4):
    share = (gain * np.exp(-mu * time) - mu * np.exp(-gain * time)) / (gain - mu)
    start = float(found.runs["without"].error_norm[0])
    right.semilogy(time, start * share, ".", color=palette.BLACK, markersize=4, zorder=3)
    late = np.log(mu / (mu - gain)) / gain
    slower = found.data.time.sel(scheme=f"smooth_start={mu}") - found.data.time[0]
    peak = found.data.peak_speed.sel(scheme=f"smooth_start={mu}") / found.data.peak_speed[0]
    print(
        f"mu {mu}: {float(slower):.2f} s later (closed form {late:.3f} s), peak {float(peak):.3f}"
    )
right.plot([], [], ".", color=palette.BLACK, markersize=4, label="closed form")
right.legend(frameon=False)
left.legend(frameon=False)
left.set(xlabel="time (s)", ylabel="speed of the camera (cm/s)", xlim=(0, 4), ylim=(0, None))
right.set(xlabel="time (s)", ylabel="||e||", xlim=(0, 12))
for axes in (left, right):
    axes.grid(True, color=palette.LIGHT_GREY, linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig("smooth_start.png", dpi=240)
