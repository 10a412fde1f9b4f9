"""Which law loses its target more often: one scene, many starts, two laws."""

import numpy as np

import robsim as rs

scenario = rs.load_scenario(rs.examples.path("chapter_6_1"))
scene, home = scenario.scene, scenario.scene.home
starts = home + np.random.default_rng(0).uniform(-0.2, 0.2, (10_000, 5))
low, high = scene.limits.T
starts = np.clip(starts, low, high)

for law in ("joint", rs.CameraLaw(length=0.01)):
    task = rs.IBVS(goal=home, features=rs.PixelPoints(), law=law, gain=0.8)
    run = rs.simulate(scene, task, starts, duration=20, record="summary")
    counts = {o.name: int((run.outcome == o).sum()) for o in rs.Outcome}
    print(law if isinstance(law, str) else "camera", {k: n for k, n in counts.items() if n})
    arrived = run.where(run.outcome == rs.Outcome.CONVERGED)
    print(f"  median path {100 * float(arrived.path_length.median()):.2f} cm")
