"""The session of a teach pendant: requests of its pages, and messages to them."""

from __future__ import annotations

import math
import threading
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import FileWarning, InputError, RobSimError, format_value
from robsim.geometry.pose import Pose
from robsim.page.html_document import build_live_html, encode_recording_text
from robsim.page.recording_builder import Recording, RecordingBuilder, RecordingInstants
from robsim.page.recordings import build_recording
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.plot.scene_motion import SceneMotion
from robsim.robot.robot import Robot
from robsim.studio.downloads import make_slug
from robsim.studio.message_text import encode_message, encode_recording_parts
from robsim.studio.pendant.pose_table_file import format_pose_table
from robsim.studio.pendant.recorded_poses import (
    build_replay,
    compute_leg_durations,
    format_replay_code,
)
from robsim.studio.pendant.teach_pendant import TeachPendant
from robsim.studio.pendant.tool_search import LEADS
from robsim.studio.request_queue import RequestQueue
from robsim.studio.web.app import UnavailableDownload

LAST_REQUEST = 0.5  # seconds until a request that has begun is abandoned at the end
LAST_CHANGES = 60.0  # seconds that a file waits for requested changes
LONGEST_REPLAY = 1800.0  # seconds
MOST_INSTANTS = 4000  # of a replay; of a longer one fewer instants are shown
MARK = '<body data-page="pendant">'  # the element that selects the script of the page


