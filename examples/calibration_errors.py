"""A wrong camera model moves the final pose for a computed goal, but not for a shown goal."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

SCHEMES = {"PBVS": ["task.kind=pbvs"], "IBVS": ["task.kind=ibvs", "task.features=pixels"]}
GOALS = {"shown": 'task.goal={position="0, 0, -1 m"}', "computed": "task.gain=1"}


def stops(*changes):
    """Return the run, and the final distance of the camera."""
    run = rs.load_scenario(rs.examples.path("calibration_errors"), changes).run().dropna("time")
    return run, float(-run.q_end[2])


plt.rcParams.update({"font.size": 9})
figure, (ways, ends) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
print("goal      scheme   outcome     distance (1 m was asked for)")
for goal, color in zip(GOALS, (palette.GREEN, palette.VERMILLION), strict=True):
    for scheme, line in zip(SCHEMES, ("-", "--"), strict=True):
        run, distance = stops(*SCHEMES[scheme], GOALS[goal])
        outcome = rs.Outcome(int(run.outcome)).name
        print(f"{goal:9} {scheme:8} {outcome:11} {distance:.5f} m")
        label = f"{goal}, {scheme}"
        ways.plot(run.time, -run.q[:, 2], color=color, linestyle=line, label=label)
ways.axhline(1, color="k", linewidth=0.8)
ways.set(xlabel="time (s)", ylabel="distance (m)", xlim=(0, 8), title="focal length 10 % too long")
ways.legend(frameon=False)

ratios = np.linspace(0.8, 1.25, 10)
for scheme, (marker, color) in zip(SCHEMES, (("o", palette.BLUE), ("x", "k")), strict=True):
    focal = [f"belief.cameras.camera.focal={500 * r:.1f}" for r in ratios]
    distances = [stops(*SCHEMES[scheme], change)[1] for change in focal]
    ends.plot(ratios, distances, marker, color=color, label=scheme, markersize=5)
fine = np.linspace(0.78, 1.27)
ends.plot(fine, 1 / fine, color=palette.SKY_BLUE, label="f / believed f", zorder=0)
ends.set(xlabel="believed focal length / true", ylabel="distance at the end (m)")
ends.set_title("goal computed for 1 m")
ends.legend(frameon=False)
figure.savefig("calibration_errors.png", dpi=240)

print("a goal tilted by 30 degrees, computed:")
for scheme, changes in SCHEMES.items():
    run, _ = stops(*changes, "task.goal.computed.rotvec=30, 0, 0 deg")
    outcome = rs.Outcome(int(run.outcome)).name
    print(f"{scheme:8} {outcome:13} {float(run.pixel_error):5.2f} px from the image asked for")
