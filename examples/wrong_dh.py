"""Wrong link lengths, joint offsets and camera mount: the same final pose, on another path."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette
from robsim.units import cm, deg

ERRORS = {
    "upper_arm": {"theta": 10 * deg, "a": 5 * cm},
    "forearm": {"theta": -8 * deg, "d": -3 * cm, "a": 2 * cm},
    "wrist_roll": {"d": 5 * cm, "alpha": -5 * deg},
}
scenario = rs.load_scenario(rs.examples.path("wrong_dh"))


def servo(scale, starts):
    """Run with the errors of the scenario times `scale`; 0 is the truth."""
    dh = {link: {key: scale * by for key, by in row.items()} for link, row in ERRORS.items()}
    turn = 0, 10 * scale * deg, 20 * scale * deg
    hand_eye = rs.Pose.at(3 * scale * cm, 0, -3 * scale * cm, rpy=turn)
    belief = scenario.scene.believe(dh=dh, hand_eye=hand_eye)
    task = replace(scenario.task, belief=belief)
    return rs.simulate(scenario.scene, task, starts, duration=60)


plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for i, scale in enumerate((0, 1, 2)):
    run = servo(scale, scenario.start)
    for mark in range(4):
        label = str(scale) if mark == 0 else None
        look = {"linestyle": palette.LINES[i], "color": palette.CYCLE[i], "label": label}
        left.plot(*run.pixels[:, mark].values.T, **look)
left.plot(*run.pixels_goal.values.T, "k+", markersize=9)
left.set(xlabel="column (px)", ylabel="row (px)", aspect="equal", xlim=(-0.5, 639.5))
left.set(ylim=(479.5, -0.5))
left.legend(frameon=False, loc="lower center", ncols=3, title="errors times")

starts = scenario.scene.home + np.random.default_rng(0).uniform(-0.24, 0.24, (150, 6))
truth = servo(0, starts)
starts, exact = starts[truth.outcome == 1], truth.path_length[truth.outcome == 1]
print("errors times   arrive   path over that with the truth: least, median, most")
scales, shares = np.array([0.25, 0.5, 1, 1.5, 2, 2.5]), []
for scale in scales:
    run = servo(scale, starts)
    arrived = (run.outcome == rs.Outcome.CONVERGED).values
    ways = (run.path_length / exact.values).values[arrived]
    shares.append(np.percentile(ways, [5, 50, 95]))
    print(
        f"{scale:12}   {arrived.sum():2} of {len(starts)}",
        *np.percentile(ways, [0, 50, 100]).round(3),
    )
low, middle, high = np.transpose(shares)
right.fill_between(scales, low, high, color=palette.LIGHT_GREY, label="5 to 95 percent")
right.plot(scales, middle, "o-", color=palette.BLUE, label="median")
right.axhline(1, color=palette.GREY, linestyle=":")
right.set(xlabel="errors, times those of the scenario", ylabel="path over that with the truth")
right.legend(frameon=False, loc="upper left")
figure.savefig("wrong_dh.png", dpi=240)
