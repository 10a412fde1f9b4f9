"""Digests of the numbers of all shipped scenarios and of typical uses, as JSON on stdout.

    python tests/bit_digests.py [LEVEL]

LEVEL is a processor level, "bitcode", or "numba". By default the package chooses. With a level or
bitcode Numba cannot be imported. All NaN count as one.
"""

import hashlib
import json
import os
import sys

import numpy as np

LEVEL = sys.argv[1] if len(sys.argv) > 1 else ""
if LEVEL == "numba":
    os.environ["ROBSIM_USE_NUMBA"] = "1"
elif LEVEL:
    sys.modules["numba"] = None

import robsim as rs  # noqa: E402
from robsim.kernels.machine import processor_levels  # noqa: E402

if LEVEL not in ("", "numba"):
    levels = [] if LEVEL == "bitcode" else [LEVEL]
    processor_levels.find_levels = lambda: levels


def digest(*arrays):
    """Return a digest of arrays."""
    found = hashlib.sha256()
    for array in map(np.asarray, arrays):
        is_real = array.dtype.kind == "f"
        each = np.where(np.isnan(array), np.nan, array) if is_real else array
        found.update(str((each.dtype, each.shape)).encode())
        found.update(each.tobytes() if each.dtype.kind in "biuf" else str(each.tolist()).encode())
    return found.hexdigest()[:16]


def digest_of_run(run):
    """Return a digest of all variables of a run, or of the runs of a mission."""
    runs = [leg.run for leg in run.legs] if hasattr(run, "legs") else [run]
    return digest(*(each[name].values for each in runs for name in sorted(each.variables)))


def digests_of_examples():
    """Yield (name, digest) of the runs of all shipped scenarios."""
    for name in rs.examples.names():
        run = rs.load_scenario(rs.examples.path(name)).run()
        yield name, digest_of_run(run)


def digests_of_uses():
    """Yield (name, digest) of calibrations, studies, inverse kinematics and dynamics."""
    bench = rs.load_scenario(rs.examples.path("calibration_bench"))
    looks = rs.starts.LookAt("board", distance=(0.3, 0.9), cone=0.9)
    q = rs.calibration.sample_viewpoints(bench, 12, looks, seed=3)
    found = rs.calibrate(rs.calibration.simulate_views(bench, q), ["focal", "center", "distortion"])
    yield "calibrate", digest(found.covariance, found.mount.matrix, found.place.matrix)
    for name in ("puma560", "panda"):
        robot = rs.robots.load(name)
        goals = robot.fk(np.random.default_rng(4).uniform(*robot.limits.T, (40, robot.nq)))
        solved = robot.ik(goals)
        yield f"ik of {name}", digest(solved.q, solved.error, solved.iterations)
        yield f"jacobian of {name}", digest(robot.jacobian(robot.home + 0.1))
        yield f"mass matrix of {name}", digest(robot.mass_matrix(robot.home + 0.1))
    yield (
        "closed_ik",
        digest(rs.robots.puma560().closed_ik(rs.robots.puma560().fk(np.full(6, 0.3))).q),
    )
    eye = rs.load_scenario(rs.examples.path("eye_in_hand"))
    for change in ("task.kind=pbvs", "task.features=point_moments", 'task.weighting=["tukey"]'):
        run = rs.load_scenario(rs.examples.path("eye_in_hand"), [change]).run()
        yield change, digest_of_run(run)
    starts = eye.scene.home + np.linspace(-0.05, 0.05, 9)[:, None]
    batch = rs.simulate(eye.scene, eye.task, starts, dt=eye.dt, duration=2.0, sensing=eye.sensing)
    yield "batch", digest_of_run(batch)


if __name__ == "__main__":
    print(json.dumps(dict([*digests_of_examples(), *digests_of_uses()])))
