"""The table [task] of a scenario file, for every kind of task, and the file as a whole."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, Tag

from robsim.scenario.feature_schema import MOST_NUMBERS, Cameras, Features, Index
from robsim.scenario.quantity import (
    Acceleration,
    AnySpeed,
    Coordinate,
    Depth,
    Extent,
    Number,
    Period,
    Positive,
    Reference,
    Size,
    Speed,
    Text,
    TurnAcceleration,
    TurnRate,
    forms,
)
from robsim.scenario.schema import (
    ActuationTable,
    Coordinates,
    Each,
    PoseKeys,
    RunTable,
    SceneTable,
    SensingTable,
    StartTable,
    Table,
)

MOST_TASKS = 64

Three = Annotated[list[Index], Field(min_length=3, max_length=3)]
Two = Annotated[list[Index], Field(min_length=2, max_length=2)]
Share = Annotated[float, Field(gt=0, lt=1)]
Vector = Annotated[list[Number], Field(min_length=1, max_length=MOST_NUMBERS)]
Rows = Annotated[list[Vector], Field(min_length=1, max_length=MOST_NUMBERS)]
Twist = Annotated[list[Number], Field(min_length=6, max_length=6)]  # a row of L
Label = Annotated[str, Field(max_length=200)]  # of a velocity
Joints = Annotated[
    Annotated[Label, Tag("plain")]
    | Annotated[list[Label], Field(min_length=1, max_length=MOST_NUMBERS), Tag("list")],
    forms("list"),
]


# what the keys of a servo task may hold beside a number or a name


class AdaptiveTable(Table):
    """robsim.AdaptiveGain."""

    at_zero: Positive
    at_infinity: Positive
    slope: Positive


class DepthFilterTable(Table):
    """robsim.DepthFilter."""

    start: Extent
    start_sigma: Positive | None = None
    noise: Positive | None = None


class AvoidLimitsTable(Table):
    """robsim.AvoidLimits."""

    kind: Literal["avoid_limits"]
    gain: Positive | None = None
    margin: Annotated[float, Field(gt=0, lt=0.5)] | None = None


class PostureTable(Table):
    """robsim.Posture."""

    kind: Literal["posture"]
    q: Coordinates
    gain: Positive | None = None


class LargeTable(Table):
    """robsim.LargeProjection."""

    low: Positive | None = None
    high: Positive | None = None


class LimitTable(Table):
    """robsim.SpeedLimit."""

    joint: (
        Annotated[
            Annotated[AnySpeed, Tag("plain")] | Annotated[Coordinates, Tag("list")], forms("list")
        ]
        | None
    ) = None
    linear: Speed | None = None
    angular: TurnRate | None = None


class GoalTable(StartTable):
    """Where the goal is shown, from which pose of the target it is computed, or its numbers."""

    computed: PoseKeys | None = None
    s: Vector | None = None


Gain = Annotated[
    Annotated[Positive, Tag("plain")] | Annotated[AdaptiveTable, Tag("table")], forms("table")
]
Depths = Annotated[
    Annotated[Depth, Tag("plain")] | Annotated[DepthFilterTable, Tag("table")], forms("table")
]
Interaction = Annotated[
    Annotated[Literal["current", "desired", "mean", "broyden"], Tag("plain")]
    | Annotated[list[Twist], Field(min_length=1, max_length=MOST_NUMBERS), Tag("list")],
    forms("list"),
]
Projection = Annotated[
    Annotated[Literal["classic", "large"], Tag("plain")] | Annotated[LargeTable, Tag("table")],
    forms("table"),
]
Secondary = Annotated[AvoidLimitsTable | PostureTable, Field(discriminator="kind")]


# tasks; what is None keeps the default of the class


class ShapedTable(Table):
    """What can be done to a command after the law."""

    joints: Joints | None = None
    secondary: Secondary | None = None
    projection: Projection | None = None
    smooth_start: Positive | None = None
    limit: LimitTable | None = None


class ServoTable(ShapedTable):
    """robsim.servo.ServoTask; `belief` is that of this task alone, where several differ."""

    kind: str
    goal: GoalTable = GoalTable()
    camera: Cameras | None = None
    target: Reference | None = None
    interaction: Interaction | None = None
    broyden_start: Rows | None = None
    depth: Depths | None = None
    depth_scale: (
        Annotated[Annotated[Positive, Tag("plain")] | Annotated[Vector, Tag("list")], forms("list")]
        | None
    ) = None
    inverse: Literal["pseudo_inverse", "damped", "transpose"] | None = None
    rcond: Share | None = None
    damping: Positive | None = None
    tolerance: Positive | None = None
    feed_forward: Literal["none", "known", "estimated"] | None = None
    lag: Period | None = None
    belief: Any = None


class LawKeys(Table):
    """Of tasks whose law can be chosen."""

    law: Literal["joint", "camera"] | None = None
    length: Extent | None = None
    gain: Gain | None = None


class IBVSTable(ServoTable, LawKeys):
    """robsim.IBVS."""

    kind: Literal["ibvs"]
    features: Features | None = None


class PBVSTable(ServoTable, LawKeys):
    """robsim.PBVS."""

    kind: Literal["pbvs"]
    form: Literal["goal", "camera"] | None = None


class HybridTable(ServoTable, LawKeys):
    """robsim.Hybrid."""

    kind: Literal["hybrid"]
    mark: Index | None = None


class PartitionedTable(ServoTable):
    """robsim.Partitioned."""

    kind: Literal["partitioned"]
    gain: Gain | None = None
    segment: Two | None = None
    roll: Positive | None = None
    advance: Speed | None = None
    length: Extent | None = None


class PlacingTable(ServoTable):
    """robsim.Placing."""

    kind: Literal["placing"]
    variant: Literal["corrected", "printed", "completed"] | None = None
    marks: Three | None = None
    rotation: Positive | None = None
    translation: Positive | None = None
    length: Extent | None = None


class DockingTable(ServoTable):
    """robsim.Docking."""

    kind: Literal["docking"]
    gain: Gain | None = None
    turn: Positive | None = None
    h: Positive | None = None


Goals = Annotated[dict[Label, Coordinate], Field(min_length=1, max_length=MOST_NUMBERS)]


class LimitedTable(Table):
    """Under limits of joints: one for all, or one for each."""

    speed: Each
    acceleration: Each


class QuinticTable(Table):
    """robsim.trajectory.Quintic."""

    kind: Literal["quintic"]
    start: Coordinates
    end: Coordinates
    duration: Period


class TrapezoidTable(LimitedTable):
    """robsim.trajectory.Trapezoid."""

    kind: Literal["trapezoid"]
    start: Coordinates
    end: Coordinates


class BlendsTable(LimitedTable):
    """robsim.trajectory.Blends."""

    kind: Literal["blends"]
    points: Annotated[list[Coordinates], Field(min_length=2, max_length=MOST_NUMBERS)]
    corner: Each | None = None


class PaceKeys(Table):
    """How fast a frame goes from one pose to another."""

    duration: Period | None = None
    speed: Speed | None = None
    acceleration: Acceleration | None = None
    turn: TurnRate | None = None
    turn_acceleration: TurnAcceleration | None = None


class StraightTable(PaceKeys):
    """robsim.trajectory.Straight."""

    start: PoseKeys
    end: PoseKeys


class FollowJointsTable(Table):
    """robsim.FollowJoints."""

    kind: Literal["follow_joints"]
    to: (
        Annotated[
            Annotated[Goals, Tag("plain")] | Annotated[Coordinates, Tag("list")], forms("list")
        ]
        | None
    ) = None
    trajectory: (
        Annotated[QuinticTable | TrapezoidTable | BlendsTable, Field(discriminator="kind")] | None
    ) = None
    joints: Joints | None = None
    duration: Period | None = None
    speed: Each | None = None
    acceleration: Each | None = None
    gain: Positive | None = None
    tolerance: Positive | None = None


class FollowPathTable(ShapedTable, PaceKeys):
    """robsim.FollowPath."""

    kind: Literal["follow_path"]
    to: PoseKeys | None = None
    path: (
        Annotated[
            Annotated[StraightTable, Tag("plain")]
            | Annotated[
                list[StraightTable], Field(min_length=1, max_length=MOST_NUMBERS), Tag("list")
            ],
            forms("list"),
        ]
        | None
    ) = None
    frame: Reference | None = None
    mask: Literal["pose", "position"] | None = None
    inverse: Literal["pseudo_inverse", "damped"] | None = None
    rcond: Share | None = None
    damping: Positive | None = None
    gain: Positive | None = None
    tolerance: Positive | None = None


AnyServo = Annotated[
    IBVSTable | PBVSTable | HybridTable | PartitionedTable | PlacingTable | DockingTable,
    Field(discriminator="kind"),
]


class PrioritiesTable(ShapedTable):
    """robsim.Priorities."""

    kind: Literal["priorities"]
    tasks: Annotated[list[AnyServo], Field(min_length=2, max_length=MOST_TASKS)]
    rcond: Share | None = None


class ErrorBelowTable(Table):
    """robsim.ErrorBelow."""

    kind: Literal["error_below"]
    value: Positive
    of: Literal["first", "second"] | None = None


class NearBorderTable(Table):
    """robsim.NearBorder."""

    kind: Literal["near_border"]
    margin: Positive
    size: Size


class SwitchTable(Table):
    """robsim.Switch."""

    kind: Literal["switch"]
    first: TaskTable
    second: TaskTable
    when: Annotated[ErrorBelowTable | NearBorderTable, Field(discriminator="kind")]
    latch: bool | None = None


class TogetherTable(Table):
    """robsim.Parallel."""

    kind: Literal["parallel"]
    tasks: Annotated[list[TaskTable], Field(min_length=2, max_length=MOST_TASKS)]


TaskTable = Annotated[
    IBVSTable
    | PBVSTable
    | HybridTable
    | PartitionedTable
    | PlacingTable
    | DockingTable
    | FollowJointsTable
    | FollowPathTable
    | PrioritiesTable
    | SwitchTable
    | TogetherTable,
    Field(discriminator="kind"),
]
SwitchTable.model_rebuild()
TogetherTable.model_rebuild()


class ScenarioFile(SceneTable):
    """A whole file; what `belief` changes is merged over the scene and read as a SceneTable."""

    schema_number: Literal[1] = Field(alias="schema")
    title: Text | None = None
    task: TaskTable
    belief: Any = None
    start: StartTable = StartTable()
    sensing: SensingTable = SensingTable()
    actuation: ActuationTable = ActuationTable()
    run: RunTable = RunTable()