class PendantSession:
    """A teach pendant, the thread that moves its robot, and its communication with pages.

    A session is the `App` of a server; `broadcast` must be set to the method of this server. The
    messages to pages, by type:

    * pendant: title, the joints with their units and limits, the links, and remarks.
    * recording: {"recording", "part", "parts"}, the robot at its present coordinates, sent once, in
      parts of less than 64 KiB.
    * pose: joints, limits, frames (the poses of all frames), tool, requested, reach, condition,
      link, lead, undo, redo, note, pace.
    * poses: {"poses"}, the recorded poses.
    * replay: {"recording", "part", "parts"}, the simulated motion through the recorded poses.
    """

    def __init__(self, robot: Robot) -> None:
        self.pendant = TeachPendant(robot)
        self.broadcast: Callable[[str], None] = lambda message: None
        self.note, self.remark = "", _collect_remarks(self.pendant)
        self._builder = RecordingBuilder(self._motion())
        self._latest: dict[str, str] = {}  # messages of a new page, by type
        self._requests = RequestQueue(_build_stroke_key)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="robsim-pendant", daemon=True)

    def start(self) -> None:
        """Begin to handle requests."""
        instants = RecordingInstants(np.zeros(1), self._motion())
        title = f"teach pendant: {self.pendant.robot.name}"
        still = self._builder.build_recording(title, instants)
        header = still.header | {"reach": _find_workspace_box(self.pendant, still.header["reach"])}
        text = encode_recording_text(header, still.arrays, set())
        self._send("pendant", **self._describe_robot(title))
        for i, part in enumerate(encode_recording_parts("recording", text)):
            self._store(f"recording {i}", part)
        self._send_news()
        self._thread.start()

    def close(self) -> None:
        """End within half a second."""
        self._over.set()
        self._thread.join(LAST_REQUEST)

    # methods that the server calls in its threads

    def page(self) -> str:
        """Return the HTML text of the page."""
        return build_live_html().replace("<body>", MARK, 1)

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of a file of the recorded poses; None for other names.

        The file has all poses that pages have requested to record before. Raise
        UnavailableDownload if no pose is recorded, or if the poses cannot be replayed.
        """
        if self._thread.is_alive():
            self._requests.wait(LAST_CHANGES)
        pendant = self.pendant
        robot, poses, pace = pendant.robot, pendant.poses, pendant.pace
        try:
            if name == "experiment.toml":
                return "application/toml", build_replay(robot, poses, pace).text.encode()
            if name == "experiment.py":
                return "text/x-python", format_replay_code(robot, poses, pace).encode()
            if name == "poses.csv":
                return "text/csv", format_pose_table(robot, poses).encode()
        except InputError as error:
            raise UnavailableDownload(str(error)) from None
        return None

    def file_name(self, name: str) -> str:
        """Return the name under which a browser stores a file: it begins with the robot."""
        return f"{make_slug(self.pendant.robot.name)}-{name}"

    def hello(self) -> list[str | bytes]:
        """Return the messages that bring a page up to date."""
        return list(self._latest.values())

    def receive(self, message: dict[str, Any]) -> str | None:
        """Store a request of a page for the thread of the session."""
        self._requests.put(message)
        return None

    # methods of the thread of the session

    def _serve(self) -> None:
        """Handle requests until the session is closed."""
        while not self._over.is_set():
            requests = self._requests.take(0.1)
            if requests:
                notes = [self.do(request) for request in requests]
                self.note = "\n".join(dict.fromkeys(filter(None, notes)))
                self._send_news()
            self._requests.finish()

    def do(self, request: dict[str, Any]) -> str:
        """Handle a request of a page; return the error message, or ""."""
        try:
            for name, value in request.items():
                action = _PENDANT_REQUESTS.get(name)
                if action is None:
                    exist = ", ".join(_PENDANT_REQUESTS)
                    raise InputError(f"unknown request {format_value(name)}; requests: {exist}")
                action(self, value)
        except RobSimError as error:
            return str(error)
        except Exception as error:  # noqa: BLE001  an internal error must not end the session
            return f"internal error, please report it: {type(error).__name__}: {error}"
        return ""

    def _drag(self, value: Any) -> None:
        """Move the tool to a pose in the frame of the figures, [pose7, stroke]."""
        numbers, stroke = _parse_list(value, 2, "drag")
        pose = [_parse_number(x, "drag") for x in _parse_list(numbers, 7, "drag")]
        length = math.hypot(*pose[3:])
        if not length > 1e-6:
            raise InputError("drag: the quaternion is zero")
        shown = Pose.from_quaternion(pose[:3], [x / length for x in pose[3:]])
        self.pendant.move_tool(self.pendant.base.inv() @ shown, stroke)

    def _set_pace(self, value: Any) -> None:
        """Set the pace of the replay, [share of the full speed, seconds of a leg or null]."""
        self.pendant.set_pace(*_parse_list(value, 2, "pace"))

    def _replay(self, value: Any) -> None:
        """Simulate the motion through the recorded poses, and send it to all pages."""
        pendant = self.pendant
        robot, poses, pace = pendant.robot, pendant.poses, pendant.pace
        experiment = build_replay(robot, poses, pace)
        total = float(compute_leg_durations(robot, poses, pace).sum())
        if total > LONGEST_REPLAY:
            raise InputError(
                f"the replay takes {total / 60:.0f} minutes, and at most {LONGEST_REPLAY / 60:.0f} "
                "are shown: raise the speed, or save the experiment and run it"
            )
        recording = build_recording(experiment.run())
        arrays = _thin_instants(recording)
        text = encode_recording_text(recording.header, arrays, {"poses"})
        for part in encode_recording_parts("replay", text):
            self.broadcast(part)

    def _motion(self) -> SceneMotion:
        """Return the motion that consists of the present coordinates."""
        return SceneMotion.of(self.pendant.scene, self.pendant.q[None])

    def _send_news(self) -> None:
        """Send the present state to all pages."""
        pendant, names = self.pendant, [field.name for field in self.pendant.fields]
        poses = [
            {"name": pose.name, "values": _list_shown_numbers(pendant, pose.q)}
            for pose in pendant.poses
        ]
        self._send("poses", names=names, poses=poses)
        self._send("pose", again=True, **self._describe_pose())  # also if a value was refused

    def _describe_robot(self, title: str) -> dict[str, Any]:
        """Return the content of the message about the robot."""
        pendant = self.pendant
        joints = [
            {**{"name": f.name, "unit": f.unit, "low": f.low, "high": f.high}, "ends": f.ends}
            for f in pendant.fields
        ]
        coupled = [
            {"name": link.joint.name or link.name, "relation": link.joint.follows.relation}
            for link in pendant.robot.links
            if link.joint.follows is not None and not link.joint.parts.coordinates
        ]
        links = [link.name for link in pendant.robot.links]
        about = {"title": title, "joints": joints, "coupled": coupled, "links": links}
        return {**about, "leads": LEADS, "remark": self.remark}

    def _describe_pose(self) -> dict[str, Any]:
        """Return the content of the message about the present coordinates."""
        pendant, tool = self.pendant, self.pendant.tool
        requested = pendant.state.requested
        return {
            "joints": _list_shown_numbers(pendant, pendant.q),
            "limits": pendant.limit_sides,
            "frames": _round_list(self._builder.frames.compute_poses(self._motion()).ravel()),
            "handle": _list_pose(pendant.base @ tool),
            "requested": None if requested is None else _list_pose(pendant.base @ requested),
            "tool": {
                "position": _round_list(100.0 * tool.position),
                "rpy": _round_list(np.degrees(tool.rpy)),
                "quaternion": _round_list(tool.quaternion),
            },
            **{"reach": pendant.reach_text, "condition": pendant.condition},
            **{"link": pendant.link, "lead": pendant.lead, "note": self.note},
            **{"undo": pendant.can_undo, "redo": pendant.can_redo, "pace": pendant.pace},
        }

    def _send(self, kind: str, again: bool = False, **content: Any) -> None:
        """Send a message to all pages and store it for new pages.

        A message that equals the last one of its type is sent only if `again`.
        """
        message = encode_message(kind, **content)
        if again or self._latest.get(kind) != message:
            self._store(kind, message)

    def _store(self, name: str, message: str) -> None:
        """Send a message to all pages and store it for new pages."""
        self._latest = {**self._latest, name: message}
        self.broadcast(message)


def _collect_remarks(pendant: TeachPendant) -> str:
    """Return the warning about meshes that are not drawn, which is also issued."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FileWarning)
        warn_missing_meshes(pendant.scene)
    for each in caught:
        warnings.warn(each.message, stacklevel=2)
    return "\n".join(str(each.message) for each in caught)


