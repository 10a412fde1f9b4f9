"""Feature blocks: a feature, its camera and target, and its regulated components."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, cast

import numpy as np

from robsim.base.arrays import has_items
from robsim.base.errors import InputError, format_value
from robsim.declare import (
    DeclaredValue,
    Integer,
    KindOf,
    ListOf,
    Number,
    OneOf,
    Text,
    described,
    fields_of,
)
from robsim.declare.context import MISSING, Context, NoTextError, Raw
from robsim.declare.problems import UnreadableValue
from robsim.declare.spec import Spec, add_article, make_expected_error
from robsim.features.feature import FEATURES as KINDS
from robsim.features.feature import Feature

FEATURE_CHOICE = KindOf(KINDS, protocol=Feature)


@dataclass(frozen=True)
class SceneName(Text):
    """Name of a camera or an object, which must exist in the scene of a text."""

    find: str = "camera"
    most: int = 129

    def read(self, raw: Raw, c: Context) -> Any:
        name, scene = super().read(raw, c), c.facts.get("scene")
        if scene is not None:
            getattr(scene, self.find)(name)
        return name

    def words(self) -> str:
        return f"the name of {add_article(self.find)}"


@dataclass(frozen=True)
class CameraNames(OneOf):
    """Name of a camera, or the two names of a stereo pair."""

    def __init__(self) -> None:
        words = "the name of a camera, or two of a stereo pair"
        super().__init__(SceneName(), ListOf(SceneName(), 2, 2), words=words)

    def check(self, value: Any, what: str) -> Any:
        if isinstance(value, str):
            return value
        names = tuple(value) if isinstance(value, list | tuple) else ()
        texts = all(isinstance(name, str) for name in names)
        if len(names) != 2 or not texts or len(set(names)) < 2:
            raise InputError(
                f"{what}: expected a name, or two different ones, got {format_value(value)}"
            )
        return names

    def accepts(self) -> str:
        return self.words()


INDEX_SPEC = Integer(0, 9_999)


@dataclass(frozen=True)
class IndexList(ListOf):
    """List of different whole numbers from 0 on."""

    item: Spec = INDEX_SPEC
    least: int = 1
    phrase: ClassVar[str] = "different whole numbers from 0 on"

    def check(self, value: Any, what: str) -> tuple[int, ...]:
        numbers = tuple(value) if has_items(value) else ()
        whole = all(isinstance(n, int | np.integer) and n is not True and n >= 0 for n in numbers)
        if not numbers or not whole or len(set(numbers)) < len(numbers):
            raise InputError(f"{what}: expected {self.words()}, got {format_value(value)}")
        return tuple(int(n) for n in numbers)

    def read(self, raw: Raw, c: Context) -> tuple[int, ...]:
        numbers = super().read(raw, c)
        if len(set(numbers)) < len(numbers):
            raise make_expected_error(self.words(), raw)
        return numbers


Name = str | Sequence[str]  # name of a camera, or the two names of a stereo pair
CAMERAS, TARGET, INDICES = CameraNames(), SceneName(find="object"), IndexList()


@described
@dataclass(frozen=True)
class FeatureBlock(DeclaredValue):
    """One of several features that a task stacks, with its own camera, target, marks and weight.

    Use blocks to combine features of different kinds, to measure a feature on some marks or by
    another camera, to regulate some components of a feature, or to weigh features against each
    other. Stacked features form one error; the law solves the least squares with the weights of
    the blocks. A larger `weight` makes the components of a block decay more faithfully if the
    joints cannot satisfy all features.

    Raises
    ------
    InputError
        By `simulate`, if a mark, a component or a name does not exist.

    Examples
    --------
    Centre of the target in the image, depth of one mark, and rotation of the camera:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> centre = rs.features.FeatureBlock("point_moments", components=[1, 2])
    >>> features = [centre, rs.features.FeatureBlock("log_depth", marks=[0]), "theta_u"]
    >>> task = rs.IBVS(scenario.task.goal, features=features)
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    >>> run.sizes["feature"], rs.Outcome(int(run.outcome)).name
    (6, 'CONVERGED')
    """

    feature: Annotated[
        Feature | str,
        FEATURE_CHOICE,
        "Feature: its name, or an object with unit, tolerance and measure.",
    ]
    camera: Annotated[
        Name | None,
        CAMERAS,
        "Name of the camera, or names of a stereo pair; None: camera of the task.",
    ] = None
    target: Annotated[
        str | None, TARGET, "Name of the object with the marks; None: target of the task."
    ] = None
    marks: Annotated[
        tuple[int, ...] | None,
        INDICES,
        "Indices of the marks on which the feature is measured; None: all marks.",
    ] = None
    components: Annotated[
        tuple[int, ...] | None,
        INDICES,
        "Indices of the regulated components of s; None: all components.",
    ] = None
    weight: Annotated[
        float, Number(above=0), "Weight of the components in the least squares of the law."
    ] = 1.0


Features = Feature | str | FeatureBlock | Sequence[Feature | str | FeatureBlock]


def make_feature_blocks(value: Features) -> tuple[FeatureBlock, ...]:
    """Return feature blocks from one feature, or from a list of features and blocks."""
    parts = value if isinstance(value, list | tuple) else [cast(Feature, value)]
    if not parts:
        raise InputError("features: an empty list; give at least one feature")
    return tuple(each if isinstance(each, FeatureBlock) else FeatureBlock(each) for each in parts)


@dataclass(frozen=True)
class FeaturesSpec(Spec):
    """Features of a task: one feature, or a list of features and blocks.

    In a text the keys of a block stand beside the keys of its feature.
    """

    forms: ClassVar[tuple[str, ...]] = ("plain", "table", "list")

    def check(self, value: Any, what: str) -> Any:
        blocks = make_feature_blocks(value)
        alone = len(blocks) == 1 and not isinstance(value, FeatureBlock | list | tuple)
        return blocks[0].feature if alone else blocks

    def read(self, raw: Raw, c: Context) -> Any:
        if isinstance(raw, list):
            return list(ListOf(_BlockSpec(), 1, 1000).read(raw, c.with_old_value(MISSING)))
        old = c.over
        if isinstance(old, tuple):
            old = old[0] if len(old) == 1 else MISSING
        return _BlockSpec(alone=True).read(raw, c.with_old_value(old))

    def write(self, value: Any, c: Context) -> Raw:
        if isinstance(value, tuple):
            return [_BlockSpec().write(each, c) for each in value]
        return FEATURE_CHOICE.write(value, c)

    def words(self) -> str:
        return f"{FEATURE_CHOICE.words()}, a table of one, or a list of these"

    def accepts(self) -> str:
        return f"{FEATURE_CHOICE.accepts()}, or a list of these and of feature blocks"

    def schema(self, define: Any) -> dict[str, Any]:
        one = _BlockSpec().schema(define)
        return {"anyOf": [*one["anyOf"], {"type": "array", "items": one, "minItems": 1}]}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return () if isinstance(value, tuple) else FEATURE_CHOICE.controls(value, place)

    def parts(self, keys: list[str], value: Any, c: Context) -> list[Any]:
        return [] if isinstance(value, tuple) else FEATURE_CHOICE.parts(keys, value, c)


@dataclass(frozen=True)
class _BlockSpec(Spec):
    """Feature block in a text; with `alone`, a table without keys of a block is a feature."""

    alone: bool = False
    forms: ClassVar[tuple[str, ...]] = ("table",)
    phrase: ClassVar[str] = "a feature"

    def read(self, raw: Raw, c: Context) -> Any:
        if not isinstance(raw, str | dict):
            example = (
                'a name such as "points", or a table as in { kind = "points", marks = [0, 1] }'
            )
            raise InputError(f"expected {example}, got {format_value(raw)}")
        table = {"kind": raw} if isinstance(raw, str) else raw
        before, old = c.problems.total_count, c.over
        c, own = c.with_old_value(MISSING), {}
        if isinstance(old, FeatureBlock):
            own = {each.name: getattr(old, each.name) for each in _BLOCK_FIELDS}
            old = old.feature
        for each in _BLOCK_FIELDS:
            value = each.spec.pick(table, each.name, c)
            if value is not MISSING:
                own[each.name] = value
        rest = {key: part for key, part in table.items() if key not in _BLOCK_KEYS}
        text = raw if isinstance(raw, str) else rest
        inner = c.with_old_value(old).with_facts(also=_BLOCK_KEYS)  # listed beside unknown keys
        feature = FEATURE_CHOICE.read(text, inner)
        if c.problems.total_count > before:
            raise UnreadableValue
        return feature if self.alone and not own else FeatureBlock(feature, **own)

    def write(self, value: Any, c: Context) -> Raw:
        if type(value) is not FeatureBlock:
            raise NoTextError(f"{type(value).__name__} is Python code")
        raw = FEATURE_CHOICE.write(value.feature, c)
        table = {"kind": raw} if isinstance(raw, str) else dict(raw)
        for each in _BLOCK_FIELDS:
            if getattr(value, each.name) != each.default:
                each.spec.put(table, each.name, getattr(value, each.name), c)
        return table["kind"] if len(table) == 1 else table

    def schema(self, define: Any) -> dict[str, Any]:
        own: dict[str, Any] = {}
        for each in _BLOCK_FIELDS:
            own |= each.spec.properties(each.name, define)
        tables = [
            define(FEATURE_CHOICE.family.find(name), name, **own) for name in FEATURE_CHOICE.names
        ]
        return {"anyOf": [{"enum": FEATURE_CHOICE.names}, *tables]}


_BLOCK_FIELDS = [each for each in fields_of(FeatureBlock) if each.name != "feature"]
_BLOCK_KEYS = tuple(each.name for each in _BLOCK_FIELDS)
FEATURES_SPEC = FeaturesSpec()
