"""A camera servoes by a network to posters that the network has never seen.

    python servo.py

Draws the matches of the network at a start, and the errors of many runs beside the luminance.
"""

import matplotlib.pyplot as plt
import numpy as np
from evaluate import make_scene, succeed
from matplotlib.patches import ConnectionPatch
from network import FOCAL, HEIGHT, PLACES, WIDTH, reduce_picture
from pose_feature import LearnedPose, make_luminance, make_task
from posters import draw_poster
from views import draw_starts

import robsim as rs
from robsim.plot import palette

RUNS, GAIN, DURATION = 12, 5.0, 5.0  # starts, 1/s, seconds


def draw_matches(axes, feature, goal, seen):
    """Draw the heaviest matches of cells between the pictures at the goal and at a start."""
    prepared = feature.network.prepare_goal(goal)
    features = feature.network.extract(reduce_picture(seen))
    rolled = feature.network.choose_roll(prepared, features)
    places, weights = feature.network.match(rolled.features, features)
    c, s = np.cos(rolled.angle), np.sin(rolled.angle)
    cells = PLACES @ [[c, s], [-s, c]]  # in the picture that is not rolled
    middle = (np.array([WIDTH, HEIGHT]) - 1) / 2
    weights = weights * rolled.inside
    for k in np.argsort(weights)[-60:]:
        ends = FOCAL * cells[k] + middle, FOCAL * places[k] + middle
        look = {"color": palette.CYCLE[k % 6], "linewidth": 0.9, "alpha": 0.8}
        axes[0].add_artist(
            ConnectionPatch(*ends, "data", "data", axesA=axes[0], axesB=axes[1], **look)
        )
    for ax, picture, title in zip(axes, (goal, seen), ("goal", "start"), strict=True):
        ax.imshow(picture, cmap="gray", vmin=0, vmax=255)
        ax.set_title(f"{title}, with the heaviest matches" if ax is axes[0] else title)


def draw_errors(axes, runs):
    """Draw the errors of position and rotation of all runs over time."""
    for (name, run), color in zip(runs.items(), (palette.VERMILLION, palette.BLUE), strict=True):
        T = run.camera_pose.values  # of the camera in the world, whose axes are those of the goal
        position = 1e3 * np.linalg.norm(T[:, :, :3, 3], axis=2)
        cosine = (np.trace(T[:, :, :3, :3], axis1=2, axis2=3) - 1) / 2
        rotation = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        label = f"{name}: {succeed(run).sum()} of {RUNS}"
        for ax, values in zip(axes, (position, rotation), strict=True):
            lines = ax.semilogy(run.time, np.maximum(values, 1e-3).T, color=color, linewidth=0.8)
            lines[0].set_label(label)
    for ax, name, limit in zip(axes, ("position (mm)", "rotation (°)"), (2, 0.2), strict=True):
        ax.axhline(limit, color=palette.GREY, linestyle=":")
        ax.set(xlabel="time (s)", title=f"error of {name}")
    axes[0].legend(frameon=False, loc="lower left")


def main():
    """Run the schemes and draw the figure."""
    scene = make_scene(draw_poster("cells", 3))
    starts = rs.Pose(draw_starts(np.random.default_rng(3), RUNS, 60, 0.10, 0.50))
    schemes = {
        "luminance": rs.IBVS(features=make_luminance(early_damping=0.01), gain=GAIN),
        "network, then luminance": make_task(GAIN),
    }
    runs = {}
    for name, task in schemes.items():
        runs[name] = rs.simulate(scene, task, starts, duration=DURATION, hold=True)
        print(f"{name}: {succeed(runs[name]).sum()} of {RUNS} runs within 2 mm and 0.2 degrees")
    plt.rcParams["font.size"] = 9
    figure, axes = plt.subplots(1, 4, figsize=(12, 3.2), layout="constrained")
    R = starts.matrix[:, :3, :3]
    rolled = np.argmax(np.abs(np.arctan2(R[:, 1, 0], R[:, 0, 0])))
    pictures = scene.picture(), scene.picture(runs["luminance"].q0.values[rolled])
    draw_matches(axes[:2], LearnedPose(), *pictures)
    draw_errors(axes[2:], runs)
    figure.savefig("learned_servo.png", dpi=160)


if __name__ == "__main__":
    main()
