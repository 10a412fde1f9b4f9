"""The largest stable gain with a slow camera, and with images that are lost at random."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

DT = 0.04  # seconds, as in the scenario


def servo(periods, gain_dt, *changes):
    """Return the scenario with an image every `periods` control periods, at a gain times dt."""
    changes = [f"sensing.period={1000 * DT * periods} ms", f"task.gain={gain_dt / DT}", *changes]
    return rs.load_scenario(rs.examples.path("slow_camera"), changes)


def root_mean_square(gain_dt, lost, steps):
    """Return the rms error of many runs over time, as the second moment of (error, seen error)."""
    arrived = np.array([[1 - gain_dt, 0], [1, 0]])
    kept = np.array([[1, -gain_dt], [0, 1]])
    squares, values = np.ones((2, 2)), [1.0]
    for step in range(steps):
        share = lost if step else 0.0  # the first image arrives
        squares = (1 - share) * arrived @ squares @ arrived.T + share * kept @ squares @ kept.T
        values.append(squares[0, 0])
    return np.sqrt(values)


plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
n = np.arange(1, 9)
left.plot(n, 2 / n, "s-", color=palette.GREY, markersize=3, label="limit: 2 / n")
looks = {
    True: (".", palette.BLUE, "run that settles"),
    False: ("x", palette.VERMILLION, "does not"),
}
for periods in n:
    for share in (0.95, 1.05):
        gain_dt = share * 2 / periods
        run = servo(periods, gain_dt, "start.position=1, -1, -100 cm", "run.duration=60 s").run()
        marker, color, label = looks[int(run.outcome) == rs.Outcome.CONVERGED]
        left.plot(periods, gain_dt, marker, color=color, label=None if periods > 1 else label)
        print(f"an image in {periods} periods, gain dt {gain_dt:.3f}: {label}")
left.legend(frameon=False)
left.set(xlabel="control periods n from image to image", ylabel="gain times dt", yscale="log")
left.set_yticks([0.25, 0.5, 1, 2], labels=["0.25", "0.5", "1", "2"])
left.minorticks_off()

for lost, color, line in zip((0, 0.3, 0.6), palette.CYCLE, palette.LINES, strict=False):
    experiment = servo(1, 0.1, f"sensing.dropped={lost}")
    starts = np.tile(experiment.start, (1000, 1))
    run = experiment.run(start=starts, duration=2.0, hold=True)
    off = np.linalg.norm(run.camera_pose[:, :, :2, 3], axis=-1)  # metres, sideways
    share = np.sqrt((off**2).mean(axis=0)) / off[0, 0]
    right.semilogy(run.time, root_mean_square(0.1, lost, 50), color=palette.LIGHT_GREY, linewidth=4)
    right.semilogy(run.time, share, line, color=color, label=f"{lost:.0%} of the images lost")
right.set(xlabel="time (s)", ylabel="root mean square of the error", ylim=(1e-3, 5))
right.set_title("gain times dt = 0.1; grey: predicted", fontsize=9)
right.legend(frameon=False, loc="upper right")
figure.savefig("slow_camera.png", dpi=240)
