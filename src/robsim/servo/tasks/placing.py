"""Section 6.2 of the chapter: two cameras watch an arm place a cube, and vectors drive it."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np

from robsim.base.arrays import Array, first_view
from robsim.base.errors import InputError
from robsim.declare import Word, register
from robsim.kernels.laws import realise
from robsim.servo.feature_block import FeatureBlock, Indices
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import RCOND
from robsim.servo.laws.law import ControlState, UnitOfLength
from robsim.servo.regulated import Regulated
from robsim.servo.shaping.shaped import Columns
from robsim.servo.sight import Sight
from robsim.servo.tasks.soundness import collinear
from robsim.servo.tasks.task import ServoTask

Variant = Literal["corrected", "printed", "completed"]


@register("task", "placing")
@dataclass(frozen=True, eq=False)
class Placing(ServoTask):
    """Carry three marks a, b, c, triangulated by two cameras that stand still, to their goal.

    With the unit vectors P_ab, P_ac now (1) and at the goal (2), the chapter's section 6.2 turns
    by Omega = rotation (P_ab1 x P_ac1) x (P_ab2 x P_ac2) and moves by T = translation t_a and a
    term in Omega x p_a; T is the velocity at the origin of the world, v = T + Omega x p at a point
    p, and the frame that holds the target gets it by qdot = J^+ (v, Omega) (eq. 19).

    variant "corrected": T = translation t_a - Omega x p_a, mark a goes straight
            "printed":   plus, as in the chapter; it arrives on a detour
            "completed": corrected, and Omega = rotation/2 times the sum of the cross products of
                         three corresponding edges, sin(theta) times the axis; the chapter's Omega
                         aligns two normals only and never turns about them

    >>> Placing(camera=["left", "right"], variant="printed").variant
    'printed'
    """

    own_law: ClassVar[bool] = True
    features: Any = field(default=None, init=False, repr=False)
    law: Any = field(default="joint", init=False, repr=False)
    gain: Any = field(default=1.0, init=False, repr=False)
    _: KW_ONLY
    variant: Annotated[Variant, Word(get_args(Variant), "variant"), "As printed, or corrected."] = (
        "corrected"
    )
    marks: Annotated[
        tuple[int, int, int], Indices(least=3, most=3), "Numbers of a, b and c, not on one line."
    ] = (0, 1, 2)
    rotation: Annotated[float, PER_SECOND, "The gain k1 of the chapter."] = 1.0
    translation: Annotated[float, PER_SECOND, "The gain k2 of the chapter."] = 1.0
    length: UnitOfLength = 1.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "features", [FeatureBlock("stereo_points", marks=self.marks)])
        super().__post_init__()
        put(self, "gain", min(self.rotation, self.translation))

    def bound_law(self, regulated: Regulated) -> PlacingLaw:
        """The law for the frame that holds the target; InputError if a camera moves."""
        for points in (regulated.sights[0].target.marks[list(self.marks)], regulated.s_goal):
            if collinear(points.reshape(3, 3)):
                raise InputError(
                    "the placing law needs three marks that are not on one line, now and at the "
                    f"goal, got {points.reshape(3, 3).tolist()}"
                )
        for sight in regulated.sights:
            carried = sight.scene.tree.carries(sight.eye.name)[regulated.columns]
            if carried.any():
                raise InputError(
                    f"the placing law is for cameras that stand still, and '{sight.eye.name}' "
                    "moves with the joints"
                )
        return PlacingLaw(regulated.sights[0], regulated.columns, regulated.s_goal, self)


@dataclass(frozen=True, eq=False)
class PlacingLaw:
    """The law of `Placing`, for one camera and the joints that move its target."""

    sight: Sight
    columns: Columns
    s_goal: Array  # (9, 1) a, b, c in camera axes
    task: Placing

    def command(self, state: ControlState) -> Array:
        """Joint velocities (B, n)."""
        assert state.s_last is not None and state.q_last is not None
        scene, eye, target = self.sight.scene, self.sight.eye, self.sight.target
        bodies = scene.tree.bodies(state.q_last)
        T_w_c = scene.tree.frame(bodies, eye.name)
        now, goal = (_world(T_w_c, s) for s in (state.s_last, self.s_goal))
        T, omega = self.twist(now, goal)
        at = scene.tree.frame(bodies, target.on)[:, 3]
        V = np.concatenate([T + np.cross(omega, at, axis=0), omega])
        J = np.ascontiguousarray(scene.tree.jacobian(bodies, target.on)[:, self.columns])
        qd = np.empty(J.shape[1:])
        realise(J, V, self.task.length, 0.0, RCOND, qd)
        return first_view(qd)

    def twist(self, now: Array, goal: Array) -> tuple[Array, Array]:
        """T and Omega (3, B) at the origin of the world, from a, b, c (3, 3, B) in its axes."""
        if self.task.variant == "completed":
            pairs = zip(_edges(now), _edges(goal), strict=True)
            turns = [np.cross(a, b, axis=0) for a, b in pairs]
            omega = 0.5 * self.task.rotation * (turns[0] + turns[1] + turns[2])
        else:
            omega = self.task.rotation * np.cross(_normal(now), _normal(goal), axis=0)
        lever = np.cross(omega, now[0], axis=0)
        sign = 1.0 if self.task.variant == "printed" else -1.0
        return self.task.translation * (goal[0] - now[0]) + sign * lever, omega


def _world(T_w_c: Array, s: Array) -> Array:
    """Points (3, 3, B), the point first, from camera axes s (9, B) into those of the world."""
    X = s.reshape(3, 3, 1, -1)
    turned = T_w_c[:, 0] * X[:, 0] + T_w_c[:, 1] * X[:, 1] + T_w_c[:, 2] * X[:, 2]
    points: Array = turned + T_w_c[:, 3]
    return points


def _normal(points: Array) -> Array:
    """P_ab x P_ac (3, B): normal to the plane of a, b, c, as long as the sine of the angle at a."""
    a, b, c = points
    normal: Array = np.cross(_unit(b - a), _unit(c - a), axis=0)
    return normal


def _edges(points: Array) -> tuple[Array, Array, Array]:
    """Unit vectors (3, B): along ab, in the plane of a, b, c at right angles to it, the normal."""
    ab, normal = _unit(points[1] - points[0]), _unit(_normal(points))
    return ab, np.cross(normal, ab, axis=0), normal


def _unit(v: Array) -> Array:
    unit: Array = v / np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return unit
