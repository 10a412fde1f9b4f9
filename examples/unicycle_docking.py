"""Dock a unicycle from several starts, by the docking law and by a law that ignores its wheels."""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette
from robsim.units import cm, deg

AHEAD = 14 * cm  # position of the camera on the unicycle
STARTS = np.array(
    [[-60, 14, -20], [-45, 15, 5], [-30, 10, -10], [-45, -5, 10], [-60, -14, 0], [-24, -12, 10]]
) * [cm, cm, deg]


def tracks(*changes):
    """Return the runs from all starts; q is x, y and theta of the unicycle."""
    scenario = rs.load_scenario(rs.examples.path("unicycle_docking"), changes)
    return scenario.run(start=STARTS, duration=40)


docked = tracks()
with warnings.catch_warnings():
    warnings.simplefilter("ignore", rs.errors.RankWarning)  # a unicycle cannot move sideways
    askew = tracks("task.kind=pbvs", "task.form=goal")

plt.rcParams["font.size"] = 9
figure, panels = plt.subplots(1, 2, sharey=True, figsize=(7, 2.6), layout="constrained")
for axes, run, title in zip(panels, (docked, askew), ("docking", "position-based"), strict=True):
    print(title)
    for i, (start, end) in enumerate(zip(STARTS, run.q_end.values, strict=True)):
        x, y, theta = end / [cm, cm, deg]
        name = rs.Outcome(int(run.outcome[i])).name
        print(f"  {name:13} at ({x:7.3f}, {y:7.3f}) cm, {theta:7.3f} deg")
        way = run.q[i, :, :2] / cm
        axes.plot(*way.T, palette.LINES[i % 4], color=palette.cycle_color(i), linewidth=1.2)
        for (a, b, turn), fill in ((start, "none"), (end, palette.cycle_color(i))):
            wedge = (3, 0, np.degrees(turn) - 90)  # a triangle pointing ahead
            place = (a / cm, b / cm)
            axes.plot(
                *place,
                marker=wedge,
                color=palette.cycle_color(i),
                markerfacecolor=fill,
                markersize=9,
            )
    axes.plot(0, 0, "k+", markersize=14)
    axes.set(title=title, xlabel="x (cm)", aspect="equal", xlim=(-66, 8), ylim=(-22, 22))

theta = np.linspace(-2.6, 2.6, 50) * deg  # equilibria of the position-based law
x = AHEAD + theta / AHEAD * np.sin(theta) - AHEAD * np.cos(theta)
y = -theta / AHEAD * np.cos(theta) - AHEAD * np.sin(theta)
panels[1].plot(x / cm, y / cm, color=palette.LIGHT_GREY, linewidth=5, zorder=0)
panels[1].text(-4, 17.5, "all rests", color=palette.GREY, ha="right")
panels[0].set(ylabel="y (cm)")
figure.savefig("unicycle_docking.png", dpi=240)
