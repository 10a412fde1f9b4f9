"""Five schemes that turn the camera about its axis without a retreat, and their costs."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

WAYS = {
    "L current": ["task.features=points"],
    "partitioned": ["task.kind=partitioned"],
    "2 1/2 D": ["task.kind=hybrid"],
    "L mean": ["task.features=points", "task.interaction=mean"],
    "polar": [],
    "PBVS": ["task.kind=pbvs"],
}
STYLES = [  # coinciding curves are drawn on one another, later curves thinner
    {"color": palette.VERMILLION, "linewidth": 4, "alpha": 0.6},
    {"color": palette.PURPLE, "linestyle": ":", "linewidth": 1.8},
    {"color": palette.GREEN, "linestyle": "--", "linewidth": 1.6},
    {"color": palette.SKY_BLUE, "linewidth": 6},
    {"color": palette.ORANGE, "linewidth": 3},
    {"color": palette.BLACK, "linestyle": "-.", "linewidth": 1.2},
]
DEGREES = np.arange(10, 151, 5)

plt.rcParams.update({"font.size": 9})
figure, (image, far) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
print("way           largest distance of the camera from its goal, from 30, 60, 90, 120 degrees")
for (name, changes), style in zip(WAYS.items(), STYLES, strict=True):
    scenario = rs.load_scenario(rs.examples.path("retreat_cures"), changes)
    goal = rs.Pose.at(0, 0, -1)
    starts = [(goal @ rs.Pose.at(1e-3, 0, 0, rpy=(0, 0, a))).q for a in np.radians(DEGREES)]
    run = rs.simulate(scenario.scene, scenario.task, np.array(starts), dt=0.01, duration=20)
    away = np.linalg.norm(run.camera_pose[:, :, :3, 3] - goal.position, axis=-1)
    largest = np.nanmax(away, axis=1)
    print(f"{name:12}", "".join(f"{largest[d == DEGREES][0]:10.4f} m" for d in (30, 60, 90, 120)))
    far.plot(DEGREES, largest, **style, label=name)
    track = run.pixels.sel(run=list(DEGREES).index(120))[:, 0]
    image.plot(*track.T, **style)

pixels = scenario.scene.view(goal.q, "camera").pixels
image.plot(*pixels.T, "kx", label="goal")
image.plot(*track[0], "ko", markerfacecolor="w", label="start of one mark")
image.set(xlim=(120, 520), ylim=(420, 60), aspect="equal", title="way of one mark, 120 degrees")
image.set(xlabel="column (px)", ylabel="row (px)")
image.legend(frameon=False, loc="center right")
far.set(xlabel="roll at the start (degrees)", ylabel="largest distance from the goal (m)")
far.set(xlim=(0, 152), xticks=range(0, 151, 30), ylim=(-0.05, 1.5), title="way of the camera")
far.legend(frameon=False, loc="upper left")
figure.savefig("retreat_cures.png", dpi=240)
