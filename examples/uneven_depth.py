"""Depths that are wrong by a few percent, each differently, make the goal unstable."""

import itertools

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.features.feature import Observation
from robsim.plot import palette

HALF, FAR = 0.25, 1.0  # half side of the square and its distance, metres
PATTERN = np.array([1, -1, 1, -1])
LIMIT = HALF**2 / (HALF**2 + FAR**2)


def eigenvalues(factors):
    """(B, 6) of L^+ L at the goal, with depths wrong by factors (B, 4) in the first L.

    The loop is stable while the real parts of all are positive.
    """
    depth = FAR * np.transpose(factors)
    square = HALF / FAR * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    marks = np.repeat(square[:, :, None], depth.shape[1], axis=2)
    wrong, true = (
        rs.Points().interaction(Observation.of(marks, Z, rs.Camera(np.eye(3))))
        for Z in (depth, np.full(depth.shape, FAR))
    )
    return np.linalg.eigvals(np.linalg.pinv(wrong) @ true)


def run_with(error):
    """A run whose depths are wrong by `error`, by turns too large and too small."""
    factors = np.round(1 + error * PATTERN, 6).tolist()
    scenario = rs.load_scenario(rs.examples.path("uneven_depth"), {"task.depth_scale": factors})
    return scenario.run().dropna("time")


corners = [np.array(signs) for signs in itertools.product((-1, 1), repeat=4)]
patterns = [*corners, *np.random.default_rng(0).uniform(-1, 1, (1000, 4))]
for error in np.arange(0.04, 0.08, 0.005):
    found = eigenvalues([1 + error * p / np.abs(p).max() for p in patterns]).real.min(axis=1) < 0
    print(f"{100 * error:.1f} %: {found.sum()} of {len(found)} patterns of error are unstable")

plt.rcParams.update({"font.size": 9})
figure, (spectrum, ways) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
sides = np.linspace(0, 0.99 * LIMIT, 100), np.linspace(1.01 * LIMIT, 0.15, 100)
for errors in sides:
    values = eigenvalues([1 + e * PATTERN for e in errors]).real
    changing = [v[np.argmax(np.abs(v - 1))] for v in values]
    spectrum.plot(100 * errors, changing, color=palette.BLUE)
spectrum.axvline(100 * LIMIT, color="k", linestyle="--", linewidth=0.9)
spectrum.axhline(0, color="k", linewidth=0.8)
spectrum.text(100 * LIMIT + 0.3, 7, f"{100 * LIMIT:.2f} %")
spectrum.set(xlabel="error of the depths (%)", ylabel="eigenvalue that is not 1", ylim=(-10, 10))
spectrum.set(xlim=(0, 15), title="unstable where negative")

colors = (palette.BLUE, palette.GREEN, palette.ORANGE, palette.VERMILLION)
for error, color, line in zip((0.0, 0.058, 0.06, 0.1), colors, palette.LINES, strict=True):
    run = run_with(error)
    away = 100 * np.linalg.norm(run.q[:, :3] - [0, 0, -FAR], axis=1)
    outcome = rs.Outcome(int(run.outcome)).name
    print(f"{100 * error:4.1f} %: {outcome:13} {away[-1]:6.2f} cm from the goal")
    look = {"color": color, "linestyle": line, "label": f"{100 * error:.1f} %"}
    ways.semilogy(run.time, np.maximum(away, 1e-3), **look)
ways.set(xlabel="time (s)", ylabel="distance from the goal (cm)", xlim=(0, 14), ylim=(1e-3, 200))
ways.set_title("the camera leaves its goal, and stops")
ways.legend(frameon=False, title="error", loc="lower right")
figure.savefig("uneven_depth.png", dpi=150)
