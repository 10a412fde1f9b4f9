"""Run the chapter's section 6.1: a Rhino XR-4 servoing on a cube."""

import numpy as np

import robsim as rs
from robsim.units import cm, deg

rhino = rs.robots.rhino_xr4()
top = np.array([[-2.5, -2.5, 2.5], [2.5, -2.5, 2.5], [2.5, 2.5, 2.5], [-2.5, 2.5, 2.5]]) * cm
block = rs.Block(5 * cm, 5 * cm, 5 * cm, color="y")
cube = rs.Object("cube", block, marks=top, pose=rs.Pose.at(28 * cm, 0, 2.5 * cm))
lens = rs.Camera([[800, 0, 319.5], [0, 800, 239.5], [0, 0, 1]], size=(640, 480))
eye = rs.MountedCamera("camera", lens, on="rhino_xr4.tool", pose=rs.Pose.at(0, 5 * cm, -10 * cm))
scene = rs.Scene([rhino], [cube], [eye])

goal = rhino.home + np.array([-20, -12, 20, -12, -40]) * deg
task = rs.IBVS(
    goal=goal, features=rs.features.PixelPoints(), law=rs.laws.CameraLaw(length=1 * cm), gain=0.8
)
run = rs.simulate(scene, task, q0=rhino.home, dt=0.04, duration=20)

print(rs.Outcome(int(run.outcome)).message, f"after {float(run.end_time):.2f} s")
rs.plot.run(run, scene, goal=task).savefig("rhino.png", dpi=130)
rs.save_run(run, "rhino.nc")
