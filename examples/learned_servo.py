"""A camera servoes by a network to posters that the network has never seen.

    python learned_servo.py

Draws the matches of the network at a start, and the errors of many runs beside the luminance.
"""

import matplotlib.pyplot as plt
import numpy as np
from pose_network.evaluate import make_scene, succeed
from pose_network.network import FOCAL, HEIGHT, PLACES, WIDTH, reduce_picture
from pose_network.pose_feature import LearnedPose, make_luminance, make_task
from pose_network.posters import draw_poster
from pose_network.views import draw_starts

import robsim as rs
from robsim.plot import palette

RUNS, GAIN, DURATION = 12, 5.0, 5.0  # starts, 1/s, seconds
MATCHES, GAP = 30, 8  # matches in the figure, and columns between the pictures


def draw_matches(ax, feature, goal, seen):
    """Draw the heaviest matches of cells between the pictures at the goal and at a start."""
    prepared = feature.network.prepare_goal(goal)
    features = feature.network.extract(reduce_picture(seen))
    rolled = feature.network.choose_roll(prepared, features)
    places, weights = feature.network.match(rolled.features, features)
    weights = weights * rolled.inside
    c, s = np.cos(rolled.angle), np.sin(rolled.angle)
    cells = PLACES @ [[c, s], [-s, c]]  # in the picture that is not rolled
    middle = (np.array([WIDTH, HEIGHT]) - 1) / 2
    both = np.full((HEIGHT, 2 * WIDTH + GAP), 255)
    both[:, :WIDTH], both[:, -WIDTH:] = goal, seen
    ax.imshow(both, cmap="gray", vmin=0, vmax=255)
    for k in np.argsort(weights)[-MATCHES:]:
        at_goal = FOCAL * cells[k] + middle
        at_start = FOCAL * places[k] + middle + [WIDTH + GAP, 0]
        ax.plot(*np.transpose([at_goal, at_start]), ".-", linewidth=0.9, markersize=3)
    ax.axis("off")
    ax.set_title(f"goal and a start: {MATCHES} of the {len(cells)} matches")


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


def main():
    """Run the schemes and draw the figure."""
    scene = make_scene(draw_poster("cells", 3))
    starts = rs.Pose(draw_starts(np.random.default_rng(3), RUNS, 60, 0.10, 0.50))
    schemes = {
        "luminance": rs.IBVS(features=make_luminance(1), interaction="mean", gain=GAIN),
        "network, then luminance": make_task(GAIN),
    }
    runs = {}
    for name, task in schemes.items():
        runs[name] = rs.simulate(scene, task, starts, duration=DURATION, hold=True)
        print(f"{name}: {succeed(runs[name]).sum()} of {RUNS} runs within 2 mm and 0.2 degrees")
    plt.rcParams["font.size"] = 9
    figure, axes = plt.subplots(
        1, 3, figsize=(12, 3.4), layout="constrained", width_ratios=[2, 1.1, 1.1]
    )
    R = starts.matrix[:, :3, :3]
    rolled = np.argmax(np.abs(np.arctan2(R[:, 1, 0], R[:, 0, 0])))
    pictures = scene.picture(), scene.picture(runs["luminance"].q0.values[rolled])
    draw_matches(axes[0], LearnedPose(), *pictures)
    draw_errors(axes[1:], runs)
    handles, labels = axes[1].get_legend_handles_labels()
    axes[0].legend(handles, labels, frameon=False, loc="upper center", bbox_to_anchor=(0.5, 0))
    figure.savefig("learned_servo.png", dpi=140)


if __name__ == "__main__":
    main()
