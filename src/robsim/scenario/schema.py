"""The tables of a scenario file: which keys there are, and what kind of value each takes.

A key that is not here is an error; None means that the key was not given.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, Tag

from robsim.robot.joint import Kind
from robsim.scenario.quantity import (
    Angle,
    Angles,
    Color,
    Coordinate,
    Density,
    Extent,
    Focal,
    Instant,
    Length,
    Mass,
    Matrix,
    Moments,
    Name,
    Number,
    Pair,
    Period,
    Place,
    Position,
    Record,
    Reference,
    Row,
    Size,
    Text,
    TurnRate,
    forms,
)

SCHEMA = 1
MOST_PARTS, MOST_LINKS, MOST_SHAPES, MOST_MARKS = 64, 256, 256, 10_000


class Table(BaseModel):
    """Any table: unknown keys, converted types, NaN and infinity are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class PoseKeys(Table):
    """A pose; at most one of the three rotations."""

    position: Position | None = None
    rpy: Angles | None = None
    rotvec: Angles | None = None
    rotation: Matrix | None = None


class Brick(PoseKeys):
    """What every shape has."""

    color: Color = "k"


class Solid(Brick):
    """What every shape has that can weigh something."""

    mass: Mass | None = None
    density: Density | None = None


class BlockTable(Solid):
    """robsim.Block."""

    kind: Literal["block"]
    length: Extent
    width: Extent
    height: Extent


class WheelTable(Solid):
    """robsim.Wheel."""

    kind: Literal["wheel"]
    radius: Extent
    width: Extent
    n: Annotated[int, Field(ge=3, le=4096)] = 32


class BodyTable(Solid):
    """robsim.CameraBody, as the body of a camera."""

    length: Extent
    width: Extent
    height: Extent


class CameraShapeTable(BodyTable):
    """robsim.CameraBody, as a shape."""

    kind: Literal["camera"]


class BallTable(Solid):
    """robsim.Ball."""

    kind: Literal["ball"]
    radius: Extent
    n: Annotated[int, Field(ge=3, le=4096)] = 32


class MeshTable(Brick):
    """robsim.Mesh: a name alone."""

    kind: Literal["mesh"]
    filename: Annotated[str, Field(max_length=1000)]
    scale: Row = [1.0, 1.0, 1.0]


ShapeTable = Annotated[
    BlockTable | WheelTable | CameraShapeTable | BallTable | MeshTable, Field(discriminator="kind")
]
Shapes = Annotated[list[ShapeTable], Field(max_length=MOST_SHAPES)]
Coordinates = Annotated[list[Coordinate], Field(max_length=7 * MOST_LINKS * MOST_PARTS)]


class DHTable(Table):
    """One row of a Denavit-Hartenberg table."""

    theta: Angle
    d: Length
    a: Length
    alpha: Angle


class LineTable(Table):
    """robsim.geometry.curves.Line."""

    kind: Literal["line"]
    length: Extent


class ArcTable(Table):
    """robsim.geometry.curves.Arc."""

    kind: Literal["arc"]
    radius: Extent
    angle: Angle


class PolylineTable(Table):
    """robsim.geometry.curves.Polyline; points "x, y m"."""

    kind: Literal["polyline"]
    points: Annotated[list[Place], Field(min_length=2, max_length=1000)]
    radius: Extent


class CatenaryTable(Table):
    """robsim.geometry.curves.Catenary; start and end "x, y m"."""

    kind: Literal["catenary"]
    start: Place
    end: Place
    length: Extent


CurveTable = Annotated[
    LineTable | ArcTable | PolylineTable | CatenaryTable, Field(discriminator="kind")
]


class SteeringTable(Table):
    """robsim.Steering."""

    wheelbase: Extent
    limit: Angle | None = None
    rate: TurnRate | None = None


class MimicTable(Table):
    """robsim.Mimic; the offset is in the unit of the joint."""

    kind: Literal["mimic"]
    of: Reference
    ratio: Number = 1.0
    offset: Coordinate | None = None


class ChordTable(Table):
    """robsim.Chord."""

    kind: Literal["chord"]
    of: Reference
    length: Extent
    radius: Length = 0.0
    at: Extent | None = None
    gives: Literal["angle", "arc", "height", "tilt"] = "arc"


class AckermannTable(Table):
    """robsim.Ackermann."""

    kind: Literal["ackermann"]
    of: Reference


class RollingTable(Table):
    """robsim.Rolling."""

    kind: Literal["rolling"]
    radius: Extent


FollowsTable = Annotated[
    MimicTable | ChordTable | AckermannTable | RollingTable, Field(discriminator="kind")
]


