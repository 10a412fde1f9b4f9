"""How long one step of image-based visual servoing takes in the Machine Vision Toolbox for Python.

The scene is the one of the documentation of its class `IBVS`: a free camera, the four corners of
a square, exact depths, no graphics. The termination threshold is set to zero, because the default
of half a pixel ends the run early, so every step that is counted is computed.

Run it with a Python of its own that holds the peer: `pip install machinevision-toolbox-python`.
Found working together under Python 3.11: machinevision-toolbox-python 2.4.1, spatialmath-python
1.1.18, NumPy 2.4.6, SciPy 1.17.1, OpenCV 5.0.0, Matplotlib 3.11.2.

Prints one line of JSON.
"""

import contextlib
import io
import json
import time
from importlib.metadata import version

import numpy as np
from machinevisiontoolbox import IBVS, CentralCamera, mkgrid
from spatialmath import SE3

STEPS = 200
REPEATS = 7


def servo() -> IBVS:
    """The documented example, with exact depths (`depth=None`) and no early end."""
    camera = CentralCamera.Default(pose=SE3.Trans(1, 1, -3) * SE3.Rz(0.6))
    points = mkgrid(2, side=0.5, pose=SE3.Tz(3))
    goal = 200 * np.array([[-1, -1, 1, 1], [-1, 1, 1, -1]]) + np.c_[camera.pp]
    return IBVS(camera, P=points, p_d=goal, niter=STEPS, eterm=0, graphics=False)


def timed_run() -> tuple[float, np.ndarray]:
    """Seconds that one run takes, and the norm of its error in pixels at every step."""
    ibvs = servo()
    with contextlib.redirect_stdout(io.StringIO()):  # run() prints why it ended
        start = time.perf_counter()
        ibvs.run()
        seconds = time.perf_counter() - start
    return seconds, np.array([record.enorm for record in ibvs.history])


def main() -> None:
    timed_run()  # warm up
    runs = [timed_run() for _ in range(REPEATS)]
    errors = runs[0][1]
    if len(errors) != STEPS:
        raise SystemExit(f"{len(errors)} steps ran, {STEPS} were asked for")
    if not errors[-1] < 1e-3 * errors[0]:
        raise SystemExit(f"the error went from {errors[0]:.3g} to {errors[-1]:.3g} pixels")
    report = {
        "what": "Machine Vision Toolbox for Python, IBVS, 4 points, free camera, no graphics",
        "version": version("machinevision-toolbox-python"),
        "steps": STEPS,
        "seconds_per_step": min(seconds for seconds, _ in runs) / STEPS,
        "error_first_px": float(errors[0]),
        "error_last_px": float(errors[-1]),
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
