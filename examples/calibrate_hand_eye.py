"""Calibrate a camera on a hand: three random views, then the most informative views."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

ALSO = ["focal", "center"]
TRIALS = 15
bench = rs.load_scenario(rs.examples.path("calibration_bench"))
look = rs.starts.LookAt("board", distance=(0.3, 0.9), cone=0.9, aside=0.1)
candidates = rs.calibration.sample_viewpoints(bench, 200, look, seed=3)
truth = bench.scene


def calibrated(q, seed):
    """Return the calibration from simulated views at the coordinates q."""
    return rs.calibrate(rs.calibration.simulate_views(bench, q, seed=seed), ALSO)


def spread(found):
    """Return the standard deviations of the mount's position, mm, and orientation, degrees."""
    C = found.covariance.diagonal() * (bench.sensing.noise / found.sigma) ** 2
    return 1e3 * np.sqrt(C[:3].sum()), np.degrees(np.sqrt(C[3:6].sum()))


first = calibrated(candidates[:3], seed=0)
more = first.next_poses(candidates, 7)
found = calibrated(np.concatenate([candidates[:3], more.q]), seed=0)
print(found)
print("the ellipsoid of 95 % holds the true mount:", found.holds(truth))
before, after = first.cost(bench), found.cost(bench)
print("from three views:", before, "from ten:", after, sep="\n")
print(before.sensitivity())

counts = np.array([4, 6, 8, 10, 14, 20])
chosen, random = np.empty((2, TRIALS, len(counts), 2))
rng = np.random.default_rng(1)
for trial in range(TRIALS):
    q = candidates[rng.permutation(len(candidates))]
    next_ones = calibrated(q[:3], trial).next_poses(candidates, 17).q
    told = np.concatenate([q[:3], next_ones])
    for i, count in enumerate(counts):
        random[trial, i] = spread(calibrated(q[:count], trial))
        chosen[trial, i] = spread(calibrated(told[:count], trial))
random, chosen = np.median(random, axis=0), np.median(chosen, axis=0)
for k, unit in enumerate(("mm", "deg")):
    enough = counts[chosen[:, k] <= random[-1, k]][0]
    print(f"20 random views: {random[-1, k]:.3g} {unit}; as good: {enough} chosen ones")

plt.rcParams.update({"font.size": 9})
figure, axes = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
for k, (axis, name) in enumerate(zip(axes, ("position, mm", "orientation, deg"), strict=True)):
    axis.plot(counts, random[:, k], "o", color=palette.SKY_BLUE, label="random", markersize=4)
    axis.plot(counts, chosen[:, k], "o", color=palette.VERMILLION, label="chosen", markersize=4)
    axis.axhline(random[-1, k], color="k", linewidth=0.8, label="20 random")
    axis.set(xlabel="views", ylabel=f"deviation of the {name}", ylim=(0, None))
axes[0].legend(frameon=False)
figure.savefig("calibrate_hand_eye.png", dpi=240)
