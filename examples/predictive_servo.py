"""Three laws that predict turn a camera by up to half a turn about its optical axis.

Model predictive path integral control (Williams et al. 2017), the predictive controller of
Allibert, Courtial and Chaumette (2010), both as laws of one's own, and `RolloutLaw`.
"""

import matplotlib.pyplot as plt
import numpy as np

import robsim as rs
from robsim.plot import palette

STEPS, DT = 20, 0.1  # of a prediction
FASTEST = np.repeat([0.5, 1.0], 3)  # m/s and rad/s
HALF = np.array([312.0, 232.0]) / 502.3  # of the image, 8 pixels inside its border
DEGREES = 60, 90, 120, 150, 180


def locate_marks(state):
    """Return the marks (B, 4, 3) in camera axes, with the depths in L."""
    depth = -1.0 / state.interaction[:, ::2, 0]
    points = state.s.reshape(*depth.shape, 2)
    return np.concatenate([points, np.ones_like(points[..., :1])], axis=2) * depth[..., None]


def move_marks(X, V):
    """Return marks (..., 4, 3) after a step of the camera with twists V (..., 6)."""
    T = rs.Pose.exp(-DT * V).matrix  # the motion of the marks in the camera
    return X @ np.swapaxes(T[..., :3, :3], -1, -2) + T[..., None, :3, 3]


def image_error(X, goal):
    """Return the errors (..., 2 N) of the image, and by how far marks are out of it (..., 2 N)."""
    points = X[..., :2] / np.maximum(X[..., 2:], 0.05)
    outside = np.maximum(np.abs(points) - HALF, 0.0)
    flat = (*points.shape[:-2], -1)
    return points.reshape(flat) - goal, outside.reshape(flat)


class PathIntegral:
    """Mean of 1,000 random plans, weighted by exp(-cost / temperature)."""

    rollouts, spread = 1000, np.repeat([0.02, 0.1], 3)  # metres/s and rad/s

    def command(self, state):
        plans = state.memory.setdefault("plan", np.zeros((len(state.error), STEPS, 6)))
        X, goals = locate_marks(state), state.s - state.error
        noise = self.draw(state)
        for i in range(len(plans)):
            own = noise * self.scale(state.error[i])
            plans[i] = np.clip(
                plans[i] + self.improve(plans[i], X[i], goals[i], own), -FASTEST, FASTEST
            )
        commands = plans[:, 0]
        state.memory["plan"] = np.concatenate([plans[:, 1:], plans[:, -1:]], axis=1)
        return np.linalg.solve(state.jacobian, commands[..., None])[..., 0]

    def draw(self, state):
        """Return correlated noise (rollouts, STEPS, 6); the first plan has none."""
        rng = np.random.default_rng(round(state.time / state.dt))
        noise = rng.normal(size=(self.rollouts, STEPS, 6)) * self.spread
        for h in range(1, STEPS):
            noise[:, h] = 0.8 * noise[:, h - 1] + 0.6 * noise[:, h]
        noise[0] = 0.0
        return noise

    def scale(self, error):
        """Return the scale of the noise, smaller near the goal."""
        return np.clip(np.linalg.norm(error), 0.01, 1.0)

    def improve(self, plan, X, goal, noise):
        """Return the change (STEPS, 6) of a plan."""
        V = np.clip(plan + noise, -FASTEST, FASTEST)
        X, cost = np.broadcast_to(X, (self.rollouts, *X.shape)), 0.0
        for h in range(STEPS):
            X = move_marks(X, V[:, h])
            error, outside = image_error(X, goal)
            size = (error**2).sum(axis=1)
            cost = (
                cost
                + size
                + 1e-4 * (V[:, h] ** 2).sum(axis=1)
                + 10.0 * (outside > 0.0).sum(axis=1)
                + 10.0 * outside.sum(axis=1)
            )
        cost = cost + 10.0 * size
        best = np.sort(cost)
        weights = np.exp((best[0] - cost) / (0.5 * (best[50] - best[0]) + 1e-12))
        return np.einsum("k,khj->hj", weights / weights.sum(), V - plan)


