"""Depth errors of a few percent that differ between the marks make the goal unstable."""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.features.feature import Observation
from robsim.plot import palette

SQUARE = 0.25 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])  # parallel to the image, at a metre
PATTERN = np.array([1, -1, 1, -1])  # alternately too large and too small
LIMIT = 0.25**2 / (0.25**2 + 1)


def eigenvalues(error):
    """Return the eigenvalues (6,) of Lhat^+ L at the goal, with wrong depths in Lhat."""
    depths = 1 + error * PATTERN, np.ones(4)
    views = [Observation.of(SQUARE, Z, rs.Camera(np.eye(3))) for Z in depths]
    wrong, true = (rs.features.Points().interaction(view)[0] for view in views)
    return np.linalg.eigvals(np.linalg.pinv(wrong) @ true).real


plt.rcParams.update({"font.size": 9})
figure, (spectrum, ways) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
for errors in (np.linspace(1e-3, 0.99 * LIMIT, 100), np.linspace(1.01 * LIMIT, 0.15, 100)):
    values = np.array([eigenvalues(error) for error in errors])
    farthest = np.abs(values - 1).argmax(axis=1)
    spectrum.plot(100 * errors, values[range(100), farthest], color=palette.BLUE)
spectrum.axvline(100 * LIMIT, color="k", linestyle="--", linewidth=0.9)
spectrum.axhline(0, color="k", linewidth=0.8)
spectrum.text(100 * LIMIT + 0.3, 7, f"{100 * LIMIT:.2f} %")
spectrum.set(xlabel="error of the depths (%)", ylabel="eigenvalue farthest from 1")
spectrum.set(xlim=(0, 15), ylim=(-10, 10), title="unstable where negative")

colors = (palette.BLUE, palette.GREEN, palette.ORANGE, palette.VERMILLION)
for error, color, line in zip((0.0, 0.058, 0.06, 0.1), colors, palette.LINES, strict=True):
    changes = {"task.depth_scale": (1 + error * PATTERN).tolist()}
    run = rs.load_scenario(rs.examples.path("uneven_depth"), changes).run().dropna("time")
    away = 100 * np.linalg.norm(run.q[:, :3] - [0, 0, -1], axis=1)
    outcome = rs.Outcome(int(run.outcome)).name
    print(f"{100 * error:4.1f} %: {outcome:13} {away[-1]:6.2f} cm from the goal")
    ways.semilogy(run.time, away, color=color, linestyle=line, label=f"{100 * error:.1f} %")
ways.set(xlabel="time (s)", ylabel="distance from the goal (cm)", xlim=(0, 14), ylim=(1e-3, 200))
ways.set_title("the camera leaves its goal, and stops")
ways.legend(frameon=False, title="error", loc="lower right")
figure.savefig("uneven_depth.png", dpi=240)
