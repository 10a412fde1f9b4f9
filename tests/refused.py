"""Values of a text that the declarations refuse, as the tests of refusals list them."""

from __future__ import annotations

import math
from functools import singledispatch
from typing import Any

from robsim.declare.array_types import Numbers
from robsim.declare.choices import KindOf
from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.joint_numbers import OfJoint, PerJoint
from robsim.declare.lists import ListOf, Names
from robsim.declare.quantities import SI, Quantity, Vector
from robsim.declare.scalars import Flag, Integer, Number
from robsim.declare.spec import Spec
from robsim.declare.tables import Table
from robsim.declare.texts import Name, Text, Word
from robsim.declare.union import OneOf, _get_raw_form
from robsim.geometry.pose_table import PoseSpec
from robsim.robot.link_table import JointLimitPair
from robsim.robot.robot_table import OriginSpec
from robsim.run.experiment_text import ForeignTable
from robsim.run.phase import AttachmentTable, PhaseName
from robsim.servo.feature_block import FeaturesSpec
from robsim.servo.goals.goal import GoalSpec
from robsim.servo.tasks.belief_spec import BeliefSpec
from robsim.servo.tasks.follow_path import PathSpec
from robsim.studies.study_text import VarySpec
from robsim.studies.value_lists import ValuesSpec
from robsim.vision.intrinsics import FocalLengths


def spec_of_key(field: DeclaredField, key: str) -> Spec:
    """Return the values that one key of the table around a field accepts."""
    spec = field.spec
    if isinstance(spec, Table) and spec.flat:
        return next(each.spec for each in fields_of(spec.declared) if each.name == key)
    if isinstance(spec, KindOf):
        if key != field.name:
            return next(each.spec for beside, _, each in spec._fields_beside() if beside == key)
        return spec.other or spec
    return spec


@singledispatch
def list_refused_values(spec: Any) -> list[Any]:
    """Return some values that a spec refuses."""
    return []


@list_refused_values.register
def _(spec: Numbers) -> list[Any]:
    """Return texts that are none of numbers, and lists of another shape."""
    wrong = ["fast", "5 parsecs", True, ["x"], [[1.0], [1.0, 2.0]]]
    return wrong if spec.shape is None else [*wrong, 3, [], [True]]


@list_refused_values.register
def _(spec: KindOf) -> list[Any]:
    kindless: list[Any] = [{}] if spec.default is None else []
    return [3, "none of them", {"kind": "none of them"}, [[]], *kindless]


@list_refused_values.register
def _(spec: PerJoint) -> list[Any]:
    return [3, [True], [["x"]]]


@list_refused_values.register
def _(spec: OfJoint) -> list[Any]:
    return [True, "fast", "3 kg"]


@list_refused_values.register
def _(spec: ListOf) -> list[Any]:
    return [3, "x", *([[]] if spec.least else [])]


@list_refused_values.register
def _(spec: Names) -> list[Any]:
    return [3, [], [3]]


@list_refused_values.register
def _(spec: OneOf) -> list[Any]:
    return [raw for raw in (True, "none of them", [[True]]) if _get_raw_form(raw) in spec.forms]


@list_refused_values.register
def _(spec: Quantity) -> list[Any]:
    unit = SI[spec.dimension]
    outside = [bound for bound in (spec.above, spec.below) if bound is not None]
    other = "3 kg" if spec.dimension != "mass" else "3 m"
    return [1.0, "fast", other, True, f"nan {unit}", *(f"{x} {unit}" for x in outside)]


@list_refused_values.register
def _(spec: Vector) -> list[Any]:
    return [3, "1 kg", "1, 2, 3, 4, 5 m", ["1 m"]]


@list_refused_values.register
def _(spec: Number) -> list[Any]:
    outside = [bound for bound in (spec.above, spec.below) if bound is not None]
    outside += [spec.least - 1.0] if spec.least is not None else []
    outside += [spec.most + 1.0] if spec.most is not None else []
    return ["fast", True, math.nan, math.inf, [1.0, [2.0]], *outside]


@list_refused_values.register
def _(spec: Integer) -> list[Any]:
    return ["one", 1.5, True, spec.least - 1, spec.most + 1]


@list_refused_values.register
def _(spec: Flag) -> list[Any]:
    return [1, "yes"]


@list_refused_values.register
def _(spec: Table) -> list[Any]:
    return [3, "x", [1]]


@list_refused_values.register
def _(spec: Text) -> list[Any]:
    return [3, "x" * (spec.most + 1)]


@list_refused_values.register
def _(spec: Name) -> list[Any]:
    return [3, "two words", "1st", ""]


@list_refused_values.register
def _(spec: Word) -> list[Any]:
    return [3, "none of them", ["x"]]


@list_refused_values.register
def _(spec: PoseSpec) -> list[Any]:
    return [3, {"position": "1 m"}, {"rpy": "0, 0, 0 deg", "rotvec": "0, 0, 0 deg"}]


@list_refused_values.register
def _(spec: JointLimitPair) -> list[Any]:
    return [3, [], ["1 kg", "2 kg"]]


@list_refused_values.register
def _(spec: OriginSpec) -> list[Any]:
    """Return no values: code that replaces the keys by links refuses wrong values."""
    return ()


@list_refused_values.register
def _(spec: PhaseName) -> list[Any]:
    return [3, "", "  ", "a.b"]


@list_refused_values.register
def _(spec: AttachmentTable) -> list[Any]:
    return [3, "cup", ["cup"], {"cup": 1}]


@list_refused_values.register
def _(spec: ForeignTable) -> list[Any]:
    return [3, "x"]


@list_refused_values.register
def _(spec: FeaturesSpec) -> list[Any]:
    return [3, "none of them", [], {}]


@list_refused_values.register
def _(spec: GoalSpec) -> list[Any]:
    return [3, "home", {"s": []}, {"s": [1.0], "computed": {}}]


@list_refused_values.register
def _(spec: BeliefSpec) -> list[Any]:
    return [3, "x", []]


@list_refused_values.register
def _(spec: PathSpec) -> list[Any]:
    return [3, "x", [], {}]


@list_refused_values.register
def _(spec: VarySpec) -> list[Any]:
    return [3, ["x"]]


@list_refused_values.register
def _(spec: ValuesSpec) -> list[Any]:
    return [3, "x", []]


@list_refused_values.register
def _(spec: FocalLengths) -> list[Any]:
    return ["800 px", [800.0], [], True]
