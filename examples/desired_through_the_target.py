"""Under L desired the camera turns back before the target only for rolls below 147.3 degrees."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

THRESHOLD = 90 + np.degrees(1)
COLORS = (palette.SKY_BLUE, palette.BLUE, palette.GREEN, palette.VERMILLION, palette.PURPLE)
LINES = ("-", "-", "-", "--", ":")

scenario = rs.load_scenario(rs.examples.path("desired_through_the_target"))


def depths(degrees, dt):
    """Return the depths (start, time) of the camera for starts with a roll of `degrees`."""
    turns = [rs.Pose.at(0, 0, -1, rpy=(0, 0, angle)) for angle in np.radians(degrees)]
    starts = np.array([turn.q for turn in turns])
    run = rs.simulate(scenario.scene, scenario.task, starts, dt=dt, duration=3, hold=True)
    return -run.camera_pose[:, :, 2, 3]


plt.rcParams.update({"font.size": 9})
figure, (ways, nearest) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
shown = (100, 130, 146, 148, 160)
for degrees, depth, color, line in zip(shown, depths(shown, 5e-4), COLORS, LINES, strict=True):
    ways.plot(depth.time, depth, color=color, linestyle=line, label=f"{degrees}°")
ways.axhline(0, color="k", linewidth=0.8)
ways.set(xlabel="time (s)", ylabel="depth (m)", ylim=(-0.12, 1.05), xlim=(0, 3))
ways.set_title("the way to a goal at 1 m")
ways.text(2.95, -0.03, "plane of the target", ha="right", va="top")
ways.legend(frameon=False, title="roll at the start", loc="lower right", bbox_to_anchor=(1, 0.1))

middle = np.radians(np.linspace(0, 90, 91))  # theta_m, at which the camera turns back
nearest.plot(np.degrees(middle + np.sin(middle)), np.cos(middle), "k--", label="closed form")
starts = np.array([30, 60, 90, 120, 130, 140, 144, 146])
smallest = depths(starts, 2.5e-4).min("time")
nearest.plot(starts, smallest, "o", color=palette.BLUE, label="simulated, turned back")
nearest.axvspan(THRESHOLD, 180, color=palette.VERMILLION, alpha=0.15, linewidth=0)
nearest.text(THRESHOLD + 17, 0.5, "through the target", ha="center", va="center", rotation=90)
nearest.set(xlabel="roll at the start (degrees)", ylabel="smallest depth (m)", xlim=(0, 180))
nearest.set(xticks=(0, 60, 120, 180), ylim=(0, 1.05), title=f"the limit is {THRESHOLD:.1f}°")
nearest.legend(frameon=False, loc="lower left")
figure.savefig("desired_through_the_target.png", dpi=240)

theta = np.interp(np.radians(starts), middle + np.sin(middle), middle)
for row in zip(starts, smallest.values, np.cos(theta), strict=True):
    print("from {:3} degrees: smallest depth {:.4f} m, closed form {:.4f} m".format(*row))
for dt in (1e-3, 5e-4, 2.5e-4):
    fine = np.arange(145.5, 148, 0.02)
    through = (depths(fine, dt) < 0).any("time").values
    print(f"dt {1e3 * dt:4g} ms: through from {fine[through].min():.2f} degrees on")
