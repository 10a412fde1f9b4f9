"""From the keys of a servo task to the values that its class takes."""

from __future__ import annotations

from typing import Any

from robsim.base.errors import InputError
from robsim.scenario import task_schema as schema
from robsim.scenario.feature import features
from robsim.scenario.place import pose
from robsim.scenario.problems import shown, under
from robsim.scenario.quantity import either
from robsim.scenario.run import start
from robsim.scenario.schema import PoseKeys, Table
from robsim.servo import (
    AdaptiveGain,
    AvoidLimits,
    Broyden,
    CameraLaw,
    DampedInverse,
    DepthFilter,
    EstimatedMotion,
    GoalFeatures,
    GoalPose,
    LargeProjection,
    Posture,
    PseudoInverse,
    SpeedLimit,
)
from robsim.world.scene import Scene

Keywords = dict[str, Any]
# keys that make sense beside one value of another key only, and what that one is if not given
_BESIDE = (
    ("length", "law", "camera", "joint"),
    ("rcond", "inverse", "pseudo_inverse", "pseudo_inverse"),
    ("damping", "inverse", "damped", "pseudo_inverse"),
    ("lag", "feed_forward", "estimated", None),
    ("broyden_start", "interaction", "broyden", "current"),
)


def servo(table: schema.ServoTable, scene: Scene) -> Keywords:
    """Keywords of a servo task; what is not said is not there."""
    check_companions(table)
    made = said(table, "kind", "goal", "belief", "rcond", "damping", "lag", "broyden_start")
    if "law" in made:
        made.pop("length", None)
    made |= shaping(table) | _gain(table) | _law(table) | inverse(table)
    if isinstance(table.depth, schema.DepthFilterTable):
        with under("depth"):
            made["depth"] = DepthFilter(**said(table.depth))
    if table.lag is not None:
        made["feed_forward"] = EstimatedMotion(table.lag)
    if table.broyden_start is not None:
        with under("broyden_start"):
            made["interaction"] = Broyden(_matrix(table.broyden_start))
    if isinstance(table, schema.IBVSTable) and table.features is not None:
        with under("features"):
            made["features"] = features(table.features)
    with under("goal"):
        made["goal"] = _goal(table.goal, scene)
    return made


def shaped(table: schema.PrioritiesTable) -> Keywords:
    """Keywords of priorities, without the tasks."""
    return said(table, "kind", "tasks") | shaping(table)


def said(table: Table, *without: str) -> Keywords:
    """What a table says, but for some keys."""
    return {key: value for key, value in table if value is not None and key not in without}


def check_companions(table: Table) -> None:
    """InputError for a key that stands without the one that it belongs to."""
    for key, beside, value, default in _BESIDE:
        lonely = getattr(table, key, None) is not None and hasattr(table, beside)
        if lonely and (getattr(table, beside) or default) != value:
            raise InputError(f'{key} is for {beside} = "{value}" only')


def shaping(table: schema.ShapedTable) -> Keywords:
    """What is not said as the class takes it; units of joints are checked later."""
    made: Keywords = {}
    if isinstance(table.secondary, schema.AvoidLimitsTable):
        made["secondary"] = AvoidLimits(**said(table.secondary, "kind"))
    elif table.secondary is not None:
        with under("secondary"):
            q = _each(table.secondary.q, "q", "angle", "length")
            made["secondary"] = Posture(q, **said(table.secondary, "kind", "q"))
    if isinstance(table.projection, schema.LargeTable):
        with under("projection"):
            made["projection"] = LargeProjection(**said(table.projection))
    if table.limit is not None:
        with under("limit"):
            made["limit"] = _limit(table.limit)
    return made


def _limit(table: schema.LimitTable) -> SpeedLimit:
    given = said(table)
    if isinstance(table.joint, list):
        given["joint"] = _each(table.joint, "joint", "turn rate", "speed")
        for i, (speed, text) in enumerate(zip(given["joint"], table.joint, strict=True)):
            if not speed > 0:
                with under("joint", i):
                    raise InputError(f"must be greater than 0, got {shown(text)}")
    return SpeedLimit(**given)


def _each(texts: Any, key: str, *dimensions: Any) -> list[float]:
    made = []
    for i, text in enumerate(texts):
        with under(key, i):
            made.append(either(text, *dimensions))
    return made


def _gain(table: Any) -> Keywords:
    gain = getattr(table, "gain", None)
    if not isinstance(gain, schema.AdaptiveTable):
        return {}
    with under("gain"):
        return {"gain": AdaptiveGain(**said(gain))}


def _law(table: Any) -> Keywords:
    if not isinstance(table, schema.LawKeys) or table.length is None:
        return {}
    return {"law": CameraLaw(table.length)}


def inverse(table: Any) -> Keywords:
    """With its number, if that is said."""
    if table.rcond is not None:
        return {"inverse": PseudoInverse(table.rcond)}
    return {} if table.damping is None else {"inverse": DampedInverse(table.damping)}


def _matrix(rows: list[list[float]]) -> list[list[float]]:
    widths = {len(row) for row in rows}
    if len(widths) > 1:
        raise InputError(f"rows of unequal lengths {sorted(widths)}")
    return rows


def _goal(table: schema.GoalTable, scene: Scene) -> Any:
    ways = [key for key in ("computed", "s", "q") if getattr(table, key) is not None]
    if table.model_fields_set & PoseKeys.model_fields.keys():
        ways.append("a pose")
    if len(ways) > 1:
        raise InputError(f"{' and '.join(ways)}: give one of them only")
    if table.s is not None:
        return GoalFeatures(table.s)
    if table.computed is None:
        return start(table, scene, "goal q")
    with under("computed"):
        return GoalPose(pose(table.computed))
