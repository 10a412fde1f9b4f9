"""Under L current, three marks move exactly straight in the image, and four marks nearly."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette


def off_the_chord(run):
    """Return image paths (time, mark, axis), and their distances from the chord over its length."""
    way = run.pixels.dropna("time", how="all").values
    chord = way[-1] - way[0]
    x, y = np.moveaxis(way - way[0], -1, 0)
    return way, np.abs(x * chord[:, 1] - y * chord[:, 0]) / (chord**2).sum(axis=-1)


plt.rcParams.update({"font.size": 9})
figure, (image, away) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
cases = {"straight_image_lines": ("three marks", "--"), "visp_tutorial": ("four marks", "-")}
print("largest distance from the chord, in percent of the chord")
print("dt       three marks   four marks")
for dt, color in ((40, palette.VERMILLION), (10, palette.BLUE), (2.5, palette.GREEN)):
    largest = []
    for name, (label, line) in cases.items():
        run = rs.load_scenario(rs.examples.path(name), [f"run.dt={dt} ms"]).run()
        way, distance = off_the_chord(run)
        largest.append(100 * distance.max())
        time = dt * 1e-3 * np.arange(len(way))
        look = {"color": color, "linestyle": line, "label": f"{label}, {dt} ms"}
        away.plot(time, 100 * distance.max(axis=1), **look)
    print("{:4} ms  {:11.3f}  {:11.3f}".format(dt, *largest))

image.plot(way[:, :, 0], way[:, :, 1], color=palette.GREEN)  # four marks, smallest dt
for j in range(way.shape[1]):
    image.plot(*way[[0, -1], j].T, "k--", linewidth=0.9, label=None if j else "chord")
image.plot(*way[0].T, "ko", markerfacecolor="w", label="start")
image.plot(*way[-1].T, "kx", label="goal")
image.set(xlabel="column (px)", ylabel="row (px)", aspect="equal", xlim=(0, 640), ylim=(480, 0))
image.set_title("ViSP's tutorial case, four marks")
image.legend(frameon=False, loc="lower left", fontsize=8)
away.set(xlabel="time (s)", ylabel="distance from the chord (%)", xlim=(0, 12), ylim=(0, 1))
away.set_title("the mark that is farthest off")
away.legend(frameon=False)
figure.savefig("straight_image_lines.png", dpi=240)
