"""ViSP's photometric example with its own picture, of the Debian package visp-images-data.

The iterations of ViSP are stored in tests/oracles/photometric_visp.json, by
benchmarks/peer_photometric.cpp.
"""

import json
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.shapes import Block, BlockPictures, Light

PICTURE = Path("/usr/share/visp-images-data/ViSP-images/Klimt/Klimt.pgm")
STORED = json.loads(
    (Path(__file__).parents[1] / "oracles" / "photometric_visp.json").read_text(encoding="utf-8")
)
WIDTH, HEIGHT, THICKNESS = 0.6, 0.43, 1e-4
COLUMNS, ROWS = 558, 560  # of the picture
PIXELS = (320 - 20) * (240 - 20)
DT = 0.04

pytestmark = pytest.mark.skipif(not PICTURE.exists(), reason="needs visp-images-data of Debian")


def build_scene():
    """ViSP's corners are the centres of the corner pixels, RobSim's are their outer corners."""
    paper = Block(
        WIDTH * COLUMNS / (COLUMNS - 1),
        HEIGHT * ROWS / (ROWS - 1),
        THICKNESS,
        pictures=BlockPictures(top=str(PICTURE)),
        pose=rs.Pose.at(0, 0, -THICKNESS / 2),
    )
    marks = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [WIDTH / 2, HEIGHT / 2, 1]
    poster = rs.Object("poster", paper, marks=marks, pose=rs.Pose.at(rpy=(np.pi, 0, 0)))
    K = [[870, 0, 160], [0, 870, 120], [0, 0, 1]]
    eye = rs.MountedCamera("eye", rs.Camera(K, (320, 240)), on="free_camera.body")
    return rs.Scene(rs.robots.free_camera(), poster, eye, light=Light(ambient=1.0), background=0)


def camera_at(pose):
    """Coordinates of the camera that sees the poster at a pose (m, rotation vector in degrees)."""
    return rs.Pose.at(*pose[:3], rotvec=np.radians(pose[3:])).inv().q


@pytest.mark.parametrize("row", STORED["rows"], ids=lambda row: row["name"])
def test_the_loop_of_visp_takes_as_many_iterations(row):
    assert STORED["made_by"].startswith("ViSP 3.5.0")
    feature = rs.features.Luminance(
        np.sqrt(10_000 / PIXELS),
        step=0,
        derivative="seven_taps",
        damping=0.01,
        switch_time=89.5 * DT,
        final_damping=1e-4,
    )
    goal = rs.tasks.TaughtGoal(camera_at([0, 0, 1, 0, 0, 0]))
    task = rs.IBVS(goal, features=feature, interaction="desired", gain=30.0)
    run = rs.simulate(build_scene(), task, camera_at(row["pose"]), dt=DT, duration=400 * DT)
    assert (run.outcome == rs.Outcome.CONVERGED) == row["converged"]
    if row["converged"]:
        iterations = round(float(run.end_time) / DT) + 1
        assert iterations == pytest.approx(row["iterations"], abs=2)
        assert float(run.distance_to_goal) < 1e-3
