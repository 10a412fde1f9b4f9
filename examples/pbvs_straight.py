"""Two forms of PBVS: a straight path of the camera in space, or of the target in the image."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

FORMS = {"goal": (palette.BLUE, "-"), "camera": (palette.VERMILLION, "--")}


def ways(form, dt):
    """Return paths: camera in the world, target in camera axes, target in the image (pixels)."""
    changes = [f"task.form={form}", f"run.dt={dt} ms"]
    run = rs.load_scenario(rs.examples.path("pbvs_straight"), changes).run()
    T = run.camera_pose.dropna("time").values
    centre = T[:, :3, 3]
    origin = -np.einsum("tij,ti->tj", T[:, :3, :3], centre)
    return centre, origin, 800 * origin[:, :2] / origin[:, 2:] + (319.5, 239.5)


def bend(way):
    """Return the largest distance from the chord divided by the length of the chord."""
    chord = way[-1] - way[0]
    gone, length = way - way[0], np.linalg.norm(chord)
    along = gone @ chord / length**2
    return np.linalg.norm(gone - along[:, None] * chord, axis=1).max() / length


plt.rcParams.update({"font.size": 9})
figure, (space, image) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
print("largest distance from the chord, in percent of it")
print("form     dt       camera centre   target's origin   in the image")
for form, (color, line) in FORMS.items():
    for dt in (40, 20, 10):
        found = ways(form, dt)
        print(f"{form:7} {dt:3} ms" + "".join(f"{100 * bend(way):16.3f}" for way in found))
    centre, _, pixels = found
    space.plot(100 * centre[:, 0], -100 * centre[:, 2], color=color, linestyle=line, label=form)
    image.plot(*pixels.T, color=color, linestyle=line, label=form)
for axes, way in ((space, 100 * centre[:, ::2] * (1, -1)), (image, pixels)):
    axes.plot(*way[0], "ko", markerfacecolor="w", label="start")
    axes.plot(*way[-1], "kx", label="goal")
    axes.legend(frameon=False, title="form")
space.set(xlabel="x (cm)", ylabel="distance from the target (cm)", title="way of the camera")
image.set(xlabel="column (px)", ylabel="row (px)", title="the target's origin in the image")
image.invert_yaxis()
figure.savefig("pbvs_straight.png", dpi=240)
