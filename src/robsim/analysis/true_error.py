"""The true error and Jacobian of a task, without wrong beliefs, wrong depths or noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.analysis.task_tree import list_servo_tasks, replace_fields
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.feature_stages import evaluate_features
from robsim.servo.tasks.task import Task
from robsim.world.scene import Scene


@dataclass(frozen=True)
class TrueError:
    """True error e, interaction matrix L and task Jacobian L J at T instants of a run.

    L belongs to the twist of the first camera. Only L is multiplied by `weights`, the weights of
    the law. `rates` are de/dt for each velocity of the scene, commanded or not. Rows with weight 0
    are zero.
    """

    error: Array  # (T, k)
    L: Array  # (T, k, 6)
    rates: Array  # (T, k, nv)
    weights: Array  # (T, k)

    def weighted(self, weights: Array) -> TrueError:
        """Return the same quantities multiplied by weights (T, k) that change over time."""
        unused = weights == 0.0
        error = np.where(unused, 0.0, self.error)
        L = np.where(unused[..., None], 0.0, weights[..., None] * self.L)
        rates = np.where(unused[..., None], 0.0, self.rates)
        return TrueError(error, L, rates, weights * self.weights)


def compute_true_error(task: Task, scene: Scene, q: Array) -> TrueError | None:
    """Return the true error and Jacobian at coordinates q (nq, T), with several tasks stacked.

    The result is None if a true camera does not see the goal.
    """
    every = np.arange(scene.nv)
    try:
        true_fields = {
            "belief": None,
            "depth": "true",
            "depth_scale": 1.0,
            "interaction": "current",
        }
        true_tasks = [replace_fields(leaf, **true_fields) for leaf in list_servo_tasks(task)]
        bound = [leaf.bind_features(leaf.sights(scene), every) for leaf in true_tasks]
    except InputError:
        return None
    if not bound:
        return None
    errors = [_evaluate_truth(regulated, q) for regulated in bound]
    parts = ([getattr(one, name) for one in errors] for name in ("error", "L", "rates"))
    error, L, rates = (np.concatenate(part, axis=1) for part in parts)
    return TrueError(error, L, rates, np.concatenate([one.weights for one in errors], axis=1))


def _evaluate_truth(regulated: BoundFeatures, q: Array) -> TrueError:
    """Return the true error and Jacobian of one servo task."""
    s, L, A = evaluate_features(regulated, q)
    W = regulated.weights
    arrays = s - regulated.s_goal, W[:, None] * L, A
    error, L, rates = (np.moveaxis(array, -1, 0) for array in arrays)
    return TrueError(error, L, rates, np.broadcast_to(W[:, 0], error.shape))
