"""Run the chapter's experiments: image-based servoing (6.1), and placing with two cameras (6.2)."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette
from robsim.units import cm

plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
run = rs.load_scenario(rs.examples.path("chapter_6_1")).run()
print(f"6.1: {rs.Outcome(int(run.outcome)).name} after {float(run.end_time):.2f} s,", end=" ")
print(f"way of the camera {float(run.path_length):.3f} m")
for mark in range(4):
    left.plot(*run.pixels[:, mark].values.T, palette.LINES[mark], color=palette.cycle_color(mark))
    left.plot(*run.pixels[0, mark], "o", color=palette.cycle_color(mark), markersize=4)
left.plot(*run.pixels_goal.values.T, "k+", markersize=10)
left.set(xlim=(-0.5, 639.5), ylim=(479.5, -0.5), xlabel="column (px)", ylabel="row (px)")
left.set(aspect="equal")
left.set_title("6.1: the four marks, from circle to cross", fontsize=9)

looks = {
    "corrected": {"color": palette.BLUE, "linewidth": 2.5},
    "printed": {"color": palette.VERMILLION, "linestyle": "--"},
}
for variant, look in looks.items():
    scenario = rs.load_scenario(rs.examples.path("chapter_6_2"), [f"task.variant={variant}"])
    run = scenario.run()
    way = scenario.scene.pose("cube", run.dropna("time").q.values).position / cm
    length = float(run.path_length)
    print(f"6.2, {variant:9}: {rs.Outcome(int(run.outcome)).name}, way of mark a {length:.4f} m")
    right.plot(way[:, 0], way[:, 1], **look, label=f"{variant}: {length:.2f} m")
straight = np.linalg.norm(way[-1] - way[0]) / 100
print(f"6.2, from start to goal: {straight:.4f} m")
right.plot(*way[[0, -1], :2].T, "k.", markersize=9)
right.annotate("start", way[0, :2], (6, 0), textcoords="offset points")
right.annotate("goal", way[-1, :2], (7, -4), textcoords="offset points")
right.set(xlabel="x (cm)", ylabel="y (cm)", aspect="equal", xlim=(-12, 52), ylim=(-44, 26))
right.set_title("6.2: mark a from above", fontsize=9)
right.legend(frameon=False, loc="upper left")
figure.savefig("chapter_experiments.png", dpi=240)
