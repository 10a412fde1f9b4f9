"""The lifecycle node that drives a robot by the controller of an experiment."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, RobSimError
from robsim.logs.mark_arrays import make_mark_array
from robsim.logs.message_types import (
    DETECTIONS,
    FRAMES,
    IMAGE,
    JOINTS,
    NUMBERS,
    ODOMETRY,
    POSE,
    STAMPED,
    TEXT,
)
from robsim.logs.name_map import list_mark_ids
from robsim.logs.topics import FRAMES as MOVING_FRAMES
from robsim.logs.topics import INSTANT, STATIC_FRAMES, pose_topic
from robsim.ros2.bag_recorder import BagRecorder
from robsim.ros2.command_state import describe_command, find_level, list_health_values
from robsim.ros2.connection_parameters import declare_connection
from robsim.ros2.diagnostics import PERIOD, DiagnosticPublisher
from robsim.ros2.drive_loop import DriveLoop, read_instant, teach_goal
from robsim.ros2.middleware import (
    choose_mark_type,
    create_data_node,
    find_message_type,
    load_message_type,
    make_latched_qos,
    make_listening_qos,
    make_ros_message,
)
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.run.ros_connection import RosConnection
from robsim.servo.camera_target import PairKey

NAME = "robsim_drive"
LONGEST_BRAKING = 10.0  # seconds
ACKED = 1.0  # seconds until subscribers must have received the last command
RECORDED = (JOINTS, NUMBERS, DETECTIONS, ODOMETRY, POSE, FRAMES)
QUIET = 3.0  # seconds without a first command that are reported
SAME = 1e-6  # seconds: stamps of one instant


class DriveNode:
    """The controller of an experiment as a lifecycle node of ROS 2.

    Each joint state is answered by a command while the node is active. In steps, a command answers
    each instant that a played cell announces, once all its measurements are there.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a single run.
    stepped : bool
        Whether commands answer announced instants instead of joint states.
    recorder : BagRecorder
        Bag of the measurements and the commands.

    Attributes
    ----------
    node : object
        Lifecycle node of rclpy, with the services.
    data : object
        Node of the measurements and the commands.
    active : bool
        Whether the node commands the robot.
    """

    def __init__(self, experiment: Experiment, stepped: bool, recorder: BagRecorder) -> None:
        self.stepped, self.active = stepped, False
        self._controller = Controller(experiment)
        self._entities: list[Callable[[], Any]] = []
        self._said: dict[str, str] = {}
        self._heard: float | None = None  # monotonic time of the last joints that were answered
        self._instant: tuple[float, list[float]] | None = None
        self._answered = 0.0
        self._watched = -math.inf  # monotonic time of the last call of `watch` that looked
        self._stamp: dict[str, float] = {}
        self.node = _make_lifecycle_node(
            NAME,
            on_configure=self._configure,
            on_activate=self._activate,
            on_deactivate=self._deactivate,
            on_cleanup=self._disconnect,
            on_shutdown=self._shut_down,
        )
        self.log, self._diagnostics = self.node.get_logger(), DiagnosticPublisher(self.node)
        self.data = create_data_node(f"{NAME}_data")
        own = experiment.ros2 or RosConnection()
        self.connection = declare_connection(self.node, own, experiment.scene)
        self._recorder = recorder
        self._ids = list_mark_ids(self._controller, dict(self.connection.ids))

    def start(self) -> None:
        """Configure and activate the node; raise InputError if a transition fails."""
        for trigger in (self.node.trigger_configure, self.node.trigger_activate):
            if "SUCCESS" not in str(trigger()):
                raise InputError(f"the node {NAME} could not be started")

    def close(self) -> None:
        """Destroy the nodes."""
        self.data.destroy_node()
        self.node.destroy_node()

    def stop(self) -> None:
        """Brake the robot to rest, and command no more."""
        if self.active:
            self._brake_to_rest()
            self.active = False

    # ------------------------------------------------------------------ transitions

    def _configure(self) -> None:
        """Create the loop, the publishers, the subscriptions and the services."""
        self.loop = DriveLoop(
            self._controller, self.connection, make_ros_message, stepped=self.stepped
        )
        node, connection = self.node, self.connection
        self.loop.make_still()  # InputError if commands of this type do not fit the scene
        kind = load_message_type(connection.command_type)
        self._commands = self.data.create_publisher(kind, connection.commands, 10)
        self._keep(self.data.destroy_publisher, self._commands)
        self._publish_experiment()
        self._subscribe()
        self._serve("/robsim/teach", self._on_teach)
        self._serve("/robsim/reset_drive", self._on_reset)
        self._keep(node.destroy_timer, node.create_timer(PERIOD, self._diagnose))

    def _activate(self) -> None:
        self.loop.reset()
        self._heard, self._stamp, self._instant, self.active = None, {}, None, True
        self._activated = time.monotonic()
        self.log.info(f"active: commands are published on {self.connection.commands}")

    def _deactivate(self) -> None:
        self.stop()

    def _shut_down(self) -> None:
        self.stop()

    def _disconnect(self) -> None:
        while self._entities:
            self._entities.pop()()

    # ------------------------------------------------------------------ connection

    def _keep(self, destroy: Callable[[Any], Any], entity: Any) -> None:
        """Store how an entity of the node is destroyed."""
        self._entities.append(lambda: destroy(entity))

    def _listen(
        self, kind: str, topic: str, call: Callable[[Any], None], latched: bool = False
    ) -> None:
        """Subscribe to a topic; messages are used while the node is active."""

        def take(message: Any) -> None:
            if not self.active and not latched:
                return
            if self._guard(topic, call, message) and kind in RECORDED and topic != INSTANT:
                self._record(topic, message)

        found = load_message_type(kind)
        qos = make_latched_qos() if latched else make_listening_qos(self.stepped)
        quiet = import_module("rclpy.event_handler").SubscriptionEventCallbacks
        events = quiet(use_default_callbacks=False)  # each would cost time at every message
        how = {"qos_profile": qos, "event_callbacks": events}
        subscription = self.data.create_subscription(found, topic, take, **how)
        self._keep(self.data.destroy_subscription, subscription)

    def _subscribe(self) -> None:
        """Subscribe to joints, images, bodies and permissions."""
        connection, controller = self.connection, self._controller
        self._listen(JOINTS, connection.name_topic("joints"), self._on_joints)
        pictured = {*self.loop.pictures.cameras, *controller.pictured_cameras}
        for camera in controller.cameras:
            if camera in pictured:
                topic = connection.name_topic("images", camera=camera)
                self._listen(IMAGE, topic, _bind(self._on_picture, camera))
            else:
                topic = connection.name_topic("marks", camera=camera)
                self._listen(choose_mark_type(connection), topic, _bind(self._on_marks, camera))
        for link in self.loop.links:
            drives = link in self.loop.bases
            odometry = connection.name_topic("odometry", robot=link.partition(".")[0])
            kind, topic = (ODOMETRY, odometry) if drives else (POSE, pose_topic(link))
            self._listen(kind, topic, _bind(self._on_body, link))
        if self.loop.links and find_message_type(FRAMES) is not None:
            self._listen(FRAMES, STATIC_FRAMES, self.loop.take_still_frames, latched=True)
            self._listen(FRAMES, MOVING_FRAMES, self._on_frames)
        self._listen("std_msgs/msg/Bool", connection.name_topic("run"), self._on_run)
        if self.stepped:
            self._listen(NUMBERS, INSTANT, self._on_instant)

    def _serve(self, name: str, call: Callable[[], str]) -> None:
        """Offer a service of std_srvs/Trigger; `call` returns the message of a success."""

        def answer(_: Any, response: Any) -> Any:
            try:
                response.message, response.success = call(), True
                self.log.info(response.message)
            except RobSimError as error:
                response.message, response.success = str(error), False
                self.log.error(f"{name}: {error}")
            return response

        kind = load_message_type("std_srvs/srv/Trigger")
        self._keep(self.node.destroy_service, self.node.create_service(kind, name, answer))

    def _publish_experiment(self) -> None:
        """Publish the experiment as TOML, for a recorded bag."""
        kind = load_message_type(TEXT)
        publisher = self.node.create_publisher(kind, "/robsim/experiment", make_latched_qos(1))
        self._keep(self.node.destroy_publisher, publisher)
        try:
            publisher.publish(make_ros_message(TEXT, data=self._controller.experiment.to_toml()))
        except RobSimError as error:
            self.log.warning(f"the experiment is not published: {error}")

    # ------------------------------------------------------------------ messages

    def _guard(self, topic: str, call: Callable[[Any], None], message: Any) -> bool:
        """Take a message, and return whether it was usable.

        The first of several unusable messages of a topic is reported.
        """
        try:
            call(message)
            self._report(topic, "")
            return True
        except RobSimError as error:
            self._report(topic, f"{topic}: {error}")
        except (ValueError, IndexError, AttributeError, TypeError) as error:
            self._report(topic, f"{topic}: the message has another form: {error}")
        return False

    def _on_joints(self, message: Any) -> None:
        loop = self.loop
        if len(message.name) and loop.joint_names.isdisjoint(message.name):
            raise InputError("none of the joints is in the scene")
        if loop.take_joints(message):
            self._take_coordinates("", message)

    def _on_body(self, message: Any, link: str) -> None:
        if self.loop.take_body(message, link):
            self._take_coordinates(link, message)

    def _on_frames(self, message: Any) -> None:
        if self.loop.take_frames(message):
            for link in self.loop.links:
                self._take_coordinates(link, message)

    def _take_coordinates(self, link: str, message: Any) -> None:
        """Answer new coordinates of joints, "", or of a body if no joint states come."""
        stamp = self.loop.ros.time(message)
        if not self.stepped and (not link or not self.loop.needs_joints):
            self._answer(self._now() if stamp is None else stamp)
        self._take_stamp(link, stamp)

    def _on_marks(self, message: Any, camera: str) -> None:
        self.loop.take_marks(message, camera)
        self._answer_instant()

    def _on_picture(self, message: Any, camera: str) -> None:
        found = self.loop.take_picture(message, camera)
        if found:
            self._record_marks(camera, found)
        self._answer_instant()

    def _record_marks(self, camera: str, found: Mapping[PairKey, Array]) -> None:
        """Record the marks that were found in a picture."""
        ids = [name for key in found for name in self._ids[key]]
        pixels = np.concatenate(list(found.values()))
        seen = np.flatnonzero(np.isfinite(pixels).all(axis=1))
        taken = round(self.loop.stamps[camera] * NANO)
        marks = make_mark_array(make_ros_message, taken, [ids[i] for i in seen], pixels[seen])
        topic = self.connection.name_topic("marks", camera=camera)
        self._record(topic, marks)

    def _on_run(self, message: Any) -> None:
        self.loop.permit(message.data, time.monotonic())

    def _on_instant(self, message: Any) -> None:
        instant = read_instant(list(message.data))
        if len(instant[1]) != len(self._controller.cameras):
            raise InputError(f"expected the times of {len(self._controller.cameras)} cameras")
        if instant[0] != self._answered:
            self._instant = instant
            self._answer_instant()

    def _take_stamp(self, name: str, stamp: float | None) -> None:
        """Store the stamp of joints or of a body, for an announced instant."""
        if self.stepped and stamp is not None:
            self._stamp[name] = stamp
            self._answer_instant()

    def _answer_instant(self) -> None:
        """Answer the announced instant if all its measurements are there."""
        if not self.stepped or self._instant is None or not self._commands.get_subscription_count():
            return
        t, images = self._instant
        sources = [*self.loop.links, *([""] if self.loop.needs_joints else [])]
        if not all(abs(self._stamp.get(each, -1.0) - t) < SAME for each in sources):
            return
        for camera, taken in zip(self._controller.cameras, images, strict=True):
            if not math.isnan(taken) and abs(self.loop.stamps.get(camera, -1.0) - taken) > SAME:
                return
        self._instant, self._answered = None, t
        self._answer(t)

    # ------------------------------------------------------------------ commands

    def _answer(self, stamp: float) -> None:
        """Publish the command for the latest measurements, if they are new."""
        now = time.monotonic()
        command = self.loop.answer(stamp, now)
        if command is None:
            return
        self._send(self.loop.make_command())
        self._heard = now
        if self.loop.clock.leap:
            self.log.warning(f"the clock of the joints leapt by {self.loop.clock.leap:.3g} s")
        self._report("silence", "", "joints are back")
        self._report("start", "")
        self._report("state", describe_command(command), good=True)
        self._compare_clocks()

    def _send(self, command: Any) -> None:
        """Publish and record a command."""
        if self.connection.command_type == STAMPED:
            command.header.stamp = self.node.get_clock().now().to_msg()
        self._commands.publish(command)
        self._record(self.connection.commands, command)

    def _record(self, topic: str, message: Any) -> None:
        """Record a message; an error ends the recording only."""
        try:
            self._recorder.write(topic, message, self._clock())
        except RobSimError as error:
            self._recorder = BagRecorder(None)
            self._report("bag", f"the recording ends: {error}")

    def _clock(self) -> int:
        """Return the time in ns on the clock of the joints, or of the node before the first."""
        stamp = self.loop.clock.stamp
        return round((stamp if math.isfinite(stamp) else self._now()) * NANO)

    def _compare_clocks(self) -> None:
        """Report a camera whose clock differs from the clock of the joints."""
        found = self.loop.find_other_clock()
        if found is None:
            for camera in self.loop.stamps:
                self._report(f"clock of {camera}", "")
        else:
            camera, lead = found
            self._report(
                f"clock of {camera}",
                f"two clocks: the images of {camera} are stamped {abs(lead):.3g} s "
                f"{'after' if lead > 0 else 'before'} the joints",
            )

    @property
    def period(self) -> float:
        """The control period in seconds."""
        return self._controller.dt

    @property
    def patience(self) -> float:
        """The seconds without joints until the robot brakes, at least two and a half periods."""
        return max(self.connection.patience, 2.5 * self.period)

    def watch(self) -> None:
        """Brake the robot if no joints have been answered for `patience`; call it every period."""
        now = time.monotonic()
        if not self.active or now - self._watched < 0.999 * self.period:
            return
        self._watched = now
        if self.loop.command is None and now - self._activated > QUIET:
            self._report("start", self._describe_missing_data())
        if self.stepped:
            self._answer_instant()
        elif self._heard is not None and now - self._heard > self.patience:
            silence = now - self._heard
            self._report("silence", f"no usable joints for {silence:.2g} s: the robot brakes")
            self.loop.brake()
            self._send(self.loop.make_command())
            if not self.loop.numbers.any():
                self._heard = None

    def _describe_missing_data(self) -> str:
        """Return the data without which there is no command yet."""
        topic, cameras = self.connection.joints, ", ".join(self._controller.cameras)
        sources = [topic] if self.loop.needs_joints else []
        sources += [f"the pose of {link}" for link in self.loop.links]
        if self.loop.q is not None:
            return f"waits for the marks of {cameras}" if cameras else "waits"
        return f"waits for {' and '.join(sources)}"

    def _brake_to_rest(self) -> None:
        """Publish braking commands, one each period, until the robot is at rest."""
        dt, begin = self._controller.dt, time.monotonic()
        if self.loop.command is None or not self.active:
            return
        due = begin
        while self.loop.numbers.any() and time.monotonic() - begin < LONGEST_BRAKING:
            due += dt
            time.sleep(max(due - time.monotonic(), 0.0))
            self.loop.brake()
            self._send(self.loop.make_command())
        if self.loop.numbers.any():
            self.log.error("the robot does not come to rest: zero is commanded")
        self._send(self.loop.make_still())
        self._commands.wait_for_all_acked(import_module("rclpy.duration").Duration(seconds=ACKED))
        self._heard = None

    # ------------------------------------------------------------------ services and reports

    def _on_teach(self) -> str:
        """Make the present image the goal."""
        experiment = teach_goal(self._controller, self.loop.command)
        self._brake_to_rest()
        controller = self._controller = Controller(experiment)
        before = self.loop
        self.loop = DriveLoop(controller, self.connection, make_ros_message, stepped=self.stepped)
        self.loop.continue_from(before)
        return "the goal is the present image"

    def _on_reset(self) -> str:
        """Brake, and forget all measurements and any stop."""
        self._brake_to_rest()
        self.loop.reset()
        self._said.clear()
        return "the controller begins again"

    def _report(self, about: str, text: str, end: str = "", good: bool = False) -> None:
        """Log a text about something if the last text about it was another.

        An empty text ends the matter, which is logged as `end`.
        """
        before = self._said.get(about, "")
        if bool(text) == bool(before) and not (good and text != before):
            return
        self._said[about] = text
        if text and not good:
            self.log.warning(text)
        elif text or end:  # rclpy requires one severity for each line of code
            self.log.info(text or end)

    def _diagnose(self) -> None:
        """Publish the state of the controller."""
        state, command = "active" if self.active else "inactive", self.loop.command
        problems = [text for about, text in self._said.items() if text and about != "state"]
        words = "no command yet" if command is None else describe_command(command)
        values = {} if command is None else list_health_values(command)
        text = "; ".join([f"{state}, {words}", *problems])
        self._diagnostics.publish(find_level(command, problems), text, values)

    def _now(self) -> float:
        """Return the time of the node in seconds."""
        return float(self.node.get_clock().now().nanoseconds) * 1e-9


def _bind(call: Callable[[Any, str], None], name: str) -> Callable[[Any], None]:
    """Return a function of a message, with the name of its camera or frame."""
    return lambda message: call(message, name)


def _make_lifecycle_node(name: str, **transitions: Callable[[], None]) -> Any:
    """Return a lifecycle node of rclpy that calls a function in each transition."""
    lifecycle = import_module("rclpy.lifecycle")
    results = lifecycle.TransitionCallbackReturn

    def wrap(call: Callable[[], None]) -> Any:
        def change(node: Any, _: Any) -> Any:
            try:
                call()
            except RobSimError as error:
                node.get_logger().error(str(error))
                return results.FAILURE
            return results.SUCCESS

        return change

    methods = {event: wrap(call) for event, call in transitions.items()}
    return type("DriveLifecycle", (lifecycle.LifecycleNode,), methods)(name)
