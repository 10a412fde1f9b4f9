"""The names of the joints and marks of a scene in a log."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TypeVar

from robsim.base.errors import InputError, check_known, format_value
from robsim.run.control.standalone_controller import Controller
from robsim.servo.camera_target import PairKey
from robsim.world.scene import Scene

T = TypeVar("T")
Ids = Mapping[str, tuple[PairKey, int]]  # id of a mark in a log -> (camera, target), index


def check_name_map(
    name_map: Mapping[str, T] | None,
    what: str,
    form: str,
    known: Collection[str],
    no: str,
    things: str,
    kind: type = str,
) -> Mapping[str, T]:
    """Return a checked argument {name in the scene: name in the log}, empty for None.

    `what` is the name of the argument. InputError is raised for another type than `form` describes,
    and for a name that is not in `known`. The texts `no` and `things` name the unknown thing and
    the known things in the message.
    """
    if name_map is None:
        return {}
    if not isinstance(name_map, Mapping) or not all(
        isinstance(log_name, kind) for log_name in name_map.values()
    ):
        raise InputError(f"{what}: expected {form}, got {format_value(name_map)}")
    for name in name_map:
        check_known(name, known, f"{what}: {no}", things)
    return name_map


def map_joint_names(names: Mapping[str, str] | None, scene: Scene) -> Mapping[str, str]:
    """Return {joint of the scene: its name in a log} for joints with another name in the log.

    InputError is raised for a joint that the scene does not have, or if two joints have the same
    name in the log.
    """
    known = sorted({*scene.coordinate_names, *scene.velocity_names})
    form = "{joint: joint in the bag}"
    log_names = check_name_map(names, "names", form, known, "no joint {}", "joints")
    if len(set(log_names.values())) < len(log_names):
        raise InputError(
            f"names: two joints have the same name in the bag, in {format_value(dict(log_names))}"
        )
    return log_names


def map_mark_ids(
    controller: Controller, camera: str, marks: Mapping[str, Sequence[str]] | None
) -> tuple[Ids, dict[PairKey, int]]:
    """Return the ids of a camera's marks in a log, and the number of marks of each target.

    InputError is raised for a wrong number of ids, an id that occurs twice, or an unknown target.
    """
    targets = dict.fromkeys(sight.target.name for sight in controller.sights)
    no, kind = "no target {}", object
    ids_by_target = check_name_map(marks, "marks", "{target: ids}", targets, no, "targets", kind)
    camera_sights = [sight for sight in controller.sights if sight.eye.name == camera]
    ids: dict[str, tuple[PairKey, int]] = {}
    for sight in camera_sights:
        for i, each in enumerate(
            _target_mark_ids(ids_by_target, sight.target.name, len(sight.target.marks))
        ):
            if each in ids:
                raise InputError(
                    f"marks: two marks have the id '{each}', of '{ids[each][0][1]}' and "
                    f"'{sight.target.name}'"
                )
            ids[each] = sight.key, i
    return ids, {sight.key: len(sight.target.marks) for sight in camera_sights}


def list_mark_ids(
    controller: Controller, marks: Mapping[str, Sequence[str]] | None
) -> dict[PairKey, list[str]]:
    """Return the ids in a log of the marks of each camera and target, in their order."""
    found: dict[PairKey, list[str]] = {}
    for camera in controller.cameras:
        ids, _ = map_mark_ids(controller, camera, marks)
        for name, (key, _) in ids.items():
            found.setdefault(key, []).append(name)
    return found


def _target_mark_ids(marks: Mapping[str, Sequence[str]], target: str, count: int) -> list[str]:
    """Return the ids of the marks of a target; the default is TARGET.NUMBER."""
    ids = marks.get(target, [f"{target}.{i}" for i in range(count)])
    texts = not isinstance(ids, str) and all(isinstance(each, str) for each in ids)
    if not texts or len(ids) != count:
        raise InputError(
            f"marks: '{target}' has {count} marks; expected as many ids, got {format_value(ids)}"
        )
    return list(ids)
