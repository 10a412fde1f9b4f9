"""Compare drives of a Puma 560 over a thousand starts: a lag, velocity loops, computed torque."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette
from robsim.units import deg

RUNS = 1000
SETTLED = 1.0  # px: the marks of an image that counts as reached
DRIVES = {
    "lag of 50 ms": rs.Actuation(lag=0.05),
    "velocity loop, 20 rad/s": rs.Actuation(
        drive=rs.drives.VelocityLoop(bandwidth=20, integral_rate=0)
    ),
    "with an integral of 5/s": rs.Actuation(
        drive=rs.drives.VelocityLoop(bandwidth=20, integral_rate=5)
    ),
    "with an integral of 40/s": rs.Actuation(
        drive=rs.drives.VelocityLoop(bandwidth=20, integral_rate=40)
    ),
    "computed torque, 20 rad/s": rs.Actuation(drive=rs.drives.ComputedTorque(frequency=20)),
}
GAINS = 2.0, 5.0, 10.0, 20.0, 40.0, 60.0  # per second

base = rs.load_scenario(rs.examples.path("joint_friction")).with_(record="summary", hold=True)
turns = np.random.default_rng(1).uniform(-1, 1, (RUNS, 6)) * np.array([4, 3, 3, 6, 5, 10]) * deg
base = base.with_(start=base.scene.home + turns)


def share_that_settles(actuation, gain):
    """Return the share of the runs that see every mark within a pixel of its goal after 4 s."""
    run = base.with_(actuation=actuation).at("task.gain", gain).run()
    return float((run.pixel_error < SETTLED).mean())


figure, axes = plt.subplots(figsize=(7, 3.6), layout="constrained")
print(f"{'share of settled runs at a gain of':36}", *(f"{gain:6g}" for gain in GAINS))
for (name, actuation), color in zip(DRIVES.items(), palette.CYCLE, strict=False):
    shares = [share_that_settles(actuation, gain) for gain in GAINS]
    print(f"{name:36}", *(f"{share:6.3f}" for share in shares))
    axes.plot(GAINS, [100 * share for share in shares], "o-", color=color, label=name)
axes.set(xlabel="gain of the task (1/s)", ylabel="settled runs (percent)", xscale="log")
axes.set_xticks(GAINS, labels=[f"{gain:g}" for gain in GAINS])
axes.minorticks_off()
axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
figure.savefig("compare_drives.png", dpi=240)
