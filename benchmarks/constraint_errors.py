"""Constraints in the image with wrong depth, noise, old images and a wrong focal length.

    python benchmarks/constraint_errors.py                 # large_rolls, every second start
    python benchmarks/constraint_errors.py --every 1

Each scheme runs alone and within `FieldOfView` with the declared errors, `MarkDepth` and
`JointSpeeds`. The guarantee of docs/constraints.md holds for a run if the curvature of the path of
no mark, over the period and the age of its image, exceeds the margin in any period.
"""

import argparse
import time
import warnings
from dataclasses import replace

import numpy as np

import robsim as rs
from robsim.suites.suite_registry import load_suite

C = rs.constraints
MARGIN, NOISE, LATENCY, DEPTH, FOCAL = 8.0, 0.5, 0.06, 0.2, 0.05
SPEED, LEAST_DEPTH = 0.5, 0.15  # m/s and rad/s, m
LAW = rs.laws.ConstrainedLaw(
    [
        C.JointSpeeds(SPEED),
        C.MarkDepth(LEAST_DEPTH, depth_error=0.25),
        C.FieldOfView(MARGIN, noise=4 * NOISE, depth_error=0.25, focal_error=FOCAL),
    ]
)
SCHEMES = {
    "PBVS": (rs.PBVS, {}),
    "IBVS, L current": (rs.IBVS, {}),
    "IBVS, L mean": (rs.IBVS, {"interaction": "mean"}),
}


def list_cases(scene):
    """Return the cases {name: (images, fields of the task)} of a scene."""
    eye = scene.cameras[0]
    K = np.array(eye.camera.K)
    K[:2, :2] *= 1.0 + FOCAL
    belief = scene.replacing(replace(eye, camera=replace(eye.camera, K=K)))
    noise, old = {"noise": NOISE}, {"latency": LATENCY}
    focal, near = {"belief": belief}, {"depth_scale": 1.0 - DEPTH}
    far = {"depth_scale": 1.0 + DEPTH}
    return {
        "exact": ({}, {}),
        "noise 0.5 px": (noise, {}),
        "latency 60 ms": (old, {}),
        "focal +5 %": ({}, focal),
        "depth -20 %": ({}, near),
        "depth +20 %": ({}, far),
        "all, depth -20 %": (noise | old, near | focal),
        "all, depth +20 %": (noise | old, far | focal),
    }


def measure_drop(scene, run, seconds):
    """Return the largest curvature bound (runs,) of the path of a mark over `seconds`, in pixels.

    With s = |v|/Z + |omega| rho and rho^2 = 1 + x^2 + y^2 a normalised point x has the acceleration
    |x''| <= s rho (|omega| + 2 s) along a constant twist (docs/constraints.md).
    """
    q, qd = run.q.values, run.qd.values
    ended = np.isnan(q[..., :1])
    view = scene.view(np.where(ended, q[:, :1], q).reshape(-1, q.shape[-1]))
    K = np.array(scene.cameras[0].camera.K)
    x = (view.pixels - K[:2, 2]) / np.diag(K)[:2]
    x, Z = x.reshape(*q.shape[:2], -1, 2), view.depth.reshape(*q.shape[:2], -1)
    v, w = (np.linalg.norm(qd[..., part], axis=-1)[..., None] for part in (slice(3), slice(3, 6)))
    rho = np.sqrt(1.0 + (x**2).sum(axis=-1))
    s = v / Z + w * rho
    drop = 0.5 * K[0, 0] * s * rho * (w + 2.0 * s) * seconds**2
    return np.nanmax(np.where(ended, 0.0, drop), axis=(1, 2))


def main():
    """Print arrivals and losses of each scheme and case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--suite", default="large_rolls")
    parser.add_argument("--every", type=int, default=2, help="take every so many starts")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    suite = load_suite(options.suite)
    starts, scene = np.asarray(suite.starts)[:: options.every], suite.scene
    lost_codes = [int(rs.Outcome.OUT_OF_IMAGE), int(rs.Outcome.BEHIND_CAMERA)]
    covered = total = lost_inside = lost_outside = 0
    for scheme, (kind, own) in SCHEMES.items():
        for case, (images, fields) in list_cases(scene).items():
            if "depth_scale" in fields and kind is rs.PBVS:
                continue  # a pose has no separate depth
            began, text = time.process_time(), []
            for law in "joint", LAW:
                task = kind(suite.task_goal, gain=suite.gain, law=law, **own, **fields)
                run = rs.simulate(
                    *(scene, task, starts),
                    dt=suite.dt,
                    duration=40.0,
                    hold=True,
                    sensing=rs.Sensing(**images),
                )
                lost = np.isin(run.outcome.values, lost_codes)
                near = (run.distance_to_goal.values < 0.05) & (run.angle_to_goal.values < 0.09)
                arrived = int((near & ~lost).sum())
                text.append(f"{arrived} arrive, {int(lost.sum())} lost")
            age = images.get("latency", 0.0)
            holds = measure_drop(scene, run, suite.dt + age) <= MARGIN
            covered, total = covered + int(holds.sum()), total + len(holds)
            lost_inside += int((lost & holds).sum())
            lost_outside += int((lost & ~holds).sum())
            print(
                f"{scheme:16} {case:18} alone {text[0]:26} constrained {text[1]:24} "
                f"guaranteed {int(holds.sum())} of {len(holds)}"
                f"  [{time.process_time() - began:.0f} s]",
                flush=True,
            )
    print(
        f"guarantee: holds in {covered} of {total} runs, {lost_inside} of them lost; "
        f"{lost_outside} of {total - covered} others lost"
    )


if __name__ == "__main__":
    main()
