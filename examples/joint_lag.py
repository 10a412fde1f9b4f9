"""Joints that lag behind their command make the error overshoot."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

GAIN = 2.0  # per second, as in the scenario


def way_left(gain_lag):
    """Return times, and the errors divided by the error at the start, for a lag of the joints."""
    changes = [f"actuation.lag={gain_lag / GAIN} s", "run.hold=true"]
    run = rs.load_scenario(rs.examples.path("joint_lag"), changes).run()
    return run.time, run.error @ run.error[0] / (run.error[0] @ run.error[0])


def overshoot(gain_lag):
    """Return the overshoot of lag e'' + e' + gain e = 0, which starts at rest."""
    damping = 0.5 / np.sqrt(gain_lag)
    return np.exp(-np.pi * damping / np.sqrt(1 - damping**2))


plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for gain_lag, color, line in zip((0.25, 1, 4), palette.CYCLE, palette.LINES, strict=False):
    left.plot(*way_left(gain_lag), line, color=color, label=f"gain times lag = {gain_lag}")
left.axhline(0, color=palette.LIGHT_GREY, zorder=0)
left.set(xlabel="time (s)", ylabel="error over that of the start", xlim=(0, 8))
left.legend(frameon=False)

print("gain times lag   overshoot   closed form")
grid = np.geomspace(0.26, 8, 200)
right.plot(grid, 100 * overshoot(grid), color=palette.GREY, label="closed form")
for gain_lag in (0.5, 1, 2, 4, 8):
    measured = -way_left(gain_lag)[1].min().item()
    print(f"{gain_lag:14}   {measured:9.4f}   {overshoot(gain_lag):11.4f}")
    label = None if gain_lag > 0.5 else "simulated"
    right.plot(gain_lag, 100 * measured, "o", color=palette.BLUE, label=label)
right.set(xlabel="gain times lag", ylabel="overshoot (percent)", xscale="log")
right.set_xticks([0.25, 0.5, 1, 2, 4, 8], labels=["0.25", "0.5", "1", "2", "4", "8"])
right.minorticks_off()
right.legend(frameon=False)
figure.savefig("joint_lag.png", dpi=240)