class InertiaTable(Table):
    """robsim.Inertia: moments ixx, iyy, izz and products ixy, ixz, iyz of the tensor."""

    mass: Mass
    centre: Position = (0.0, 0.0, 0.0)
    moments: Moments
    products: Moments = (0.0, 0.0, 0.0)


class LinkTable(Table):
    """robsim.Link on its joint: `dh` or `place` and `tail`."""

    name: Name
    parent: Name | None = None
    joint: Kind = "fixed"
    joint_name: Name | None = None
    speed: Coordinate | None = None
    effort: Annotated[float, Field(gt=0)] | None = None
    curve: CurveTable | None = None
    steering: SteeringTable | None = None
    follows: FollowsTable | None = None
    dh: DHTable | None = None
    place: PoseKeys = PoseKeys()
    tail: PoseKeys = PoseKeys()
    limits: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None
    shapes: Shapes = []
    inertia: InertiaTable | None = None


class PartTable(PoseKeys):
    """What stands somewhere in a scene."""

    name: Name
    on: Reference = "world"


class LinkedTable(PoseKeys):
    """Links on joints."""

    name: Name
    about: Text | None = None
    sources: Annotated[list[Text], Field(max_length=64)] = []
    convention: Literal["standard", "modified"] = "standard"
    home: Coordinates | None = None
    links: Annotated[list[LinkTable], Field(min_length=1, max_length=MOST_LINKS)]


class ToolTable(LinkedTable):
    """What robsim.Robot.with_tool puts on a link: the last, or `on`."""

    on: Name | None = None
    bare: bool = False


class RobotTable(LinkedTable, PartTable):
    """robsim.Robot; a library robot is expanded to this form."""

    tools: Annotated[list[ToolTable], Field(max_length=MOST_PARTS)] = []


class RobotFile(RobotTable):
    """A file of the robot library."""

    schema_number: Literal[1] = Field(alias="schema")


class ObjectTable(PartTable):
    """robsim.Object; without marks, the vertices of the shapes."""

    shapes: Shapes = []
    marks: Annotated[list[Position], Field(max_length=MOST_MARKS)] | None = None


class CameraTable(PartTable):
    """robsim.Camera where it is mounted: `K`, or `focal`, `center` and `skew`."""

    size: Size | None = None
    K: Matrix | None = None
    focal: Focal | None = None
    center: Pair | None = None
    skew: Number | None = None
    distortion: Annotated[list[Number], Field(max_length=8)] = []
    body: BodyTable | None = None


class MotionTable(Table):
    """robsim.Motion: a robot that moves on its own."""

    robot: Name
    rates: Coordinates


class SceneTable(Table):
    """robsim.Scene."""

    robots: Annotated[list[RobotTable], Field(max_length=MOST_PARTS)] = []
    objects: Annotated[list[ObjectTable], Field(max_length=MOST_PARTS)] = []
    cameras: Annotated[list[CameraTable], Field(max_length=MOST_PARTS)] = []
    motions: Annotated[list[MotionTable], Field(max_length=MOST_PARTS)] = []
    display: PoseKeys = PoseKeys()


class StartTable(PoseKeys):
    """Where a run starts: `q`, or the pose of a floating robot."""

    q: Coordinates | None = None


class RunTable(Table):
    """What `simulate` is told; what is None keeps the default of Settings."""

    dt: Period | None = None
    duration: Period | None = None
    seed: Annotated[int, Field(ge=0, lt=2**64)] | None = None
    hold: bool | None = None
    record: Record | None = None


class OcclusionTable(Table):
    """robsim.Occlusion."""

    marks: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1, max_length=MOST_MARKS)]
    start: Period
    end: Period | None = None
    target: Name | None = None
    camera: Name | None = None


NotNegative = Annotated[float, Field(ge=0, le=1e9)]
Share = Annotated[float, Field(ge=0, lt=1)]


class SensingTable(Table):
    """robsim.Sensing."""

    noise: NotNegative | None = None
    quantisation: NotNegative | None = None
    outliers: Share | None = None
    outlier_size: NotNegative | None = None
    occlusions: Annotated[list[OcclusionTable], Field(max_length=MOST_MARKS)] | None = None
    dropped: Share | None = None
    latency: Instant | None = None
    period: Period | None = None


# one quantity for all, or a list of one for each
Each = Annotated[
    Annotated[Coordinate, Tag("plain")] | Annotated[Coordinates, Tag("list")], forms("list")
]


class ActuationTable(Table):
    """robsim.Actuation."""

    lag: Instant | None = None
    velocity: Each | None = None
    acceleration: Each | None = None
    encoder: Each | None = None


class BeliefTable(SceneTable):
    """The believed scene: changes to the true one, unless it is complete."""

    complete: bool = False
