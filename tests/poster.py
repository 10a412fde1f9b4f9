"""A poster of forty marks above which a camera flies, and starts that do not see all of them."""

import numpy as np

import robsim as rs
from robsim.suites.published import vit_500_poster

POSTER = vit_500_poster.suite()
GOAL, SCENE = POSTER.task_goal, POSTER.scene
CAMERA = SCENE.camera().camera
LESS = [i for i, each in enumerate(POSTER.groups["square"]) if "less" in each]
BESIDE = POSTER.goal + np.array([0.01, -0.02, 0.03, 0, 0, 0, 0])
HIDDEN = rs.Sensing(occlusions=rs.imperfections.Occlusion(range(9), start=0.4, end=1.2))
