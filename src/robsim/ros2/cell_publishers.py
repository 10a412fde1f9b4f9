"""The messages of a simulated cell: joints, marks, pictures, poses and markers."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.engine.simulated_cell import CellInstant, SimulatedCell
from robsim.logs import message_types, topics
from robsim.logs.command_messages import (
    make_header,
    make_joint_state,
    make_number_array,
    make_twist,
)
from robsim.logs.mark_arrays import make_mark_array
from robsim.logs.name_map import list_mark_ids
from robsim.logs.scene_messages import (
    compute_frame_poses,
    list_frame_names,
    make_camera_info,
    make_detections,
    make_pose,
    make_transforms,
)
from robsim.logs.tf_poses import BodyPoses
from robsim.logs.twists import TWIST_PARTS, TwistComponent
from robsim.ros2.bag_recorder import BagRecorder
from robsim.ros2.middleware import choose_mark_type, find_message_type, make_ros_message
from robsim.ros2.scene_markers import SceneMarkers
from robsim.run.control.standalone_controller import Controller
from robsim.run.log import NANO
from robsim.run.ros_connection import RosConnection
from robsim.world.scene_picture import CameraPictures, NoiseKey

MARKERS = "/robsim/markers"
INFO = message_types.LENS
CLOCK = "rosgraph_msgs/msg/Clock"
MARKER_PERIOD = 0.1  # seconds between two markers of the scene
DEPTH = 10  # messages that a slow subscriber may be behind


class CellPublishers:
    """The publishers of a node for a simulated cell.

    Messages that cost much, such as pictures, are made for subscribers only.

    Parameters
    ----------
    node : rclpy.node.Node
        Node that publishes.
    cell : SimulatedCell
        Cell, as it truly is.
    controller : Controller
        Controller of the experiment, which defines names and the order of cameras.
    connection : RosConnection
        Topics and names.
    recorder : BagRecorder
        Bag of joints, marks and poses of bodies.
    """

    def __init__(
        self,
        node: Any,
        cell: SimulatedCell,
        controller: Controller,
        connection: RosConnection,
        recorder: BagRecorder,
    ) -> None:
        self._recorder = recorder
        self._node, self._cell, self._told = node, cell, connection
        self._controller, self.cameras = controller, controller.cameras
        names, scene = dict(connection.names), cell.scene
        self._bodies = BodyPoses(scene, names, None, connection)
        log_names = [names.get(each, each) for each in scene.coordinate_names]
        self._rows = [i for i, name in enumerate(log_names) if name not in self._bodies.names]
        self._joint_names = [log_names[i] for i in self._rows]
        velocities = {name: i for i, name in enumerate(scene.velocity_names)}
        alike = [velocities.get(scene.coordinate_names[i]) for i in self._rows]
        self._columns = [] if None in alike else [i for i in alike if i is not None]
        self._ids = list_mark_ids(controller, dict(connection.ids))
        self._frames = dict(connection.frames)
        self._root = self._frames.get("world", "world")
        self._past: deque[CellInstant] = deque(maxlen=2)
        self._repeats = False  # whether the present instant was published before
        self._taken = 0  # time of the newest published images in ns, 0 before the first
        self._next_markers = 0
        self._publishers: dict[str, Any] = {}
        self._announce()
        self._recorded = self._list_recorded_topics()

    def _list_recorded_topics(self) -> set[str]:
        """Return the topics that an explanation of the motion needs."""
        flying = [link for link in self._bodies.links if link not in self._bodies.bases]
        marks = (self._told.name_topic("marks", camera=each) for each in self.cameras)
        bases = (self._odometry_topic(link) for link in self._bodies.bases)
        return {self._told.joints, *marks, *bases, *map(topics.pose_topic, flying)}

    def _announce(self) -> None:
        """Create the publishers, so that subscribers find them."""
        self._publisher(CLOCK, "/clock")
        for camera in self.cameras:
            self._publisher(self._mark_type, self._told.name_topic("marks", camera=camera))
            self._publisher(INFO, topics.camera_topic(camera, "camera_info"))
            if self._cell.scene.camera(camera).camera.size is not None:
                self._publisher(message_types.IMAGE, self._told.name_topic("images", camera=camera))
        for link in self._bodies.bases:
            self._publisher(message_types.ODOMETRY, self._odometry_topic(link))
        for frame in self._frame_names:
            self._publisher(message_types.POSE, topics.pose_topic(frame))
        if self._joint_names:
            self._publisher(message_types.JOINTS, self._told.joints)
        self._publisher(message_types.NUMBERS, topics.INSTANT)
        self._publisher("visualization_msgs/msg/MarkerArray", MARKERS)
        if self._has_tf:
            self._publisher(message_types.FRAMES, topics.FRAMES)

    @property
    def _mark_type(self) -> str:
        """The type of the marks; a cell makes no detections of AprilTags."""
        kind = choose_mark_type(self._told)
        return message_types.NUMBERS if kind == message_types.APRILTAGS else kind

    @property
    def _has_tf(self) -> bool:
        """Whether the messages of tf2 are installed."""
        return find_message_type(message_types.FRAMES) is not None

    @cached_property
    def _frame_names(self) -> list[str]:
        """The names of all frames of the scene."""
        return list_frame_names(self._cell.scene)

    def _publisher(self, kind: str, topic: str) -> Any:
        """Return the publisher of a topic."""
        if topic not in self._publishers:
            found = find_message_type(kind)
            self._publishers[topic] = self._node.create_publisher(found, topic, DEPTH)
        return self._publishers[topic]

    def _send(self, topic: str, message: Any, time: int) -> None:
        """Publish a message, and record it unless the bag needs no such messages."""
        self._publishers[topic].publish(message)
        if topic in self._recorded and not self._repeats:
            self._recorder.write(topic, message, time)

    def _is_heard(self, topic: str) -> bool:
        """Return whether a topic has subscribers."""
        return bool(self._publishers[topic].get_subscription_count())

    def publish(self, start: int) -> None:
        """Publish the messages of the present instant, of a cell that began at `start` ns."""
        now = self._cell.now
        self._store_instant(now)
        time, taken = (start + round(seconds * NANO) for seconds in (now.time, now.image_time))
        stamp = make_header(make_ros_message, time).stamp
        self._send("/clock", make_ros_message(CLOCK, clock=stamp), time)
        if now.arrived or self._repeats:  # a node that begins late has missed the newest image
            self._taken = max(taken, 1)
            for camera in self.cameras:
                self._publish_image(camera, self._taken, time)
        self._publish_poses(time)
        if self._joint_names:
            rates, none = now.rates[self._columns], np.empty(0)
            parts = now.measured[self._rows], rates if self._columns else none
            state = make_joint_state(make_ros_message, time, self._joint_names, *parts)
            self._send(self._told.joints, state, time)
        self._send(topics.INSTANT, self._make_instant(time), time)

    def _store_instant(self, now: CellInstant) -> None:
        """Store an instant for pictures between two of them, unless it was published before."""
        self._repeats = bool(self._past) and now is self._past[-1]
        if self._repeats:
            return
        if now.step == 0:
            self._past.clear()
            self._taken = 0
        self._past.append(now)

    def _make_instant(self, time: int) -> Any:
        """Return the message of an instant: its time, and the time of the newest images.

        The time of images is NaN before the first.
        """
        taken = divmod(self._taken, NANO) if self._taken else (np.nan, np.nan)
        parts = [*divmod(time, NANO), *taken * len(self.cameras)]
        return make_number_array(make_ros_message, np.array(parts, dtype=np.float64))

    def _publish_image(self, camera: str, taken: int, time: int) -> None:
        """Publish the marks, the lens and, to subscribers, the picture of a new image."""
        now, told = self._cell.now, self._told
        header = make_header(make_ros_message, taken, self._frames.get(camera, camera))
        lens = topics.camera_topic(camera, "camera_info")
        if self._is_heard(lens):
            eye = self._cell.scene.camera(camera).camera
            self._send(lens, make_camera_info(make_ros_message, eye, header), time)
        images = told.name_topic("images", camera=camera)
        if images in self._publishers and self._is_heard(images):
            self._send(images, _make_image(self._draw(camera), header), time)
        ids, pixels = self._list_visible_marks(now, camera)
        if self._mark_type == message_types.DETECTIONS:
            marks = make_detections(make_ros_message, header, ids, pixels)
        else:
            marks = make_mark_array(make_ros_message, taken, ids, pixels)
        self._send(told.name_topic("marks", camera=camera), marks, time)

    def _list_visible_marks(self, now: CellInstant, camera: str) -> tuple[list[str], Array]:
        """Return the ids and pixels (n, 2) of the marks that a camera sees."""
        keys = [key for key in now.pixels if key[0] == camera]
        ids = [name for key in keys for name in self._ids[key]]
        pixels = np.concatenate([now.pixels[key] for key in keys])
        seen = np.flatnonzero(np.isfinite(pixels).all(axis=1))
        return [ids[i] for i in seen], pixels[seen]

    def _draw(self, camera: str) -> NDArray[np.uint8]:
        """Return the newest picture (h, w) of a camera: of the task, or drawn at its time."""
        now = self._cell.now
        if camera in now.pictures:
            return np.asarray(np.rint(now.pictures[camera]), dtype=np.uint8)
        before = self._past[0]
        lateness = min(max(now.time - now.image_time, 0.0), self._cell.dt)
        share = np.array([1.0 - lateness / self._cell.dt])
        q = self._cell.scene.tree.between(before.q[:, None], now.q[:, None], share)
        rates = (now.q - before.q)[:, None] / self._cell.dt
        key = NoiseKey(0, np.zeros(1, dtype=np.uint64), now.step)
        picture: NDArray[np.uint8] = self._pictures(camera).take(q.copy(), rates, key)[0]
        return picture

    @cache  # noqa: B019  as many as cameras, and one object in a process
    def _pictures(self, camera: str) -> CameraPictures:
        """Return the renderer of a camera."""
        return CameraPictures(self._cell.scene, self._cell.scene.camera(camera))

    def _publish_poses(self, time: int) -> None:
        """Publish the poses of bodies that drive or fly, and to subscribers those of all frames."""
        names = ((frame, topics.pose_topic(frame)) for frame in self._frame_names)
        heard = [f for f, topic in names if topic in self._recorded or self._is_heard(topic)]
        shown = self._is_heard(MARKERS) and time >= self._next_markers
        whole = shown or self._has_tf
        needed = self._frame_names if whole else [*heard, *self._bodies.bases]
        every = compute_frame_poses(self._cell.scene, self._cell.now.measured[None], needed)
        poses = {name: T[0] for name, T in every.items()}
        header = make_header(make_ros_message, time, self._root)
        for frame in heard:
            pose = make_pose(make_ros_message, poses[frame])
            message = make_ros_message(message_types.POSE, header=header, pose=pose)
            self._send(topics.pose_topic(frame), message, time)
        for link in self._bodies.bases:
            message = self._make_odometry(link, poses[link], header)
            self._send(self._odometry_topic(link), message, time)
        if self._has_tf:
            named = {self._frames.get(name, name): T for name, T in poses.items()}
            message = make_transforms(make_ros_message, named, time, self._root)
            self._send(topics.FRAMES, message, time)
        if shown:
            self._next_markers = time + round(MARKER_PERIOD * NANO)
            self._send(MARKERS, self._markers.place(poses, time), time)

    @cached_property
    def _markers(self) -> SceneMarkers:
        """The markers of the scene."""
        return SceneMarkers(self._cell.scene, self._root)

    @cached_property
    def _twist_parts(self) -> dict[str, list[TwistComponent]]:
        """The components of the twist of each base, with the indices of their velocities."""
        tree, names, found = self._cell.scene.tree, self._cell.scene.velocity_names, {}
        for link in self._bodies.bases:
            body, _ = tree.find(link)
            member = next(each for each in tree.members if each.body == body)
            named = ((names[i].rpartition(".")[2], i) for i in range(self._cell.scene.nv)[member.v])
            found[link] = [TwistComponent(*TWIST_PARTS[name], i) for name, i in named]
        return found

    def _odometry_topic(self, link: str) -> str:
        """Return the topic of the odometry of a base."""
        return self._told.name_topic("odometry", robot=link.split(".", maxsplit=1)[0])

    def _make_odometry(self, link: str, pose: Array, header: Any) -> Any:
        """Return the Odometry of a base at a pose (7,), with its velocity in its own axes."""
        make = make_ros_message
        parts = self._twist_parts[link]
        both = {
            "pose": make("geometry_msgs/msg/PoseWithCovariance", pose=make_pose(make, pose)),
            "twist": make(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=make_twist(make, self._cell.now.rates, parts),
            ),
        }
        name = self._frames.get(link, link)
        return make(message_types.ODOMETRY, header=header, child_frame_id=name, **both)


def _make_image(picture: NDArray[np.uint8], header: Any) -> Any:
    """Return the Image of grey values (h, w)."""
    height, width = picture.shape
    size: Mapping[str, int] = {"height": height, "width": width, "step": width}
    data = np.ascontiguousarray(picture).ravel()
    return make_ros_message(message_types.IMAGE, header=header, encoding="mono8", data=data, **size)
