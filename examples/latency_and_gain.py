"""The largest stable gain with delayed images, compared with its closed form."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

DT = 0.04  # seconds, as in the scenario


def looking_late(periods, gain_dt, *changes):
    """Run the scenario with images that are `periods` control periods old, at a gain times dt."""
    changes = [f"sensing.latency={1000 * DT * periods} ms", f"task.gain={gain_dt / DT}", *changes]
    return rs.load_scenario(rs.examples.path("latency_and_gain"), changes).run()


def limit(periods):
    """Return the gain dt at which a root of z^(d+1) - z^d + gain dt ((1 - f) z + f) has norm 1."""
    d = max(int(np.ceil(periods)), 1)
    f = periods - d + 1
    low, high = 0.0, 5.0
    for _ in range(40):
        gain_dt = (low + high) / 2
        polynomial = np.polyadd([1, -1] + d * [0], gain_dt * np.array([1 - f, f]))
        stable = abs(np.roots(polynomial)).max() < 1
        low, high = (gain_dt, high) if stable else (low, gain_dt)
    return low


plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
late, whole = np.linspace(0, 3, 181), np.arange(4)
left.plot(late, [limit(d) for d in late], color=palette.GREY, label="limit: roots of the loop")
closed = 2 * np.sin(np.pi / (2 * (2 * whole + 1)))
left.plot(whole, closed, "ks", markersize=4, label="2 sin(π / (2 (2d + 1)))")
looks = {
    True: (".", palette.BLUE, "run that settles"),
    False: ("x", palette.VERMILLION, "does not"),
}
print("latency (periods)   limit   5 percent below   5 percent above")
for periods in np.arange(0, 3.1, 0.25):
    gains = limit(periods) * np.array([0.95, 1.05])
    runs = [looking_late(periods, gain, "start.position=1, -1, -100 cm") for gain in gains]
    settled = [int(run.outcome) == rs.Outcome.CONVERGED for run in runs]
    print(f"{periods:17}   {limit(periods):5.3f}   {settled[0]!s:15}   {settled[1]!s}")
    for gain, stable in zip(gains, settled, strict=True):
        marker, color, label = looks[stable]
        left.plot(periods, gain, marker, color=color, label=None if periods else label)
left.set(xlabel="latency d (control periods)", ylabel="gain times dt", yscale="log", ylim=(0.3, 6))
left.set_yticks([0.5, 1, 2, 4], labels=["0.5", "1", "2", "4"])
left.minorticks_off()
left.legend(frameon=False)
for gain_dt, color, line in zip((0.2, 0.5, 0.65), palette.CYCLE, palette.LINES, strict=False):
    run = looking_late(2, gain_dt, "run.duration=1.6 s", "run.hold=true")
    column = (run.pixels - run.pixels_goal).sel(axis="column")[:, 0]
    right.plot(run.time, column, line, color=color, label=f"gain times dt = {gain_dt}")
right.set(xlabel="time (s)", ylabel="a mark, from its goal (px)", ylim=(-120, 210))
right.set_title("two periods late", fontsize=9)
right.legend(frameon=False, loc="upper right")
figure.savefig("latency_and_gain.png", dpi=240)
