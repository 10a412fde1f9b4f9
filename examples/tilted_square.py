"""A goal view from the side of a square: L current is trapped at its mirror image."""

import matplotlib.pyplot as plt

import robsim as rs
from robsim.plot.palette import BLACK, BLUE, GREEN, GREY, LINES, VERMILLION

COLOURS = {"current": VERMILLION, "desired": BLUE, "mean": GREEN}

plt.rcParams["font.size"] = 9
fig, (side, error) = plt.subplots(
    1, 2, figsize=(7, 3.2), dpi=240, layout="constrained", width_ratios=(1.2, 1)
)
for (interaction, colour), line in zip(COLOURS.items(), LINES, strict=False):
    scenario = rs.load_scenario(
        rs.examples.path("tilted_square"), [f"task.interaction={interaction}", "run.duration=15 s"]
    )
    run = scenario.run(hold=True)  # continues to the end of the duration
    x, _, z = run.camera_pose.values[:, :3, 3].T
    side.plot(x, -z, line, color=colour, label=f"L {interaction}")
    error.semilogy(run.time, run.error_norm, line, color=colour, label=f"L {interaction}")
    norm = float(run.error_norm[-1])
    print(f"L {interaction:8} ||e|| = {norm:.2g}, camera at x = {x[-1]:.4f} m, z = {z[-1]:.4f} m")

    if norm > 1e-3:
        side.plot(x[-1], -z[-1], "X", color=BLACK, ms=5, zorder=3)
        side.annotate("trap", (x[-1], -z[-1]), (-4, 6), textcoords="offset points", ha="right")

for q, word, ha in ((scenario.start, "start", "right"), (scenario.task.goal.q, "goal", "left")):
    side.plot(q[0], -q[2], "o", color=BLACK)
    axis = 0.25 * rs.Pose.from_quaternion(q[:3], q[3:]).rotation[:, 2]
    ahead = q[0] + axis[0], -q[2] - axis[2]
    side.annotate("", ahead, (q[0], -q[2]), arrowprops={"arrowstyle": "->", "color": GREY})
    side.annotate(word, (q[0], -q[2]), (0, -14), textcoords="offset points", ha=ha)
side.plot([-0.1, 0.1], [0, 0], color=BLACK, linewidth=3)
side.annotate("square, on edge", (0, 0), (0, 6), textcoords="offset points", ha="center")
side.set(xlabel="x (m)", ylabel="height above the square (m)", aspect="equal")
side.set(xlim=(-1.05, 1.05), ylim=(-0.08, 1.1))
error.set(xlabel="time (s)", ylabel="||e||, normalised", ylim=(1e-5, 2))
error.legend()
fig.savefig("tilted_square.png")
