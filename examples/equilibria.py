"""Find the equilibria of image-based servoing, and the starts that it traps (L current)."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot.palette import BLACK, BLUE, GREY, VERMILLION

ENDS = {"goal": (BLUE, "."), "minimum": (VERMILLION, "+")}  # colour and marker of starts
SIGNS = {"goal": "o", "minimum": "X", "saddle": "D"}


def around(goal, middle):
    """Return starts on a half sphere: the goal's view rotated about the middle of the marks."""
    x, y = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.9, 0.9, 45)]))
    to = np.column_stack([x, y, -np.sqrt(np.maximum(1 - x**2 - y**2, 0))])[np.hypot(x, y) < 0.9]
    way = goal.position - middle
    way, turn = way / np.linalg.norm(way), np.cross(way, to)
    sine = np.linalg.norm(turn, axis=1)
    rotvec = turn * (np.arctan2(sine, to @ way) / sine)[:, None]
    swing = rs.Pose.exp(np.column_stack([np.zeros_like(to), rotvec]))
    about = rs.Pose.at(*middle)
    return (about @ swing @ about.inv() @ goal).q


plt.rcParams["font.size"] = 9
fig, axes = plt.subplots(1, 2, figsize=(7, 3.7), dpi=240, layout="constrained")
cases = {"local_minimum": "four points in a plane", "tilted_square": "a square seen from the side"}
for ax, (name, title) in zip(axes, cases.items(), strict=True):
    scenario = rs.load_scenario(rs.examples.path(name))
    scene, task = scenario.scene, scenario.task
    print(name, rs.equilibria(scene, task), sep="\n")
    marks, q_goal = scene.object().marks, task.goal.q
    goal = rs.Pose.from_quaternion(q_goal[:3], q_goal[3:])
    found = rs.equilibria(scene, task, around(goal, marks.mean(axis=0)))
    for i, each in enumerate(found):
        if each.kind in ENDS:
            colour, marker = ENDS[each.kind]
            x, y = found.starts[found.ends == i, :2].T
            ax.plot(x, y, marker, color=colour, ms=3, alpha=0.8, label=f"ends at the {each.kind}")
        x, y, _ = rs.Pose(each.T_c_o).inv().position  # the target is at the origin
        ax.plot(x, y, SIGNS[each.kind], color=BLACK, ms=8, mec="w", label=each.kind, zorder=3)
    ax.fill(*marks[:, :2].T, color=GREY, zorder=2)
    ax.set(title=title, xlabel="camera x (m)", ylabel="camera y (m)", aspect="equal")
    ax.invert_yaxis()  # as the camera sees it: x to the right, y down
handles, labels = axes[0].get_legend_handles_labels()
fig.legend(handles, labels, loc="outside lower center", ncols=5, markerscale=1.5, columnspacing=1.2)
fig.savefig("equilibria.png")
