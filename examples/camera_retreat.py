"""Chaumette 1998: a pure rotation about the optical axis under three interaction matrices."""

import numpy as np

import robsim as rs

scene = rs.Scene(
    [rs.robots.free_camera()],
    [rs.Object("square", marks=0.25 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]))],
    [rs.Mounted("camera", rs.Camera(np.eye(3)), on="free_camera.body")],
)
goal = rs.Pose.at(0, 0, -1)
print("depth on the way, in units of the depth at the goal")
print("angle   current (largest)   desired (smallest)   mean (largest)")
for degrees in (30, 60, 90, 120):
    start = goal @ rs.Pose.at(rpy=(0, 0, np.radians(degrees)))
    depth = []
    for interaction in ("current", "desired", "mean"):
        task = rs.IBVS(goal=goal, interaction=interaction)
        run = rs.simulate(scene, task, start, dt=5e-4, duration=15)
        depth.append(-run.camera_pose[:, 2, 3])
    current, desired, mean = depth
    numbers = float(current.max()), float(desired.min()), float(mean.max())
    print("{:5}   {:17.4f}   {:18.4f}   {:14.4f}".format(degrees, *numbers))
