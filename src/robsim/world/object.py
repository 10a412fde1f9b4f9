"""An object of a scene, with marks that cameras see."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError
from robsim.base.name_check import check_name
from robsim.base.value import Value
from robsim.declare import ListOf, Name, PerRun, Vector, described
from robsim.declare.fields import is_identical
from robsim.declare.spec import Context, Raw, Spec
from robsim.declare.texts import FrameReference
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives import Primitive
from robsim.robot.link import check_shapes
from robsim.robot.link_table import SHAPE_LIST

MOST_MARKS = 10_000
POSITION = Vector("length")


@dataclass(frozen=True)
class MarkList(ListOf):
    """The declaration of points in the axes of an object, an array (N, 3) in Python."""

    item: Spec = POSITION
    phrase: ClassVar[str] = 'a list of points, as in ["0, 0, 1 cm"]'

    def read(self, raw: Raw, c: Context) -> Any:
        return np.array(super().read(raw, c)).reshape(-1, 3)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        shapes = c.facts["own"]["shapes"]
        if not (c.facts.get("brief") and is_identical(value, collect_vertices(shapes))):
            table[name] = self.write(value, c.at(name))  # also an empty list


MARKS = MarkList()


def collect_vertices(shapes: Iterable[Primitive]) -> Array:
    """Return the vertices (N, 3) of all shapes, which are the default marks of an object."""
    return np.concatenate([np.empty((0, 3)), *(shape.vertices for shape in shapes)])


@described
@dataclass(frozen=True, eq=False)
class Object(Value):
    """An object of a scene: shapes that figures show, and marks that cameras see.

    The object stands at `pose` on the frame `on`: "world", another object, or a link such as
    "rhino_xr4.tool". Its `marks` (N, 3) are points in its own axes, in metres; features of a task
    are measured from their images. The default marks are the vertices of the shapes.

    Raises
    ------
    InputError
        If the name is not valid, or the marks do not have the shape (N, 3).

    Examples
    --------
    >>> from robsim.geometry.primitives import Block
    >>> Object("cube", Block(0.05, 0.05, 0.05)).marks.shape
    (8, 3)
    """

    name: Annotated[str, Name(), "Name of the object."]
    shapes: Annotated[
        tuple[Primitive, ...],
        SHAPE_LIST,
        "Solids of the object, shown in figures and used by `clearance`.",
    ] = ()
    marks: Annotated[
        Array,
        MARKS,
        PerRun(("N", 3)),
        "Points (N, 3) that cameras see, in axes of the object, in metres. None: the vertices of "
        "its shapes.",
    ] = None  # type: ignore[assignment]  # converted by __post_init__
    pose: Annotated[
        Pose, FLAT_POSE, PerRun(), "Pose of the object in the frame that carries it."
    ] = IDENTITY
    on: Annotated[str, FrameReference, "Frame that carries the object."] = "world"

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            name: str,
            shapes: Primitive | Sequence[Primitive] = (),
            marks: ArrayLike | None = None,
            pose: PoseLike = IDENTITY,
            on: str = "world",
        ) -> None: ...

    def __post_init__(self) -> None:
        check_name(self.name, "object")
        shapes = check_shapes(self.shapes, f"object '{self.name}'")
        marks = cast(ArrayLike | None, self.marks)  # before its conversion
        if marks is None:
            marks = collect_vertices(shapes)
        marks = as_floats(marks, f"marks of '{self.name}'", ("N", 3))
        if marks.ndim != 2:
            raise InputError(f"marks of '{self.name}': expected shape (N, 3), got {marks.shape}")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "marks", make_read_only(marks))
        object.__setattr__(self, "pose", check_single_pose(self.pose, f"pose of '{self.name}'"))
