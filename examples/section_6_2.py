"""Section 6.2 of the chapter: two cameras watch a Rhino XR-4 place a cube (figs 15, 16)."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.units import cm, deg

TOOL = "rhino_xr4.tool"
START = 30 * cm, 10 * cm, 20 * cm, 90 * deg  # of the cube: x, y, z, yaw
GOAL = 25 * cm, -20 * cm, 5 * cm, 0 * deg
SIDE = 5 * cm * np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0]])  # marks a, b, c on a side face
TOP = 5 * cm * np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]])
T_tool_cube = rs.Pose.at(-2.5 * cm, 2.5 * cm, 5 * cm, rpy=(np.pi, 0, 0))  # below the fingers


def placed(x, y, z, yaw):
    """Return the pose of the cube; its origin is corner a."""
    return rs.Pose.at(x, y, z, rpy=(0, 0, yaw))


def holding(cube):
    """Return joints of the Rhino that hold the cube there, with the tool pointing straight down."""
    T_w_tool = placed(*cube) @ T_tool_cube.inv()
    x, y, z = T_w_tool.position
    wrist = np.hypot(x, y) - 0.95 * cm, z + 16.83 * cm - 26.04 * cm  # out and up from the shoulder
    shoulder = np.arctan2(y, x)
    elbow = 2 * np.arccos(np.hypot(*wrist) / (2 * 22.86 * cm))  # both links are 22.86 cm long
    upper_arm = -np.arctan2(wrist[1], wrist[0]) - elbow / 2
    yaw = np.arctan2(T_w_tool.matrix[1, 0], T_w_tool.matrix[0, 0])
    return np.array([shoulder, upper_arm, elbow, -upper_arm - elbow, shoulder - yaw])


def looking(name, eye, target=(0.27, -0.04, 0.14)):
    """Return a camera at `eye` that looks at a point, with horizontal image rows."""
    z = np.subtract(target, eye)
    x = np.cross(z, (0, 0, 1))
    axes = [axis / np.linalg.norm(axis) for axis in (x, np.cross(z, x), z)]
    pose = rs.Pose(np.vstack([np.column_stack([*axes, eye]), (0, 0, 0, 1)]))
    body = rs.CameraBody(9 * cm, 5 * cm, 5 * cm)
    lens = rs.Camera([[650, 0, 319.5], [0, 650, 239.5], [0, 0, 1]], size=(640, 480), body=body)
    return rs.MountedCamera(name, lens, pose=pose)


def block(color):
    """Return a cube of 5 cm, with corner a at the origin."""
    return rs.Block(5 * cm, 5 * cm, 5 * cm, color).at(rs.Pose.at(2.5 * cm, 2.5 * cm, 2.5 * cm))


def grey(robot):
    """Return the robot in one colour; green and cyan are for the cube and its goal."""
    links = []
    for link in robot.links:
        shapes = [replace(shape, color="dimgray") for shape in link.shapes]
        links.append(replace(link, shapes=shapes))
    return replace(robot, links=links)


def workstation(marks):
    """Return the Rhino with the green cube, its cyan goal, and two cameras that see both sides."""
    cube = rs.Object("cube", block("g"), marks, T_tool_cube, on=TOOL)
    goal = rs.Object("goal", block("c"), np.empty((0, 3)), placed(*GOAL))
    eyes = [looking("left", (0.85, -0.45, 0.45)), looking("right", (0.95, -0.25, 0.45))]
    return rs.Scene([grey(rs.robots.rhino_xr4())], [goal, cube], eyes)


def place(scene, variant):
    """Run the chapter's law: corrected, as printed, or completed."""
    task = rs.Placing(goal=holding(GOAL), target="cube", camera=("left", "right"), variant=variant)
    return rs.simulate(scene, task, q0=holding(START), dt=0.04, duration=20)


