"""Units and long names of the variables of a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run import end_variables
from robsim.servo.laws.command_quantity import UNITS as UNITS_OF_COMMANDS
from robsim.servo.task_controller import TaskController
from robsim.world.scene import Scene

UNITS = {
    "camera_pose": "m",
    "camera_velocity": "m/s, rad/s",
    "frame_pose": "m",
    "frame_velocity": "m/s, rad/s",
    "pixels": "px",
    "pixels_goal": "px",
    "picture_hash": "1",
    "normal_factor": "grey values per m or rad",
    "active": "1",
    "slack": "see constraint",
    "saturation": "1",
    "pixels_end": "px",
    "end_time": "s",
    "path_length": "m",
    "weight": "1",
    "pixel_error": "px",
    "outcome": "1",
    **end_variables.UNITS,
}
TORQUE_UNITS = {"rad": "N m", "m": "N"}
DESCRIPTIONS = {
    "q": "coordinates of the robots",
    "qd": "commanded velocities, held for one period",
    "qd_actual": "velocities of the joints, which follow the command with a lag or under limits",
    "camera_pose": "pose of the camera in the world",
    "camera_velocity": "twist (v, omega) of the camera in its own axes",
    "frame_pose": "pose of the moved frame in the world",
    "frame_velocity": "twist (v, omega) of the moved frame in its own axes",
    "s": "measured features",
    "s_goal": "features at the goal",
    "weight": "weight of each number of s, 0 if its mark is missing",
    "error": "s - s_goal",
    "error_norm": "Euclidean norm of the error",
    "lyapunov": "half the square of error_norm (chapter, eq. 16)",
    "pixels": "image coordinates of the marks, without noise",
    "pixels_goal": "image coordinates of the marks at the goal",
    "picture_hash": "52 bits of the BLAKE2b hash of the newest picture of a camera",
    "active": "multiplier of each constraint, positive where it holds the command back",
    "slack": "excess of the command over a constraint that gave way",
    "torque": "torques of the drives in the step before the instant; at first, to hold the robot",
    "saturation": "share of the last period in which the torque of a drive was limited",
    "torque_limit": "largest torque of each drive; infinite without a limit, NaN without a drive",
    "normal_factor": "upper triangle, row by row, of R with R'R = L'L of the picture, damped",
    "pixels_end": "image coordinates of the marks at the end",
    "outcome": "reason for the end of the run, see robsim.Outcome",
    "end_time": "time at the end of the run",
    "path_length": "path length of the camera, or of the target if the camera does not move",
    "pixel_error": "largest distance of a mark from its goal in the image, at the end",
    "q0": "coordinates at the start",
    "q_end": "coordinates at the end",
    **end_variables.DESCRIPTIONS,
}
MOTIONS = ("camera_pose", "camera_velocity", "frame_pose", "frame_velocity")


class VariableDescriptions:
    """Attributes of the variables of a simulation, made for one variable at a time."""

    def __init__(self, loop: Loop, scene: Scene) -> None:
        self.controller, self.endings, self.scene = loop.controller, loop.endings, scene

    @cached_property
    def units(self) -> dict[str, str]:
        """The units that depend on the joints, the features and the law."""
        return _list_units(self.controller, self.scene)

    def describe(self, name: str) -> dict[str, Any]:
        """Return the attributes of a variable: its unit, its long name, and others."""
        if name == "ending":
            kinds = (type(each).__name__ for each in self.endings)
            return _make_flag_attributes(["none", *kinds], -1)
        return {
            "units": UNITS.get(name) or self.units[name],
            "long_name": self._get_long_name(name),
            **self._list_further_attributes(name),
        }

    def _get_long_name(self, name: str) -> str:
        """Return the long name of a variable."""
        if name == "qd" and self.controller.command_quantity == "torque":
            return "commanded torques, held for one period"
        if name == "path_length" and not self.controller.sights:
            return "path length of the moved frame"
        return DESCRIPTIONS[name]

    def _list_further_attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of a variable besides unit and long name."""
        if name in MOTIONS:
            return {"frame": self.controller.frame}
        if name == "goal_pose":
            return end_variables.make_goal_attributes(self.controller)
        if name == "outcome":
            return _make_flag_attributes(list(Outcome.__members__), 0)
        return {}


def _list_units(controller: TaskController, scene: Scene) -> dict[str, str]:
    """Return the unit of each variable whose unit is not in `UNITS`."""
    features = controller.units
    unit = features[0] if len(set(features)) == 1 else "see feature_unit"
    joints = sorted(set(scene.coordinate_units))
    unit_q = joints[0] if len(joints) == 1 else "see coordinate_unit"
    return {
        **dict.fromkeys(("q", "q0", "q_end"), unit_q),
        **dict.fromkeys(("qd", "qd_actual"), f"{unit_q}/s" if len(joints) == 1 else "m/s, rad/s"),
        **_make_torque_units(controller, scene),
        **dict.fromkeys(("torque", "torque_limit"), TORQUE_UNITS.get(unit_q, "N m, N")),
        **dict.fromkeys(("s", "s_goal", "error", "error_norm"), unit),
        "lyapunov": f"{unit}^2" if unit not in ("1", "see feature_unit") else unit,
    }


def _make_torque_units(controller: TaskController, scene: Scene) -> dict[str, str]:
    """Return the unit of the commands of a law of torques; none for a law of velocities."""
    if controller.command_quantity == "velocity":
        return {}
    slides = {scene.velocity_units[i] == "m/s" for i in controller.columns}
    return {"qd": "N, N m" if len(slides) > 1 else UNITS_OF_COMMANDS["torque"][slides.pop()]}


def _make_flag_attributes(names: Sequence[str], first: int) -> dict[str, Any]:
    """Return the CF attributes that name the values of a variable, from `first` on."""
    values = np.arange(first, first + len(names), dtype=np.int8)
    return {"flag_values": values, "flag_meanings": " ".join(names)}
