"""A camera on a pan-tilt head lags behind a moving target without feed-forward."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

GAIN = 2.0  # per second, as in the scenario


def lag(*changes):
    """Return times, and the bearings of the target from the optical axis in degrees."""
    run = rs.load_scenario(rs.examples.path("pan_tilt_tracking"), changes).run()
    return run.time, -np.degrees(np.arctan(run.s[:, 0]))


CASES = {
    "none, L current": ["task.feed_forward=none", "task.interaction=current"],
    "none, L desired": ["task.feed_forward=none"],
    "estimated": ["task.feed_forward=estimated"],
    "known": [],
}
plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for i, (name, changes) in enumerate(CASES.items()):
    time, angle = lag(*changes)
    left.plot(time, angle, palette.LINES[i], color=palette.CYCLE[i], label=name)
    print(f"{name:16} lag at the end {float(angle[-1]):8.4f} deg")
left.set(xlabel="time (s)", ylabel="lag of the head (deg)", ylim=(-3, 44))
left.legend(frameon=False, title="feed-forward", ncols=2, loc="upper center")

angle = np.linspace(0, np.radians(45), 100)
right.plot(np.sin(2 * angle) / 2, np.degrees(angle), color=palette.BLUE)
right.plot(np.tan(angle), np.degrees(angle), "--", color=palette.VERMILLION)
apart = "start.q=['-165 deg', '0 deg', '-145 deg']"  # settles before pan reaches its limit
for rate, name in [(r, n) for r in (10, 20, 30, 40, 50) for n in ("current", "desired")]:
    changes = [f"motions.carousel.rates=['{rate} deg/s']", apart, "run.duration=6 s"]
    angle = lag(*changes, *CASES[f"none, L {name}"])[1][-1]
    color, marker = (palette.BLUE, "o") if name == "current" else (palette.VERMILLION, "s")
    label = f"L {name}" if rate == 10 else None
    right.plot(np.radians(rate) / GAIN, angle, marker, color=color, markersize=4, label=label)
right.set(xlabel="rate of the target over gain", ylabel="lag at rest (deg)", ylim=(0, 50))
right.annotate("no rest beyond", (0.5, 45), (0.53, 46), color=palette.BLUE, va="center")
right.legend(frameon=False, title="lines: closed forms", loc="lower right")
figure.savefig("pan_tilt_tracking.png", dpi=240)
