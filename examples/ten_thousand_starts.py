"""Compare the path of the camera under three laws, from ten thousand starts."""

import numpy as np

import robsim as rs

scene = rs.load_scenario(rs.examples.path("chapter_6_1")).scene
low, high = scene.limits.T
around = np.random.default_rng(0).uniform(-0.25, 0.25, (10_000, 5))
starts = np.clip(scene.home + around, low, high)

for name, law in [
    ("joint law", rs.laws.JointLaw()),
    ("camera law, 1 cm", rs.laws.CameraLaw(length=0.01)),
    ("camera law, 1 m", rs.laws.CameraLaw(length=1.0)),
]:
    task = rs.IBVS(features="pixels", law=law, gain=0.8)  # the goal is shown at home
    run = rs.simulate(scene, task, starts, duration=30, record="summary")
    counts = {o.name: int((run.outcome == o).sum()) for o in rs.Outcome}
    print(name, {outcome: n for outcome, n in counts.items() if n})
    path = 100 * run.path_length[run.outcome == rs.Outcome.CONVERGED]
    print(f"  path: median {float(path.median()):.2f} cm, longest {float(path.max()):.2f} cm")
