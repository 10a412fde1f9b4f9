"""Simulate ten thousand wrong calibrations, and draw the final distances from the goal."""

import time

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

RUNS = 10_000
rng = np.random.default_rng(7)
experiment = rs.load_scenario(rs.examples.path("calibration_errors"), ["task.gain=3"])
focal = rng.normal(500, 10, RUNS)  # 2 percent of the true value
off_centre = rng.normal(0, 8, (RUNS, 2))  # pixels
tilt = np.radians(rng.normal(0, 1, (RUNS, 3)))  # of the mount, about each axis
camera = "belief.cameras.camera"
names = {
    f"{camera}.focal": focal,
    f"{camera}.center": experiment.scene.camera().camera.K[:2, 2] + off_centre,
    f"{camera}.rpy": tilt,
}

start = time.perf_counter()
runs = experiment.vary(names).run(record="summary", duration=8.0)
seconds = time.perf_counter() - start
off = 1e3 * runs.distance_to_goal.values
arrived = runs.outcome.values == rs.Outcome.CONVERGED
print(f"{RUNS} runs in {seconds:.1f} s, {arrived.sum()} converged")
for share in (50, 90, 99):
    print(f"{share} percent end within {np.percentile(off[arrived], share):.1f} mm of the goal")
wrong = np.linalg.norm(off_centre, axis=1)
for what, size in {
    "focal": abs(focal - 500),
    "centre": wrong,
    "mount": abs(tilt).sum(axis=1),
}.items():
    print(f"correlation with the error of the {what}: {np.corrcoef(size, off)[0, 1]:.2f}")

plt.rcParams.update({"font.size": 9})
figure, (by_focal, shares) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
dots = by_focal.scatter(focal / 500, off, c=wrong, s=2, cmap="cividis", rasterized=True)
ratio = np.linspace(0.92, 1.08, 200)
by_focal.plot(
    ratio, 1e3 * abs(1 / ratio - 1), color=palette.VERMILLION, label="|f / believed f - 1|"
)
by_focal.set(xlabel="believed focal length / true", ylabel="distance to the goal (mm)")
by_focal.set(xlim=(0.92, 1.08), ylim=(0, 90))
by_focal.legend(frameon=False, loc="upper center")
figure.colorbar(dots, ax=by_focal, label="error of the image centre (px)")
shares.plot(np.sort(off[arrived]), np.linspace(0, 1, arrived.sum()), color=palette.BLUE)
shares.set(xlabel="distance to the goal (mm)", ylabel="share of the runs within", ylim=(0, 1))
shares.set(xlim=(0, 90))
figure.savefig("ten_thousand_calibrations.png", dpi=240)
