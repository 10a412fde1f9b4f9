"""What `features` of a task may hold: a name, a table, or a list of these."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, Tag

from robsim.scenario.problems import shown
from robsim.scenario.quantity import Extent, Positive, Reference, forms
from robsim.scenario.schema import MOST_MARKS, Table

MOST_FEATURES, MOST_NUMBERS = 1000, 10_000

Index = Annotated[int, Field(ge=0, lt=MOST_NUMBERS)]
Indices = Annotated[list[Index], Field(min_length=1, max_length=MOST_MARKS)]
Pair = Annotated[list[Reference], Field(min_length=2, max_length=2)]
Cameras = Annotated[
    Annotated[Reference, Tag("plain")] | Annotated[Pair, Tag("list")], forms("list")
]


class PartTable(Table):
    """robsim.FeatureBlock, and what every feature has."""

    camera: Cameras | None = None
    target: Reference | None = None
    marks: Indices | None = None
    components: Indices | None = None
    weight: Positive | None = None
    tolerance: Annotated[float, Field(ge=0, le=1e9)] | None = None


class PlainTable(PartTable):
    """Features without parameters of their own."""

    kind: Literal[
        "points",
        "pixels",
        "polar",
        "spherical",
        "log_depth",
        "points_3d",
        "segments",
        "lines",
        "vanishing_point",
        "region_moments",
        "point_moments",
        "ellipse",
        "theta_u",
        "stereo_points",
    ]


class DecoupledMomentsTable(PartTable):
    """robsim.DecoupledMoments."""

    kind: Literal["decoupled_moments"]
    of: Literal["points", "region"] = "points"


class SphereTable(PartTable):
    """robsim.Sphere."""

    kind: Literal["sphere"]
    radius: Extent | None = None


class TranslationTable(PartTable):
    """robsim.Translation."""

    kind: Literal["translation"]
    form: Literal["goal", "camera"] = "goal"


FeatureTable = Annotated[
    PlainTable | DecoupledMomentsTable | SphereTable | TranslationTable,
    Field(discriminator="kind"),
]


def _feature(given: Any) -> Any:
    """A name stands for the feature with nothing said about it."""
    if not isinstance(given, str | dict):
        example = 'a name such as "points", or a table as in { kind = "points", marks = [0, 1] }'
        raise ValueError(f"expected {example}, got {shown(given)}")
    return {"kind": given} if isinstance(given, str) else given


FeatureOrName = Annotated[FeatureTable, BeforeValidator(_feature)]
Features = Annotated[
    Annotated[FeatureOrName, Tag("plain")]
    | Annotated[list[FeatureOrName], Field(min_length=1, max_length=MOST_FEATURES), Tag("list")],
    forms("list"),
]
