"""Depths that are all wrong by one factor a: the translation converges with a times the gain."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette


def run_with(scale, dt, **changes):
    """Run with all depths too large by the factor `scale`; the gain is 10 per second."""
    scenario = rs.load_scenario(rs.examples.path("depth_scale"), [f"task.depth_scale={scale}"])
    return scenario.run(dt=dt, **changes).dropna("time")


plt.rcParams.update({"font.size": 9})
figure, (smooth, sampled) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
colors = (palette.BLUE, palette.GREEN, palette.VERMILLION)
print("factor a   measured rate / gain")
for a, color, line in zip((0.5, 1.0, 2.0), colors, palette.LINES, strict=False):
    x = run_with(a, dt=1e-4, duration=0.5).q[:, 0]
    rate = np.log(x[0] / x[1000]) / 0.1 / 10
    print(f"{a:8}   {float(rate):20.4f}")
    smooth.semilogy(x.time, 100 * x, color=color, linestyle=line, label=f"a = {a:g}")
    smooth.semilogy(x.time, 2 * np.exp(-10 * a * x.time), "k:", linewidth=1)
smooth.plot([], [], "k:", linewidth=1, label="exp(-a gain t)")
smooth.set(xlabel="time (s)", ylabel="distance from the goal (cm)", xlim=(0, 0.5), ylim=(1e-3, 3))
smooth.set_title("short periods")
smooth.legend(frameon=False, loc="lower left")

print("a gain dt   how it ends (dt = 40 ms)")
for a, color, line in zip((4.5, 5.0, 5.2), colors, ("-", "--", ":"), strict=True):
    run = run_with(a, dt=0.04, duration=60)
    print(f"{a * 0.4:9.2f}   {rs.Outcome(int(run.outcome)).name}")
    look = {"color": color, "linestyle": line, "marker": "o", "markersize": 3}
    x = 100 * run.q[:26, 0]
    sampled.plot(x.time, x, **look, label=f"a gain dt = {0.4 * a:g}")
sampled.set(xlabel="time (s)", ylabel="position (cm)", xlim=(0, 1), title="periods of 40 ms")
sampled.set_ylim(-8, 14)
sampled.legend(frameon=False, loc="upper left")
figure.savefig("depth_scale.png", dpi=240)
