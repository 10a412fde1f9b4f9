"""Pictures of tags and boards against their rays."""

import numpy as np
import pytest
from ray_casting import find_psnr

import robsim as rs
from robsim.shapes import Light
from robsim.vision import Board, Tag, render_targets

FULL = Light(ambient=1.0)
K = np.array([[150.0, 3.0, 80.0], [0.0, 150.0, 60.0], [0.0, 0.0, 1.0]])
LENSES = {
    "pinhole": {},
    "barrel": {"distortion": (-0.25, 0.06, 0.001, -0.002)},
    "fisheye": {"distortion": (-0.02, 0.01, 0.0, 0.0), "lens": "fisheye"},
}


@pytest.mark.parametrize("lens", LENSES)
def test_tags_and_boards_are_as_by_their_rays(lens):
    targets = {
        Tag("tag36h11", 7, size=0.3): rs.Pose.at(-0.25, -0.1, 1.0, rpy=(0.5, 0.3, 0.1)),
        Board("DICT_4X4_50", 5, 4, 0.06, 0.04): rs.Pose.at(0.1, 0.0, 0.9, rpy=(-0.4, 0.2, 0.3)),
    }
    camera = rs.MountedCamera("eye", rs.Camera(K, (160, 120), **LENSES[lens]))
    things = [
        rs.Object(f"thing{k}", pose=pose, **{type(target).__name__.lower(): target})
        for k, (target, pose) in enumerate(targets.items())
    ]
    scene = rs.Scene(objects=things, cameras=camera)
    exact = render_targets(camera.camera, targets, samples=6).astype(float)
    fine = scene.picture(samples=2, light=FULL, background=128, exact=True)
    assert find_psnr(fine, exact) > 40
    assert np.median(abs(fine - exact)) == 0.0
