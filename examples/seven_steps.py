"""The chapter's procedure (section 4.1) in seven steps: a camera crane, built from nothing."""

import numpy as np

import robsim as rs
from robsim.units import cm, deg

# 1. Link frames and their Denavit-Hartenberg table: theta, d, a, alpha
rows = [
    [0, 60 * cm, 0, -90 * deg],  # the column turns: pan
    [0, 0, 0, 90 * deg],  # the boom is raised: tilt
    [0, 50 * cm, 0, 0],  # and drawn out along its axis
    [0, 10 * cm, 0, 0],  # the head turns about it: roll
]
joints, names = "RRPR", ["column", "boom", "slide", "head"]
limits = np.array([[-170 * deg, 170 * deg], [0, 120 * deg], [0, 40 * cm], [-180 * deg, 180 * deg]])

# 2. Each link as blocks, wheels and camera bodies
plinth = rs.Block(50 * cm, 50 * cm, 10 * cm, color="k")
roller = rs.Wheel(6 * cm, 4 * cm, n=24, color="k")
post = rs.Block(10 * cm, 10 * cm, 40 * cm, color="b")
pivot = rs.Wheel(7 * cm, 12 * cm, n=24, color="b")
sleeve = rs.Block(9 * cm, 9 * cm, 45 * cm, color="r")
rod = rs.Block(5 * cm, 5 * cm, 65 * cm, color="y")
head = rs.Block(8 * cm, 12 * cm, 4 * cm, color="m")
camera_body = rs.CameraBody(10 * cm, 8 * cm, 6 * cm, color="k")

# 3. Assembled on the axes of their links
lying = rs.Pose.at(rpy=(90 * deg, 0, 0))  # the axis of a wheel along y
feet = [(x, y) for x in (-18 * cm, 18 * cm) for y in (-25 * cm, 25 * cm)]
shapes = [
    [plinth.at(rs.Pose.at(0, 0, 11 * cm))]
    + [roller.at(rs.Pose.at(x, y, 6 * cm) @ lying) for x, y in feet],
    [post.at(lying).at(rs.Pose.at(0, 24 * cm, 0)), pivot],
    [sleeve.at(rs.Pose.at(0, 0, 15 * cm))],
    [rod.at(rs.Pose.at(0, 0, -22.5 * cm))],
    [head.at(rs.Pose.at(0, 0, -4 * cm)), camera_body.at(rs.Pose.at(0, 0, -2 * cm))],
]

# 4. and 5. The robot as one value, and its link frames from the base
home = np.array([0, 80 * deg, 10 * cm, 0])
crane = rs.Robot.from_dh(rows, "standard", joints, home, limits, "crane", names, shapes)
for link, T in zip(crane.links, crane.frames(home), strict=True):
    print(f"{link.name:7} at {np.round(T[:3, 3] / cm, 1)} cm")

# 6. Moved and drawn
for name, q in [("home", home), ("raised", [50 * deg, 50 * deg, 35 * cm, 45 * deg])]:
    rs.plot.robot(crane, q).savefig(f"crane_{name}.png", dpi=270)

# 7. Trajectories, and a task guided by the camera
poster = rs.Object(
    "poster",
    rs.Block(40 * cm, 30 * cm, 1 * cm, color="g"),
    marks=np.array([[-15, -10, 0], [15, -10, 0], [15, 10, 0], [-15, 10, 0]]) * cm,
    pose=rs.Pose.at(2.0, 20 * cm, 40 * cm, rpy=(-90 * deg, 0, -90 * deg)),
)
eye = rs.MountedCamera(
    "camera",
    rs.Camera([[600, 0, 319.5], [0, 600, 239.5], [0, 0, 1]], size=(640, 480)),
    on="crane.head",
    pose=rs.Pose.at(rpy=(0, 0, -90 * deg)),  # x points right when the boom is level
)
scene = rs.Scene(crane, poster, eye)
turned = {"column": 15 * deg, "boom": 90 * deg}
above = [65 * cm, 18 * cm, 65 * cm]
goal = [6 * deg, 97 * deg, 30 * cm, 3 * deg]

mission = rs.Mission(
    [
        rs.Phase("turn to it", rs.FollowJoints(turned, duration=2)),
        rs.Phase("and straight up", rs.FollowPath(above, mask="position", duration=2)),
        rs.Phase("servo on it", rs.IBVS(goal=goal, gain=1.0)),
    ]
)
story = rs.Experiment(scene, mission, home, duration=60).run()
print(story)
run = story.legs[-1].run
rs.plot.run(run, scene, goal=goal).savefig("crane_servo.png", dpi=130)
