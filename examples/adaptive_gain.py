"""Compare an adaptive gain (Kermorgant and Chaumette 2014) with a constant gain."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

scenario = rs.load_scenario(rs.examples.path("adaptive_gain"))
adaptive, goal = scenario.task.gain, scenario.task.goal
first = scenario.run(duration=0.01).error_norm.values[0]
constant = float(adaptive.at(np.array([first]))[0])  # the same speed at the start
tasks = {"adaptive": scenario.task, f"constant {constant:.3f}/s": rs.PBVS(goal, gain=constant)}
found = rs.compare(scenario.scene, tasks, scenario.start, dt=0.01, duration=40)
print(found)
t_adaptive, t_constant = found.data.time.values
print(f"{t_adaptive:.2f} s instead of {t_constant:.2f} s: {t_adaptive / t_constant:.0%} of it")

plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for (name, run), color, line in zip(
    found.runs.items(), (palette.BLUE, palette.VERMILLION), palette.LINES, strict=False
):
    lived = run.dropna("time")
    speed = 100 * np.linalg.norm(lived.camera_velocity.values[:, :3], axis=1)
    left.plot(lived.time, speed, line, color=color, label=name)
    right.semilogy(lived.time, lived.error_norm, line, color=color)
    right.annotate(
        f"{float(run.end_time):.1f} s",
        (float(run.end_time), float(lived.error_norm[-1])),
        (-8, -2), textcoords="offset points", color=color, ha="right",
    )  # fmt: skip
left.set(xlabel="time (s)", ylabel="speed of the camera (cm/s)", xlim=(0, 15), ylim=(0, None))
left.set_xticks(range(0, 16, 5))
left.legend(frameon=False)
right.set(xlabel="time (s)", ylabel="||e||", xlim=(0, 30), ylim=(3e-6, 2))
for axes in (left, right):
    axes.grid(True, color=palette.LIGHT_GREY, linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig("adaptive_gain.png", dpi=240)
