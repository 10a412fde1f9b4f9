"""Find the starts from which image-based servoing of four points is trapped."""

import matplotlib.pyplot as plt

import robsim as rs
from robsim.units import deg

experiment = rs.load_scenario(rs.examples.path("local_minimum"))
start = rs.starts.LookAt(distance=(0.5, 1.5), axis=(0, 0, -1), cone=60 * deg)
laws = {f"L {name}": name for name in ("current", "mean", "desired")}
study = rs.study(experiment, 4000, seed=1, start=start, vary={"task.interaction": laws})
print(study)
print(study.paired("task.interaction"))

one = {"axis": (0, 0, -1), "distance": (1.0, 1.0), "cone": 60 * deg}  # at the distance of the goal
for cone in (15, 30, 45, 60, 75):
    some = rs.starts.LookAt(**{**one, "cone": cone * deg})
    trapped = rs.study(experiment, 2000, seed=1, start=some).counts().rows["all"][2]
    print(f"within {cone} degrees of the axis: {trapped['LOCAL_MINIMUM']} trapped")
upright = rs.starts.LookAt(**one, roll=(0, 0))  # a slice: with the roll of the goal image
at_once = rs.study(experiment, 6000, seed=2, start=upright, vary={"task.interaction": laws})
figure = rs.plot.study_basin(at_once, "start_x", "start_y", by="task.interaction")
figure.savefig("convergence_domain.png", dpi=160)
plt.close(figure)
