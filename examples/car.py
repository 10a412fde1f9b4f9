"""A car drives up to a sign within its steering limit, with one gain for both errors or two."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette
from robsim.units import cm, deg


def run_of(*changes):
    """Run the changed scenario, print its remaining errors, and return scene and run."""
    scenario = rs.load_scenario(rs.examples.path("car"), changes)
    run = scenario.run()
    aside, ahead = run.error.dropna("time").values[-1] / cm
    name = rs.Outcome(int(run.outcome)).name
    print(f"{name:10}: the sign {aside:.2f} cm aside, and {ahead:.2f} cm too far away")
    return scenario.scene, run


def draw_from_above(axes, car, q, **look):
    """Draw all shapes of the car at q, seen from above."""
    for link, T in zip(car.links, car.frames(q), strict=True):
        for shape in link.shapes:
            corners = shape.at(T).vertices[shape.edges] / cm
            axes.plot(*corners[..., :2].transpose(2, 1, 0), **look)


scene, run = run_of()
_, stuck = run_of("task.tasks.0.gain=0.5")
car, q = scene.robot(), run.q.dropna("time").values

plt.rcParams["font.size"] = 9
figure, (top, steering) = plt.subplots(
    1, 2, figsize=(7, 3.1), layout="constrained", width_ratios=(1.35, 1)
)
for moment, shade in ((0, "0.7"), (20, "0.55"), (-1, "0.1")):
    draw_from_above(top, car, q[moment], color=shade, linewidth=0.6)
for wheel, color in (("rear_left", palette.GREEN), ("front_left", palette.PURPLE)):
    way = car.fk(q, wheel)[:, :2, 3] / cm
    top.plot(*way.T, color=color, linewidth=1.5, label=wheel.replace("_", " "))
corners = scene.object("sign").shapes[0].at(scene.pose("sign")).vertices / cm
top.plot(*corners[:, :2].T, color="0.3", linewidth=3)
top.text(106, 18, "sign", ha="right", color="0.3")
top.set(xlabel="x (cm)", ylabel="y (cm)", aspect="equal", xlim=(-105, 120))
top.legend(frameon=False, loc="lower left")

limit = car.links[1].joint.steering.limit / deg
looks = (
    (run, "gains 1 and 0.5", palette.BLUE, "-"),
    (stuck, "0.5 for both", palette.VERMILLION, "--"),
)
for each, label, color, line in looks:
    steering.plot(each.time, each.q[:, 3] / deg, line, color=color, linewidth=1.5, label=label)
steering.axhspan(-limit - 8, -limit, color="0.9")
steering.text(29, -limit - 4, "beyond the steering limit", ha="right", va="center", color="0.4")
steering.set(xlabel="time (s)", ylabel="steering angle (deg)", xlim=(0, 30), ylim=(-limit - 8, 24))
steering.legend(frameon=False, loc="upper right")
figure.savefig("car.png", dpi=240)

slip = np.abs(run.qd_actual - run.qd).dropna("time").max().item()
print(f"largest difference of what it was told and what it did: {slip:.2f} (m/s, rad/s)")
