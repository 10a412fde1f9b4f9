"""The scene: robots, objects and cameras on one kinematic tree from the world frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_bool, as_floats, as_integer, has_items, move_runs_last
from robsim.base.errors import FrameError, InputError, format_value, is_known_name
from robsim.base.value import copy_cached, replace_unchecked
from robsim.declare import ListOf, Number, Role, Table, described
from robsim.declare.context import Context
from robsim.declare.problems import prefix_path
from robsim.declare.tables import PartTable
from robsim.features.feature import Feature, Observation
from robsim.features.interaction_matrix import InteractionMatrix, check_features, stack_interactions
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose, homogeneous_matrix
from robsim.geometry.pose_table import POSE
from robsim.rendering.light import Light
from robsim.robot.frame import Frame
from robsim.robot.robot import Robot
from robsim.robot.robot_table import MOST_LISTED_PARTS, ROBOT
from robsim.robot.tree import Tree
from robsim.vision.optics import MOST_SAMPLES
from robsim.world import scene_overview
from robsim.world.belief_errors import is_not_default, perturb_camera, perturb_robot, perturb_target
from robsim.world.motion import Motion
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import MOST_MARKS, Object
from robsim.world.scene_coordinates import SceneCoordinates
from robsim.world.scene_frames import check_attachment, list_scene_frames, report_unknown_frames
from robsim.world.scene_parts import (
    PART_TYPES,
    Configuration,
    find_part,
    parse_coordinates,
    replace_part,
)


class View(NamedTuple):
    """The image of points: pixels (..., N, 2), depth (..., N) in metres, `Visibility` (..., N)."""

    pixels: Array
    depth: Array
    visibility: NDArray[np.int8]


GREY = Number(least=0, most=255)
LAST_CONTROLLER = "_last_controller"  # attribute that holds the last controller of a servo task
# cached properties that stay the same in a revised scene
KEPT_PROPERTIES = (
    *("coordinate_names", "coordinate_units", "velocity_names", "velocity_units"),
    *("nq", "nv", "prescribed"),
)


@described
@dataclass(frozen=True)
class Scene(SceneCoordinates):
    """Robots, objects and cameras on one kinematic tree from the world frame.

    A scene is the geometry of an experiment: `pose` returns the pose of a frame, and `view` the
    image of points in a camera. The names of frames are "world", "robot.link", and the names of
    objects and cameras. The chapter denotes `display` by gT0.

    The coordinates q (nq,) of a scene are the coordinates of its robots, one robot after the other.
    A scene is immutable: `replacing`, `believe`, `attached` and `released` return changed copies.

    Raises
    ------
    FrameError
        If a part is on a frame that does not exist, or parts carry each other.
    InputError
        If two parts have the same name, or a motion does not fit its robot.

    Examples
    --------
    >>> from robsim import Camera
    >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
    >>> lens = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> eye = MountedCamera("eye", lens, on="arm.link1")
    >>> scene = Scene([arm], [Object("dot", marks=[[1, 0, 2]])], [eye])
    >>> scene.view([0.0], points="dot").pixels
    array([[320., 240.]])
    """

    robots: Annotated[
        tuple[Robot, ...], ListOf(ROBOT, most=MOST_LISTED_PARTS), "Robots of the scene."
    ] = ()
    objects: Annotated[
        tuple[Object, ...],
        ListOf(PartTable(Object), most=MOST_LISTED_PARTS),
        "Objects of the scene, with marks that cameras see.",
    ] = ()
    cameras: Annotated[
        tuple[MountedCamera, ...],
        ListOf(PartTable(MountedCamera), most=MOST_LISTED_PARTS),
        "Mounted cameras.",
    ] = ()
    motions: Annotated[
        tuple[Motion, ...],
        ListOf(Table(Motion), most=MOST_LISTED_PARTS),
        "Prescribed motions of robots that no task commands.",
    ] = ()
    display: Annotated[
        Pose, POSE, Role.FIGURE, "Pose of the world in the frame of the figures."
    ] = field(default=IDENTITY, kw_only=True)
    light: Annotated[Light, Table(Light), Role.FIGURE, "Light in the pictures of cameras."] = field(
        default=Light(), kw_only=True
    )
    background: Annotated[
        float, GREY, Role.FIGURE, "Grey value of pixels without a body, from 0 to 255."
    ] = field(default=50.0, kw_only=True)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            robots: Robot | Sequence[Robot] = (),
            objects: Object | Sequence[Object] = (),
            cameras: MountedCamera | Sequence[MountedCamera] = (),
            motions: Motion | Sequence[Motion] = (),
            *,
            display: PoseLike = IDENTITY,
            light: Light = Light(),  # noqa: B008 - frozen
            background: float = 50.0,
        ) -> None: ...

    @classmethod
    def facts(cls, own: object, c: Context) -> Context:
        """Return the context with the robots of the scene, which its motions need."""
        return c.with_facts(parts=own)

    @classmethod
    def text_check(cls, raw: Mapping[str, object], c: Context) -> None:
        """Report frames that do not exist, each at its key in the text."""
        report_unknown_frames(raw, c.facts["own"], c)
        for thing in c.facts["own"].get("objects", ()):
            if len(thing.marks) > MOST_MARKS:
                text = f"{len(thing.marks)} marks; at most {MOST_MARKS}: name them (marks)"
                c.at("objects", thing.name).report(text)

    def __post_init__(self) -> None:
        for kind, part in PART_TYPES.items():
            value = getattr(self, kind)
            items = (value,) if isinstance(value, part) else value
            if not has_items(items) or not all(isinstance(p, part) for p in items):
                raise InputError(
                    f"{kind} must be a list of {part.__name__}, got {format_value(value)}"
                )
            object.__setattr__(self, kind, tuple(items))
        object.__setattr__(self, "display", check_single_pose(self.display, "display"))
        _check_light(self.light)
        object.__setattr__(self, "background", GREY.check(self.background, "background"))
        kind_of = self._check_names()
        try:
            _ = self.tree  # raises FrameError for an unknown frame
        except FrameError as error:
            with prefix_path(kind_of.get(error.path.partition(".")[0], "robots")):
                raise
        movers: set[str] = set()
        for motion in self.motions:
            with prefix_path("motions", motion.robot):
                motion.check(self.robot(motion.robot).nv)
                if motion.robot in movers:
                    raise InputError("two motions for one robot")
            movers.add(motion.robot)

    def revised(self, **changes: Any) -> Scene:  # Any: values of the fields named
        """Return a copy with other numbers in the same parts, reusing unchanged results.

        The copy has the same names and numbers of coordinates, and the same tree if no frame moves.
        """
        copy = replace_unchecked(self, **changes)
        copy_cached(self, copy, KEPT_PROPERTIES)
        if _frame_placement(copy) == _frame_placement(self):
            copy_cached(self, copy, ("tree",))
        for motion in copy.motions if "motions" in changes else ():
            with prefix_path("motions", motion.robot):
                motion.check(copy.robot(motion.robot).nv)
        return copy

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the last controller: a copy has other objects, and another process."""
        return {name: value for name, value in vars(self).items() if name != LAST_CONTROLLER}

    def __repr__(self) -> str:
        """Return a text with one line for each part."""
        return scene_overview.format_scene(self)

    def _repr_html_(self) -> str:
        """Return a table of all parts as HTML for notebooks."""
        return scene_overview.format_scene_html(self)

    @cached_property
    def tree(self) -> Tree:
        """The kinematic tree of all frames; coordinates come in the order of the robots."""
        return Tree(self._frames)

    def robot(self, name: str | None = None) -> Robot:
        """Return the robot with a name, or the only robot if `name` is None."""
        return find_part(self.robots, name, "robot")

    def object(self, name: str | None = None) -> Object:
        """Return the object with a name, or the only object with marks if `name` is None."""
        with_marks = tuple(thing for thing in self.objects if len(thing.marks))
        return find_part(with_marks if name is None else self.objects, name, "object")

    def camera(self, name: str | None = None) -> MountedCamera:
        """Return the camera with a name, or the only camera if `name` is None."""
        return find_part(self.cameras, name, "camera")

    def replacing(self, *parts: Robot | Object | MountedCamera | Motion) -> Scene:
        """Return a copy with some parts replaced by parts of the same kind and name.

        Parameters
        ----------
        *parts : Robot, Object, MountedCamera or Motion
            New parts. The name of a `Motion` is the name of its robot.

        Returns
        -------
        Scene
            The changed copy, for example the belief of a controller.

        Raises
        ------
        InputError
            If the scene has no part of that kind and name.

        Examples
        --------
        >>> scene = Scene(objects=Object("cup", marks=[[0, 0, 0]]))
        >>> moved = Object("cup", marks=[[0, 0, 0]], pose=Pose.at(1, 0, 0))
        >>> scene.replacing(moved).pose("cup").position
        array([1., 0., 0.])
        """
        changed: dict[str, Any] = {kind: list(getattr(self, kind)) for kind in PART_TYPES}
        for part in parts:
            replace_part(changed, part)
        return replace(self, **changed)

    def believe(
        self,
        *,
        camera: str | None = None,
        focal: ArrayLike = 1.0,
        center: ArrayLike = (0.0, 0.0),
        distortion: ArrayLike | None = None,
        lens: Literal["perspective", "fisheye"] | None = None,
        hand_eye: PoseLike | None = None,
        robot: str | None = None,
        dh: Mapping[str, Mapping[str, float]] | None = None,
        convention: Literal["standard", "modified"] = "standard",
        base: PoseLike | None = None,
        target: str | None = None,
        size: float = 1.0,
        marks: ArrayLike | None = None,
        place: PoseLike | None = None,
    ) -> Scene:
        """Return a copy with wrong parameters, for the `belief` of a task.

        The controller of the task computes with the copy, while the simulation uses the true scene.
        Parameters that are not given are exact.

        Parameters
        ----------
        camera : str, optional
            Name of the camera with errors. Default: the only camera.
        focal : float or (float, float), default 1
            Factor of the focal lengths, or one factor for columns and one for rows.
        center : (float, float), default (0, 0)
            Error of the principal point, (column, row) in pixels.
        distortion : array_like, optional
            Distortion coefficients in place of the true coefficients.
        lens : {"perspective", "fisheye"}, optional
            Model of the lens in place of the true model. If the true lens has coefficients, those
            of this model are needed as well.
        hand_eye : pose_like, optional
            Error of the mount: the believed pose is T_mount_camera @ hand_eye.
        robot : str, optional
            Name of the robot with errors. Default: the only robot.
        dh : mapping, optional
            Errors {link: {"theta": rad, "d": m, "a": m, "alpha": rad}}, which are added to the
            Denavit-Hartenberg rows of the links in this `convention`. Each link may have some of
            them.
        convention : {"standard", "modified"}, default "standard"
            Convention of the Denavit-Hartenberg table.
        base : pose_like, optional
            Error of the base of the robot: the believed pose is the true pose @ base.
        target : str, optional
            Name of the object with errors. Default: the only object with marks.
        size : float, default 1
            Factor of the marks of the target.
        marks : array_like of shape (N, 3), optional
            Marks of the target in place of the true marks, in its axes, in metres.
        place : pose_like, optional
            Error of the pose of the target: the believed pose is the true pose @ place.

        Returns
        -------
        Scene
            The scene with errors.

        Raises
        ------
        InputError
            If the camera, robot, link or target does not exist, or a value is not a pose or a
            number.

        Examples
        --------
        >>> from robsim import Camera
        >>> eye = MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]))
        >>> Scene(cameras=eye).believe(focal=1.5).camera().camera.K[0]
        array([1200.,    0.,  320.])
        """
        if not is_known_name(convention, ("standard", "modified")):
            raise InputError(
                f"convention must be 'standard' or 'modified', got {format_value(convention)}"
            )
        wrong: list[Robot | Object | MountedCamera] = []
        intrinsics = (
            is_not_default(focal, 1.0)
            or is_not_default(center, (0.0, 0.0))
            or distortion is not None
            or lens is not None
        )
        if camera is not None or intrinsics or hand_eye is not None:
            numbers = focal, center, distortion, lens, hand_eye
            wrong.append(perturb_camera(self.camera(camera), *numbers))
        if robot is not None or dh is not None or base is not None:
            wrong.append(perturb_robot(self.robot(robot), dh, convention, base))
        if (
            target is not None
            or marks is not None
            or place is not None
            or is_not_default(size, 1.0)
        ):
            wrong.append(perturb_target(self.object(target), size, marks, place))
        return self.replacing(*wrong)

    def attached(self, name: str, to: str, q: Configuration | None = None) -> Scene:
        """Return a copy with an object on the frame `to`, at its present pose in the world.

        The object then moves with that frame, such as a gripper or a pallet.

        Parameters
        ----------
        name : str
            Name of the object.
        to : str
            Frame that carries the object from now on.
        q : array_like of shape (nq,), optional
            Coordinates of the scene when the object changes its frame. Default: `home`.

        Returns
        -------
        Scene
            Scene with the object on the frame `to`.

        Raises
        ------
        FrameError
            If the frame does not exist, or if the object itself carries it.
        InputError
            If the object does not exist, or q is not a single state.

        Examples
        --------
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
        >>> scene = Scene([arm], Object("cup", marks=[[0, 0, 0]], pose=Pose.at(1, 0, 0)))
        >>> held = scene.attached("cup", "arm.link1", q=[0.0])
        >>> held.pose("cup", [np.pi / 2]).position.round(9)
        array([0., 1., 0.])
        """
        thing = self.object(name)
        values = self.coordinates(self.home if q is None else q, limits=False)
        if values.ndim != 1:
            raise InputError(
                f"q: '{name}' needs one state ({self.nq},) of the scene, got {values.shape}"
            )
        check_attachment(self._frames, thing, to)
        pose = self.pose(to, values).inv() @ self.pose(thing.name, values)
        return self.replacing(replace(thing, pose=Pose(pose.matrix), on=to))

    def released(self, name: str, q: Configuration | None = None) -> Scene:
        """Return a copy with an object on the frame "world", at its present pose in the world.

        Parameters
        ----------
        name : str
            Name of the object.
        q : array_like of shape (nq,), optional
            Coordinates of the scene when the object is released. Default: `home`.

        Returns
        -------
        Scene
            Scene with the object on the frame "world".

        Raises
        ------
        InputError
            If the object does not exist, or q is not a single state.

        Examples
        --------
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
        >>> scene = Scene([arm], Object("cup", marks=[[0, 0, 0]], on="arm.link1"))
        >>> scene.released("cup", q=[0.0]).pose("cup", [1.0]).position
        array([1., 0., 0.])
        """
        return self.attached(name, "world", q)

    def coordinates(self, q: Configuration, what: str = "q", limits: bool = True) -> Array:
        """Return checked coordinates of all robots.

        Parameters
        ----------
        q : array_like of shape (..., nq) or mapping
            Coordinates of the scene, or {robot: its coordinates}; robots without an entry are at
            home.
        what : str, default "q"
            Name of the argument in error messages.
        limits : bool, default True
            Whether coordinates outside the limits of the joints are an error.

        Returns
        -------
        ndarray of shape (..., nq)
            Coordinates of the scene.

        Raises
        ------
        InputError
            If the shape is wrong, a robot does not exist, or a coordinate is outside its limits.

        Examples
        --------
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
        >>> Scene([arm, arm.named("other")]).coordinates({"other": [0.5]})
        array([0. , 0.5])
        """
        if isinstance(q, Mapping):
            for name in q:
                self.robot(name)
        return parse_coordinates(self.robots, q, what, as_bool(limits, "limits"))

    def pose(self, frame: str, q: Configuration | None = None) -> Pose:
        """Return the pose of a frame in the world.

        Parameters
        ----------
        frame : str
            Frame "robot.link", or the name of an object or camera.
        q : array_like of shape (..., nq), optional
            Coordinates of the scene. Default: `home`.

        Returns
        -------
        Pose of shape (..., 4, 4)
            Pose T_world_frame.

        Raises
        ------
        FrameError
            If the frame does not exist.

        Examples
        --------
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm").at(Pose.at(0, 0, 2))
        >>> Scene([arm]).pose("arm.link1", [0.0]).position
        array([1., 0., 2.])
        """
        values = self.coordinates(self.home if q is None else q, limits=False)
        T = self.tree.frame(self.tree.bodies(move_runs_last(values, 1)), frame)
        return Pose(homogeneous_matrix(T, values.shape[:-1]), ("world", frame))

    def view(
        self,
        q: Configuration | None = None,
        camera: str | None = None,
        points: str | ArrayLike | None = None,
    ) -> View:
        """Return the image of an object's marks or of points in a camera.

        Parameters
        ----------
        q : array_like of shape (..., nq), optional
            Coordinates of the scene. Default: `home`.
        camera : str, optional
            Name of the camera. Default: the only camera.
        points : str or array_like of shape (N, 3), optional
            Name of an object, to view its marks, or points in the world in metres. Default: the
            marks of the only object that has marks.

        Returns
        -------
        View
            Pixels (..., N, 2), depths (..., N) in metres and `Visibility` (..., N). Pixels of
            points behind the camera are NaN.

        Examples
        --------
        >>> from robsim import Camera
        >>> eye = MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]))
        >>> Scene(cameras=eye).view(points=[[0, 0, 2]]).depth
        array([2.])
        """
        eye = self.camera(camera)
        T_w_c = Pose(self.pose(eye.name, q).matrix)
        if points is None or isinstance(points, str):
            thing = self.object(points)
            marks = Pose(self.pose(thing.name, q).matrix) @ thing.marks
        else:
            marks = as_floats(points, "points", ("N", 3))
        depth = np.asarray(T_w_c.inv() @ marks)[..., 2]
        return View(eye.camera.project(marks, T_w_c), depth, eye.camera.visibility(marks, T_w_c))

    def picture(
        self,
        q: Configuration | None = None,
        camera: str | None = None,
        *,
        samples: int | None = None,
        light: Light | None = None,
        background: float | None = None,
        exact: bool = False,
        seed: int = 0,
    ) -> NDArray[np.uint8] | NDArray[np.float32]:
        """Return the grey picture that a camera sees.

        The picture shows the shapes of robots, objects and other cameras, tags, boards and posters,
        through the lens of the camera. Ink of tags and boards has 30 and
        their paper 225 in full light. A pixel at an edge is the mean over its area; elsewhere it is
        the value at its centre, of a picture from copies of falling size. There are no colours,
        shadows, reflections and transparent bodies, and a camera inside a body does not see it.

        A camera with `optics` has the errors that need no motion: the blur of its lens, vignetting,
        gain, noise, gamma and bits. Several pictures have different noise: the first one of them
        has the noise that it has alone.

        Parameters
        ----------
        q : array_like of shape (..., nq), optional
            Coordinates of the scene. Default: `home`.
        camera : str, optional
            Name of the camera. Default: the only camera.
        samples : int, optional
            Divisions along each side of a pixel, from 1 to 8. With 2 the picture has a quarter of
            the error and takes four times as long. Default: `samples` of the optics, or 1.
        light : Light, optional
            Light of the picture. Default: `light` of the scene.
        background : float, optional
            Grey value of pixels without a body, from 0 to 255. Default: `background` of the scene.
        exact : bool, default False
            Whether to return grey values that are not rounded and without the errors of `optics`:
            the light of an ideal camera.
        seed : int, default 0
            Seed of the noise.

        Returns
        -------
        ndarray of uint8 of shape (..., h, w)
            Grey values from 0 to 255; float32 with `exact`.

        Raises
        ------
        InputError
            If the camera has no size, an argument is out of its range, or the pictures are too
            large.

        Warns
        -----
        FileWarning
            If the file of a mesh is unknown, as in a repeated run, or cannot be read. The collision
            shapes of the mesh replace it, if there are any.

        Examples
        --------
        >>> from robsim import Camera
        >>> from robsim.shapes import Block
        >>> eye = MountedCamera("eye", Camera([[2, 0, 1], [0, 2, 1], [0, 0, 1]], size=(3, 3)))
        >>> cube = Object("cube", Block(1, 1, 1, albedo=0.8), pose=Pose.at(0, 0, 2))
        >>> Scene(objects=cube, cameras=eye).picture(samples=8, light=Light(ambient=1.0))
        array([[ 54,  76,  54],
               [ 76, 204,  76],
               [ 54,  76,  54]], dtype=uint8)
        """
        from robsim.world import scene_picture as pictures

        values = self.coordinates(self.home if q is None else q, limits=False)
        shown, key = self._light_up(light, background), as_integer(seed, "seed", 0, 2**64)
        pictures.warn_missing_meshes(shown)
        eye = self.camera(camera)
        count = (
            eye.samples if samples is None else as_integer(samples, "samples", 1, MOST_SAMPLES + 1)
        )
        images = pictures.draw_scene(shown, values, eye, count)
        return images if as_bool(exact, "exact") else pictures.develop_pictures(images, eye, key)

    def _light_up(self, light: Light | None, background: float | None) -> Scene:
        """Return the scene in another light, or before another background, if they are given."""
        if light is None and background is None:
            return self
        grey = self.background if background is None else GREY.check(background, "background")
        return self.revised(light=_check_light(light or self.light), background=grey)

    def interaction(
        self,
        q: Configuration | None = None,
        camera: str | tuple[str, str] | None = None,
        target: str | None = None,
        features: str | Feature | Sequence[str | Feature] = "points",
    ) -> InteractionMatrix:
        """Return the interaction matrix L of features of an object, with true depths.

        L relates the features to the twist V = (v, omega) of the camera in camera axes while the
        object stands still,

            sdot = L V.

        For the normalised coordinates (x, y) of a point at depth Z (chapter, eq. 4; Chaumette and
        Hutchinson 2006),

            L_x = (-1/Z, 0, x/Z, xy, -(1 + x^2), y),    L_y = (0, -1/Z, y/Z, 1 + y^2, -xy, -x).

        Use `ServoTask.task_jacobian` for the matrix L J with respect to joint velocities, as the
        controller of a task models it.

        Parameters
        ----------
        q : array_like of shape (..., nq), optional
            Coordinates of the scene. Default: `home`.
        camera : str, or (str, str) for features of a stereo pair, optional
            Name of the camera; the twist is of the first. Default: the only camera.
        target : str, optional
            Name of the object with the marks. Default: the only object that has marks.
        features : str, feature, or list of them, default "points"
            Features that are stacked. A pose feature is relative to its `T_goal_o`.

        Returns
        -------
        InteractionMatrix
            The numbers (..., k, 6) with names of rows and columns, rank, condition, and the motions
            that change no feature. Rows of marks behind the camera are NaN.

        Raises
        ------
        InputError
            If the camera, object or feature does not exist, or if the object has too few marks.

        Examples
        --------
        >>> from robsim import Camera
        >>> eye = MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]))
        >>> scene = Scene(objects=Object("dot", marks=[[0.2, 0, 2]]), cameras=eye)
        >>> L = scene.interaction()
        >>> L.matrix + 0.0
        array([[-0.5 ,  0.  ,  0.05,  0.  , -1.01,  0.  ],
               [ 0.  , -0.5 ,  0.  ,  1.  ,  0.  , -0.1 ]])
        >>> L.rank, L.free_motions()[0]
        (2, 'the camera may move along (0.0995, 0, 0.995)')
        """
        names = camera if isinstance(camera, tuple | list) else (camera,)
        eyes = [self.camera(name) for name in names]
        thing = self.object(target)
        kinds = check_features(features, len(eyes), len(thing.marks))
        T_w_o = Pose(self.pose(thing.name, q).matrix)
        first, *others = [(eye, Pose(self.pose(eye.name, q).matrix)) for eye in eyes]
        seen = self._observe(*first, thing, T_w_o)
        for eye, T_w_c in others:
            other = self._observe(eye, T_w_c, thing, T_w_o)
            between = (first[1].inv() @ T_w_c).matrix.reshape(-1, 4, 4)
            seen = Observation.of(
                seen.pixels,
                seen.depth,
                seen.camera,
                model=thing.marks,
                pose=seen.pose,
                other=other,
                between=between,
            )
        return stack_interactions(kinds, seen, (T_w_o @ IDENTITY).matrix.shape[:-2])

    def _observe(self, eye: MountedCamera, T_w_c: Pose, thing: Object, T_w_o: Pose) -> Observation:
        """Return the exact observation of the marks of an object, with its true pose."""
        marks = T_w_o @ thing.marks
        T_c_o = T_w_c.inv() @ T_w_o
        depth = np.asarray(T_w_c.inv() @ marks)[..., 2]
        N = len(thing.marks)
        return Observation.of(
            eye.camera.project(marks, T_w_c).reshape(-1, N, 2),
            depth.reshape(-1, N),
            eye.camera,
            model=thing.marks,
            pose=T_c_o.matrix.reshape(-1, 4, 4),
        )

    def _check_names(self) -> dict[str, str]:
        """Return the kind of each part by its name; raise InputError if two parts share a name."""
        kind_of = {"world": ""}
        for kind in ("robots", "objects", "cameras"):
            for part in getattr(self, kind):
                if part.name in kind_of:
                    with prefix_path(kind, part.name):
                        text = f"two things in the scene are called '{part.name}'; rename one"
                        raise InputError(text)
                kind_of[part.name] = kind
        return kind_of

    @property
    def _frames(self) -> list[Frame]:
        return list_scene_frames(self.robots, self.objects, self.cameras)


def _check_light(light: object) -> Light:
    """Return a light; raise InputError if it is none."""
    if not isinstance(light, Light):
        raise InputError(f"light: expected a Light, got {format_value(light)}")
    return light


def _frame_placement(scene: Scene) -> list[int]:
    """Return the identities of robots and poses; equal lists mean the same frames."""
    attached: tuple[Object | MountedCamera, ...] = (*scene.objects, *scene.cameras)
    return [*map(id, scene.robots), *(id(part.pose) for part in attached)]
