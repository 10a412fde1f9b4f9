"""Interaction matrices: modelled, constant, or estimated on line without a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.declare import KindOf, family, register
from robsim.declare.array_types import Numbers
from robsim.kernels.control import broyden_update as kernels
from robsim.servo.laws.inverse import compute_rank

INTERACTION_RULES = family("interaction matrix")
Interaction = Literal["current", "desired", "mean"]  # in the order of the kernels
INTERACTION = KindOf(
    INTERACTION_RULES,
    beside_of={"broyden_start": ("broyden", "start")},
    plain=get_args(Interaction),
    other=Numbers(shape=("k", 6)),
)
TWIST_SIZE = 6  # motions of a camera, the largest rank of a Jacobian L J


@register("interaction matrix", "broyden")
@dataclass(frozen=True, eq=False)
class Broyden(Value):
    """Broyden's rule: estimate the task Jacobian on line from the motion of the features.

    After each period, with the change ds of the features and dq of the commanded joints, the
    estimate A becomes the nearest matrix that explains the change,

        A <- A + (ds - A dq) dq'/(dq' dq)

    (Broyden 1965; Jaegersand, Fuentes and Nelson 1997; see `broyden_update`). The law then needs
    no model of the camera, of the depth or of the robot. The features move on less straight paths
    than with a model, and image noise disturbs the estimate once the motion is slow. It requires
    law="joint".

    Raises
    ------
    InputError
        If `start` is singular or not one matrix.

    Examples
    --------
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> task = rs.IBVS(scenario.task.goal, interaction=rs.laws.Broyden())
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.path_length), 2)
    ('CONVERGED', 0.39)
    """

    start: Annotated[
        ArrayLike | None,
        Numbers(shape=("k", "n")),
        "First estimate (k, n) of ds/dq, in units of s per rad or m of each commanded joint, "
        "of full rank (at most 6); None: the modelled L J at the start.",
    ] = None

    def __post_init__(self) -> None:
        if self.start is not None:
            object.__setattr__(self, "start", make_read_only(_check_first_estimate(self.start)))


def _check_first_estimate(value: ArrayLike) -> Array:
    """Return a first estimate as an array; raise InputError if it is singular."""
    A = as_floats(value, "Broyden start", ("k", "n"))
    if A.ndim != 2 or not A.size:
        raise InputError(f"Broyden start: expected one matrix of shape (k, n), got {A.shape}")
    matrix_rank = int(compute_rank(np.ascontiguousarray(A[..., None]))[0])
    needed = min(*A.shape, TWIST_SIZE)
    if matrix_rank < needed:
        raise InputError(
            f"a Broyden start that is singular: rank {matrix_rank}; shape {A.shape} needs {needed}"
        )
    return A


Matrix = Broyden | ArrayLike  # interaction matrix: the name of a model, a rule, or numbers (k, 6)


def broyden_update(A: Array, ds: Array, dq: Array) -> Array:
    """Return the matrix nearest to A (k, n, B) that explains a step, A + (ds - A dq) dq'/(dq' dq).

    The features moved by ds (k, B) while the commanded joints moved by dq (n, B). A step shorter
    than 1e-9 (rad, m) leaves A unchanged. Sources: Broyden 1965; for visual servoing Jaegersand,
    Fuentes and Nelson 1997.

    Examples
    --------
    >>> A, ds, dq = np.zeros((1, 2, 1)), np.array([[2.0]]), np.array([[1.0], [0.0]])
    >>> broyden_update(A, ds, dq).ravel()
    array([2., 0.])
    """
    out = np.empty(A.shape)
    kernels.update_broyden(A, ds, dq, out)
    return out
