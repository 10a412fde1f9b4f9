"""Wrong link lengths, joint offsets and hand-eye pose: the same end, mostly by a longer way."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

TRUE = {  # theta, d, a, alpha: degrees and centimetres
    "upper_arm": np.array([0, 0, 43.18, 0]),
    "forearm": np.array([0, 15.005, 2.03, -90]),
    "wrist_roll": np.array([0, 43.18, 0, 90]),
}
BELIEVED = {
    "upper_arm": np.array([10, 0, 48, 0]),
    "forearm": np.array([-8, 12, 4, -90]),
    "wrist_roll": np.array([0, 48, 0, 85]),
}


def believing(scale):
    """The scenario with its errors times `scale`: 0 is the truth, 1 is as in the file."""
    camera = f"belief.cameras.camera.position={3 * scale}, 0, {7 - 3 * scale} cm"
    changes = [camera, f"belief.cameras.camera.rpy=0, {10 * scale}, {20 * scale} deg"]
    for link, row in TRUE.items():
        theta, d, a, alpha = row + scale * (BELIEVED[link] - row)
        dh = f'{{theta="{theta} deg", d="{d} cm", a="{a} cm", alpha="{alpha} deg"}}'
        changes.append(f"belief.robots.puma560.links.{link}.dh={dh}")
    return rs.load_scenario(rs.examples.path("wrong_dh"), changes)


plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for i, scale in enumerate((0, 1, 2)):
    run = believing(scale).run()
    for mark in range(4):
        label = f"errors times {scale}" if mark == 0 else None
        look = {"linestyle": palette.LINES[i], "color": palette.CYCLE[i], "label": label}
        left.plot(*run.pixels[:, mark].values.T, **look)
left.plot(*run.pixels_goal.values.T, "k+", markersize=9)
left.set(xlabel="column (px)", ylabel="row (px)", aspect="equal", xlim=(-0.5, 639.5))
left.set(ylim=(479.5, -0.5))
left.legend(frameon=False, loc="lower right")

home = believing(0).scene.home
starts = home + np.random.default_rng(0).uniform(-0.24, 0.24, (150, 6))
truth = believing(0).run(q0=starts, record="summary")
starts, exact = starts[truth.outcome == 1], truth.path_length[truth.outcome == 1]
print("errors times   arrive   path over that with the truth: least, median, most")
scales, shares = np.array([0.25, 0.5, 1, 1.5, 2, 2.5]), []
for scale in scales:
    run = believing(scale).run(q0=starts, record="summary", duration=60)
    arrived = (run.outcome == rs.Outcome.CONVERGED).values
    ways = (run.path_length / exact.values).values[arrived]
    shares.append(np.percentile(ways, [5, 50, 95]))
    print(f"{scale:12}   {arrived.sum():2} of {len(starts)}", *np.percentile(ways, [0, 50, 100]).round(3))
low, middle, high = np.transpose(shares)
right.fill_between(scales, low, high, color=palette.LIGHT_GREY, label="5 to 95 percent")
right.plot(scales, middle, "o-", color=palette.BLUE, label="median")
right.axhline(1, color=palette.GREY, linestyle=":")
right.set(xlabel="errors, times those of the scenario", ylabel="path over that with the truth")
right.legend(frameon=False, loc="upper left")
figure.savefig("wrong_dh.png", dpi=150)
