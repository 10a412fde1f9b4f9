"""Simulate a roll of the camera under three interaction matrices (Chaumette 1998)."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

CLOSED_FORM = {  # depth / depth at the goal, for the remaining roll and the roll at the start
    "current": lambda left, start: np.cos(left - start / 2) / np.cos(start / 2),
    "desired": lambda left, start: 1 - (start - left) * np.tan(left / 2),
    "mean": lambda left, start: np.ones_like(left),
}
COLORS = dict(zip(CLOSED_FORM, (palette.VERMILLION, palette.BLUE, palette.GREEN), strict=True))

plt.rcParams.update({"font.size": 9})
figure, (depths, rolls) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
print("depth on the way, in units of the depth at the goal")
print("angle   current (largest)   desired (smallest)   mean (largest)")
for degrees in (30, 60, 90, 120):
    extreme = []
    for interaction, closed_form in CLOSED_FORM.items():
        changes = [f"task.interaction={interaction}", f"start.rotvec=0, 0, {degrees} deg"]
        changes += ["run.dt=0.5 ms", "cameras.camera.size=[1200, 1200]"]  # room for L desired
        scenario = rs.load_scenario(rs.examples.path("camera_retreat"), changes)
        T = scenario.run().dropna("time").camera_pose
        roll, depth = np.arctan2(T[:, 1, 0], T[:, 0, 0]), -T[:, 2, 3]
        extreme.append(float(depth.min() if interaction == "desired" else depth.max()))
        depths.plot(np.degrees(roll), depth, color=COLORS[interaction], linewidth=2.5, alpha=0.6)
        left = np.linspace(0, np.radians(degrees))
        depths.plot(np.degrees(left), closed_form(left, left[-1]), "k--", linewidth=0.9)
        if interaction == "mean":
            rolls.semilogy(T.time, np.sin(roll / 2) / np.sin(roll[0] / 2), linewidth=2.5, alpha=0.6)
    print("{:5}   {:17.4f}   {:18.4f}   {:14.4f}".format(degrees, *extreme))

for name, place in {"current": (60, 1.75), "desired": (60, 0.53), "mean": (104, 1.04)}.items():
    depths.text(*place, f"L {name}", color=COLORS[name], ha="center")
depths.plot([], [], "k--", linewidth=0.9, label="closed form")
depths.set(xlabel="roll that is left (degrees)", ylabel="depth / depth at the goal")
depths.set(
    xlim=(124, -2), xticks=range(0, 121, 30), ylim=(0.2, 2.1), title="the way from four rolls"
)
depths.legend(frameon=False, loc="lower right")
t = np.linspace(0, 8)
rolls.semilogy(t, np.exp(-t), "k--", linewidth=0.9, label="exp(-gain t)")
rolls.set(xlabel="time (s)", ylabel="sin(θ/2) / sin(θ₀/2)", xlim=(0, 8), ylim=(3e-4, 1.2))
rolls.set_title("L mean: four rolls, one decay")
rolls.legend(frameon=False)
figure.savefig("camera_retreat.png", dpi=240)