def _find_workspace_box(pendant: TeachPendant, box: list[list[float]]) -> list[list[float]]:
    """Return a box around the robot at home and most places of its tip, for the view."""
    robot = pendant.robot
    low, high = np.clip(robot.limits.T, -math.pi, math.pi)
    turns = [unit == "rad" for unit in robot.coordinate_units]
    share = np.random.default_rng(0).uniform(size=(200, robot.nq))
    q = np.where(turns, low + share * (high - low), robot.home)
    places = (pendant.base.matrix @ robot.fk(q))[:, :3, 3]
    ends = np.quantile(places, [0.1, 0.9], axis=0)
    ends[0, 2] = box[0][2]  # the ground stays below the base
    return [np.minimum(ends[0], box[0]).tolist(), np.maximum(ends[1], box[1]).tolist()]


def _thin_instants(recording: Recording) -> dict[str, NDArray[Any]]:
    """Return the arrays of a recording with at most about `MOST_INSTANTS` instants."""
    count = len(recording.arrays["time"])
    timed = {"time", "poses", *(curve["values"] for curve in recording.header["curves"])}
    kept = np.append(np.arange(0, count - 1, math.ceil(count / MOST_INSTANTS)), count - 1)
    return {
        name: array[kept] if name in timed else array for name, array in recording.arrays.items()
    }


def _list_shown_numbers(pendant: TeachPendant, q: Array) -> list[float]:
    """Return coordinates (nq,) in their displayed units."""
    return _round_list([x / field.size for x, field in zip(q, pendant.fields, strict=True)])


def _list_pose(pose: Pose) -> list[float]:
    """Return a pose as x, y, z in metres and a unit quaternion x, y, z, w."""
    return _round_list([*pose.position, *pose.quaternion])


def _round_list(numbers: Any) -> list[float]:
    """Return numbers with nine decimals, which the page rounds further."""
    return [round(float(x), 9) + 0.0 for x in numbers]


def _parse_list(value: Any, count: int, request: str) -> list[Any]:
    """Return a list of `count` values of a request; raise InputError for others."""
    if not isinstance(value, list) or len(value) != count:
        raise InputError(f"{request}: expected a list of {count}, got {format_value(value)}")
    return value


def _parse_number(value: Any, request: str) -> float:
    """Return a number of a request; raise InputError for other values."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{request}: expected numbers, got {format_value(value)}")
    return float(value)


def _build_stroke_key(request: dict[str, Any]) -> Any:
    """Return the key of a request; a later request with the same key replaces it."""
    name = next(iter(request), "")
    value = request.get(name)
    if name in ("drag", "joint") and len(request) == 1 and isinstance(value, list) and value:
        stroke = value[-1] if isinstance(value[-1], int | str) else None
        return name, str(value[0]) if name == "joint" else "", stroke
    return id(request)


_PENDANT_REQUESTS: dict[str, Callable[[PendantSession, Any], None]] = {
    "joint": lambda session, value: session.pendant.set_joint(*_parse_list(value, 3, "joint")),
    "drag": PendantSession._drag,
    "tool": lambda session, value: session.pendant.type_tool(*_parse_list(value, 2, "tool")),
    "link": lambda session, name: session.pendant.choose_link(name),
    "lead": lambda session, name: session.pendant.choose_lead(name),
    "home": lambda session, _: session.pendant.go_home(),
    "undo": lambda session, _: session.pendant.undo(),
    "redo": lambda session, _: session.pendant.redo(),
    "record": lambda session, _: session.pendant.record(),
    "remove": lambda session, index: session.pendant.remove(index),
    "rename": lambda session, value: session.pendant.rename(*_parse_list(value, 2, "rename")),
    "reorder": lambda session, value: session.pendant.reorder(*_parse_list(value, 2, "reorder")),
    "load": lambda session, text: session.pendant.load_poses(text),
    "go": lambda session, index: session.pendant.go_to(index),
    "pace": PendantSession._set_pace,
    "replay": PendantSession._replay,
}