class PredictiveController:
    """Constant twist that minimises the errors over the horizon, within image and speeds."""

    def command(self, state):
        X, goals = locate_marks(state), state.s - state.error
        twists = state.memory.setdefault("twist", np.zeros((len(X), 6)))
        for i in range(len(X)):
            twists[i] = self.solve(twists[i], X[i], goals[i])
        state.memory["twist"] = twists
        return np.linalg.solve(state.jacobian, twists[..., None])[..., 0]

    def residuals(self, V, X, goal):
        """Return the residuals (C, r) of twists V (C, 6): errors, and marks outside the image."""
        X, each = np.broadcast_to(X, (len(V), *X.shape)), []
        for _ in range(STEPS):
            X = move_marks(X, V)
            error, outside = image_error(X, goal)
            each += [error, 30.0 * outside]
        return np.concatenate(each, axis=1)

    def solve(self, V, X, goal):
        """Return the twist after four steps of Levenberg and Marquardt from V."""
        damping = 1e-3
        for _ in range(4):
            tried = V + np.vstack([np.zeros(6), 1e-5 * np.eye(6)])
            r, *others = self.residuals(tried, X, goal)
            J = (np.array(others) - r).T / 1e-5
            step = np.linalg.solve(J.T @ J + damping * np.eye(6), J.T @ r)
            new = np.clip(V - step, -FASTEST, FASTEST)
            better = (self.residuals(new[None], X, goal) ** 2).sum() < (r**2).sum()
            V, damping = (new, damping / 5) if better else (V, damping * 10)
        return V


def measure(run, goal):
    """Return the angles and distances (runs, times) of the camera from its goal."""
    away = goal.inv().matrix @ run.camera_pose.values
    cosine = (np.trace(away[..., :3, :3], axis1=2, axis2=3) - 1) / 2
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))), np.linalg.norm(away[..., :3, 3], axis=-1)


def main():
    changes = ["run.dt=100 ms", "run.duration=20 s"]
    scenario = rs.load_scenario(rs.examples.path("looking_ahead"), changes)
    goal = rs.Pose.at(0, 0, -0.61)
    turned = [(goal @ rs.Pose.at(rpy=(0, 0, angle))).q for angle in np.radians(DEGREES)]
    laws = {
        "L current": ("joint", palette.VERMILLION),
        "path integral": (PathIntegral(), palette.SKY_BLUE),
        "predictive controller": (PredictiveController(), palette.ORANGE),
        "rollout of schemes": (scenario.task.law, palette.GREEN),
    }
    plt.rcParams.update({"font.size": 9})
    figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
    print(
        "last angle (deg), last and largest distance (m), from rolls and from the scenario's start"
    )
    print(" " * 21, *(f"{start:^19}" for start in (*DEGREES, "tilted")))
    for name, (law, color) in laws.items():
        run = scenario.at("task.law", law).with_(start=np.array([*turned, scenario.start])).run()
        angles, distances = measure(run, goal)
        ends = np.isfinite(angles).sum(axis=1) - 1
        rows = zip(angles, distances, ends, strict=True)
        print(f"{name:21}", *(f"{a[i]:7.2f}{d[i]:6.2f}{np.nanmax(d):6.2f}" for a, d, i in rows))
        style = {"color": color, "label": name}
        left.plot(run.time, angles[len(DEGREES) - 1], **style)
        right.plot(DEGREES, np.nanmax(distances[:-1], axis=1), ".-", **style)
    left.set(xlabel="time (s)", ylabel="angle to the goal (degrees)", title="from half a turn")
    right.set(xlabel="roll at the start (degrees)", ylabel="largest distance from the goal (m)")
    right.set(xticks=DEGREES, ylim=(-0.05, 1.5), title="way of the camera")
    left.legend(frameon=False)
    figure.savefig("predictive_servo.png", dpi=240)


if __name__ == "__main__":
    main()
