"""From what a file says about features to features."""

from __future__ import annotations

from typing import Any

from robsim.features import FEATURES, Feature
from robsim.scenario.feature_schema import FeatureTable, PartTable
from robsim.scenario.problems import under
from robsim.servo import FeatureBlock

_OF_PART = ("camera", "target", "marks", "components", "weight")
_FIELDS = {"of": "kind"}  # the key `kind` says which feature it is


def features(given: FeatureTable | list[FeatureTable]) -> Any:
    """A feature, or parts; one table is a feature alone if it says nothing of a part."""
    if isinstance(given, list):
        made = []
        for i, table in enumerate(given):
            with under(i):
                made.append(_part(table))
        return made
    return _part(given) if _said(given).keys() & set(_OF_PART) else _feature(given)


def _part(table: FeatureTable) -> FeatureBlock:
    own = {key: value for key, value in _said(table).items() if key in _OF_PART}
    return FeatureBlock(_feature(table), **own)


def _feature(table: FeatureTable) -> Feature:
    said = {k: v for k, v in _said(table).items() if k not in (*_OF_PART, "kind")}
    made: Feature = FEATURES[table.kind](**{_FIELDS.get(k, k): v for k, v in said.items()})
    return made


def _said(table: PartTable) -> dict[str, Any]:
    return {key: value for key, value in table if value is not None}