def report(scene, variant, run):
    """Print a table row: outcome, path length of mark a, remaining angle, rotation of the tool."""
    lived = run.dropna("time")
    twist = scene.robot().jacobian(lived.q.values) @ lived.qd.values[..., None]
    at_end = rs.Pose(scene.pose("cube", run.q_end.values).matrix)
    off = np.linalg.norm((placed(*GOAL).inv() @ at_end).rotvec) / deg
    print(
        f"{variant:9}  {rs.Outcome(int(run.outcome)).name:13}  {float(run.end_time):6.2f} s"
        f"  {float(run.path_length):7.3f} m  {off:6.2f} deg"
        f"  {np.abs(twist[:, 3:5]).max():8.0e} rad/s"
    )


def edges(cube):
    """Return the ends (12, 2, 3) of the edges of a cube in the world."""
    shape = block("k").at(placed(*cube))
    return shape.vertices[shape.edges]


def draw_start(scene):
    """Draw figure 15: the initial configuration, and the image of the left camera."""
    q0 = holding(START)
    figure = rs.plot.scene(scene, q0)
    figure.savefig("placing_start.png", dpi=240)
    figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
    for name, cube, color in (("cube", START, "tab:green"), ("goal", GOAL, "tab:cyan")):
        for edge in edges(cube):
            axes.plot(*scene.view(q0, "left", edge).pixels.T, color=color, linewidth=0.8)
        marks = scene.view(q0, "left", placed(*cube) @ SIDE).pixels
        axes.plot(*marks.T, color=color, marker=(6, 2, 0), linestyle="none", label=name)
    axes.set(xlim=(-0.5, 639.5), ylim=(479.5, -0.5), xlabel="column (px)", ylabel="row (px)")
    axes.set(aspect="equal", title="image of the left camera at the start")
    axes.legend(loc="lower right")
    figure.savefig("placing_start_left.png", dpi=240)


LINES = {
    "printed": {"color": "tab:red", "linestyle": "--", "linewidth": 2},
    "corrected": {"color": "tab:blue", "linewidth": 4},
    "completed": {"color": "black", "linestyle": ":", "linewidth": 2},
}


def draw_paths(scene, runs):
    """Draw the paths of mark a under the three laws, from above and from the side."""
    figure, panels = plt.subplots(1, 2, sharex=True, figsize=(7.2, 5.2), layout="constrained")
    for axes, (title, j) in zip(panels, (("from above", 1), ("from the side", 2)), strict=True):
        for variant, look in LINES.items():
            way = scene.pose("cube", runs[variant].dropna("time").q.values).position / cm
            label = f"{variant}: {float(runs[variant].path_length):.3f} m"
            axes.plot(way[:, 0], way[:, j], **look, label=label)
        for cube, color, name in ((START, "tab:green", "start"), (GOAL, "tab:cyan", "goal")):
            ends = edges(cube)[:, :, [0, j]].T / cm
            axes.plot(*ends, color=color, label=[f"cube at {name}"] + 11 * [None])
        axes.set(aspect="equal", anchor="N", title=title, xticks=range(0, 31, 10))
        axes.set(xlabel="x (cm)", ylabel=f"{'xyz'[j]} (cm)")
        axes.grid(True, color="0.9")
    panels[1].legend(
        loc="upper left", bbox_to_anchor=(0, -0.25), frameon=False, title="paths of mark a"
    )
    figure.savefig("placing_paths.png", dpi=240)


scene, top = workstation(SIDE), workstation(TOP)
runs = {variant: place(scene, variant) for variant in ("corrected", "printed", "completed")}
print("law        outcome        after     path of a   angle left  largest |ωx|, |ωy|")
for variant, run in runs.items():
    report(scene, variant, run)
print("The same with three marks on the top, whose normal never turns:")
for variant in ("corrected", "completed"):
    report(top, variant, place(top, variant))

draw_start(scene)
rs.plot.run(runs["corrected"], scene, "left", TOOL).savefig("placing.png", dpi=130)  # figure 16
draw_paths(scene, runs)
