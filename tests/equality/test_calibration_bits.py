"""A calibration has the same bits for any number of threads of the linear algebra."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import numpy as np
import robsim as rs
bench = rs.load_scenario(rs.examples.path("calibration_bench"))
looks = rs.starts.LookAt("board", distance=(0.3, 0.9), cone=0.9)
q = rs.calibration.sample_viewpoints(bench, 60, looks, seed=3)
views = rs.calibration.simulate_views(bench, q[:30])
found = rs.calibrate(views, ["focal", "center", "distortion"])
chosen = found.next_poses(q, 5)
parts = found.covariance, found.mount.matrix, found.place.matrix, found.camera.K, chosen.position
print(b"".join(np.ascontiguousarray(part).tobytes() for part in parts).hex())
"""


@pytest.mark.full
def test_threads_change_no_bit():
    """A thousand marks in 30 views are many enough for several threads to share a product."""
    printed = []
    for threads in ("1", "2", "4"):
        names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
        own = {**os.environ, **dict.fromkeys(names, threads)}
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=own, check=True, capture_output=True, text=True
        )
        printed.append(done.stdout)
    assert len(printed[0]) > 1000 and printed[0] == printed[1] == printed[2]
