"""An object of a scene, with marks that cameras see."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.name_check import check_name
from robsim.base.value import Value, replace_unchecked
from robsim.declare import ListOf, Name, PerRun, Table, Vector, described, fields_of
from robsim.declare.context import Context, Raw
from robsim.declare.fields import is_identical
from robsim.declare.texts import FrameReference
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives import Primitive
from robsim.robot.link import check_shapes
from robsim.robot.link_table import SHAPE_LIST
from robsim.vision.tags.board import Board
from robsim.vision.tags.dot_pattern import DotPattern
from robsim.vision.tags.tag import Tag

MOST_MARKS = 10_000
POSITION = Vector("length")
TARGETS = {"tag": Tag, "board": Board, "dots": DotPattern}
RIVALS = *TARGETS, "marks"
PrintedTarget = Tag | Board | DotPattern


@dataclass(frozen=True)
class MarkList(ListOf):
    """The declaration of points in the axes of an object, an array (N, 3) in Python."""

    phrase: ClassVar[str] = 'a list of points, as in ["0, 0, 1 cm"]'

    def read(self, raw: Raw, c: Context) -> Any:
        return np.array(super().read(raw, c)).reshape(-1, 3)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        default = collect_vertices(c.facts["own"].get("shapes")) if c.facts.get("brief") else None
        if value is not None and not is_identical(value, default):
            table[name] = self.write(value, c.at(name))  # also an empty list


MARKS = MarkList(POSITION)


def collect_vertices(shapes: Iterable[Primitive]) -> Array:
    """Return the vertices (N, 3) of all shapes, which are the default marks of an object."""
    return np.concatenate([np.empty((0, 3)), *(shape.vertices for shape in shapes)])


@described
@dataclass(frozen=True, eq=False)
class Object(Value):
    """An object of a scene: shapes that figures show, and marks that cameras see.

    The object stands at `pose` on the frame `on`: "world", another object, or a link such as
    "rhino_xr4.tool". Its `marks` (N, 3) are points in its own axes, in metres; features of a task
    are measured from their images. The default marks are the points of its `tag`, `board` or
    `dots` (with x to the right, y down and z into the paper), or else the vertices of the shapes.

    Raises
    ------
    InputError
        If the name is not valid, the marks do not have the shape (N, 3), or two of marks, tag,
        board and dots are given.

    Examples
    --------
    >>> from robsim.geometry.primitives import Block
    >>> Object("cube", Block(0.05, 0.05, 0.05)).marks.shape
    (8, 3)
    >>> Object("plate", tag=Tag("tag36h11", 7, size=0.08)).marks[0]
    array([-0.04, -0.04,  0.  ])
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
    tag: Annotated[
        Tag | None, Table(Tag), "Tag in the plane z = 0 of the object, instead of `marks`."
    ] = None
    board: Annotated[
        Board | None, Table(Board), "Board in the plane z = 0 of the object, instead of `marks`."
    ] = None
    dots: Annotated[
        DotPattern | None,
        Table(DotPattern),
        "Dots in the plane z = 0 of the object, instead of `marks`.",
    ] = None
    text_form: ClassVar[type[Object]]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            name: str,
            shapes: Primitive | Sequence[Primitive] = (),
            marks: ArrayLike | None = None,
            pose: PoseLike = IDENTITY,
            on: str = "world",
            tag: Tag | None = None,
            board: Board | None = None,
            dots: DotPattern | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_name(self.name, "object")
        shapes = check_shapes(self.shapes, f"object '{self.name}'")
        marks = cast(ArrayLike | None, self.marks)  # before its conversion
        if (target := self._check_target()) is not None:
            marks = _check_target_marks(marks, target)
        elif marks is None:
            marks = collect_vertices(shapes)
        marks = as_floats(marks, f"marks of '{self.name}'", ("N", 3))
        if marks.ndim != 2:
            raise InputError(f"marks of '{self.name}': expected shape (N, 3), got {marks.shape}")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "marks", make_read_only(marks))
        object.__setattr__(self, "pose", check_single_pose(self.pose, f"pose of '{self.name}'"))

    def _check_target(self) -> PrintedTarget | None:
        """Return the printed target of the object; raise InputError if there are several."""
        for name, kind in TARGETS.items():
            value = getattr(self, name)
            if not isinstance(value, kind | None):
                what = f"{name} of '{self.name}'"
                raise InputError(f"{what}: expected a {kind.__name__}, got {format_value(value)}")
        given = [name for name in TARGETS if getattr(self, name) is not None]
        if len(given) > 1:
            raise InputError(f"object '{self.name}': give one of {' and '.join(given)} only")
        return self.target

    @property
    def target(self) -> PrintedTarget | None:
        """The tag, board or dots of the object, which a detector takes; None without one."""
        return next((each for name in TARGETS if (each := getattr(self, name)) is not None), None)

    @property
    def mark_target(self) -> PrintedTarget | FacePicture | None:
        """The printed target, or else the picture under the marks; None without one.

        It is a picture on a `Poster` or on a face of a `Block`: the first picture under all marks,
        or else the first picture of the object.

        Examples
        --------
        >>> from robsim.geometry.primitives import Poster
        >>> poster = Poster(np.zeros((30, 40), dtype=np.uint8), width=0.4)
        >>> Object("wall", poster).mark_target.size
        (0.4, 0.3)
        """
        if self.target is not None:
            return self.target
        marks = np.moveaxis(self.marks, 1, -1)  # in a batch they may be (N, 3, runs)
        faces = [face for shape in self.shapes for face in shape.face_pictures.values()]
        under = (face for face in faces if face.contains(marks).all())
        return next(under, faces[0] if faces else None)

    @cached_property
    def solids(self) -> tuple[Primitive, ...]:
        """The shapes of the object and of its printed target."""
        return self.shapes if self.target is None else (*self.shapes, *self.target.shapes)

    def revised(self, **changes: Any) -> Object:  # Any: values of the fields named
        """Return a copy with other fields; marks, a tag, a board and dots replace each other.

        Examples
        --------
        >>> plate = Object("plate", tag=Tag("tag36h11", 7, size=0.08))
        >>> plate.revised(tag=Tag("tag36h11", 7, size=0.1)).marks[0]
        array([-0.05, -0.05,  0.  ])
        """
        kept = dict.fromkeys(RIVALS) if changes.keys() & set(RIVALS) else {}
        return replace(self, **{**kept, **changes})

    def held(self, **changes: Any) -> Object:  # Any: values of the fields named
        """Return the objects of a batch; the marks follow a tag that differs between runs."""
        if "tag" in changes:
            changes["marks"] = make_read_only(changes["tag"].marks)
        return replace_unchecked(self, **changes)


def _check_target_marks(marks: ArrayLike | None, target: PrintedTarget) -> Array:
    """Return the marks of a target; raise InputError if other marks are given."""
    if marks is not None and not np.array_equal(marks, target.marks):
        raise InputError(f"marks and {target.name}, which has other marks: give one of them only")
    return target.marks


@dataclass(frozen=True, eq=False)
class ObjectText(Object):
    """The text form of an object: marks, a tag, a board or dots."""

    rivals: ClassVar[Any] = (tuple((name,) for name in RIVALS),)
    stands: ClassVar[Mapping[str, str]] = {name: name for name in ("shapes", "pose", "on", *RIVALS)}

    def __post_init__(self) -> None:
        """Check nothing: `build_value` does."""

    def build_value(self, c: Context) -> Object:
        """Return the object."""
        return Object(**{each.name: getattr(self, each.name) for each in fields_of(Object)})

    @classmethod
    def of(cls, value: Object, c: Context) -> ObjectText:
        """Return the text form of an object; its printed target determines its marks."""
        own = {each.name: getattr(value, each.name) for each in fields_of(Object)}
        return cls(**(own if value.target is None else {**own, "marks": None}))


Object.text_form = ObjectText
