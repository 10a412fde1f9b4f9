"""PBVS loses the target, IBVS keeps it on a detour, 2 1/2 D keeps it on a nearly straight path."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

SCHEMES = {"PBVS": [], "IBVS": ["task.kind=ibvs"], "2 1/2 D": ["task.kind=hybrid", "task.mark=4"]}

plt.rcParams.update({"font.size": 9})
figure, panels = plt.subplots(1, 3, figsize=(7, 2.6), layout="constrained", sharey=True)
for axes, (name, changes) in zip(panels, SCHEMES.items(), strict=True):
    scenario = rs.load_scenario(rs.examples.path("pbvs_loses_target"), changes)
    run = scenario.run()
    outcome, path = rs.Outcome(int(run.outcome)).name, float(run.path_length)
    print(f"{name:8} {outcome:13} after {float(run.end_time):5.2f} s, {path:.3f} m of way")
    for j in range(5):
        axes.plot(
            *run.pixels[:, j].T, color=palette.cycle_color(j), linestyle=(palette.LINES * 2)[j]
        )
    axes.plot(*run.pixels[0].T, "ko", markerfacecolor="w", markersize=4, label="start")
    axes.plot(*run.pixels_goal.T, "kx", markersize=5, label="goal")
    axes.add_patch(plt.Rectangle((-0.5, -0.5), 640, 480, fill=False, linewidth=1.5))
    how = f"{path:.2f} m" if run.outcome == rs.Outcome.CONVERGED else "out of the image"
    axes.set(title=f"{name}: {how}", xlabel="column (px)", aspect="equal")
    axes.set(xlim=(-40, 680), ylim=(520, -40))
panels[0].set_ylabel("row (px)")
marks = panels[0].get_legend_handles_labels()
figure.legend(*marks, frameon=False, loc="outside lower center", ncols=2, handletextpad=0)
start, goal = scenario.start[:3], np.array([0, 0, -1])
print(f"the straight way is {np.linalg.norm(start - goal):.3f} m long")
figure.savefig("pbvs_loses_target.png", dpi=240)
