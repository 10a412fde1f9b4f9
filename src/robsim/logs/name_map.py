"""What a log calls the joints and marks of a scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from robsim.base.errors import InputError, check_known, format_value
from robsim.run.control.standalone_controller import Controller
from robsim.servo.camera_target import PairKey
from robsim.world.scene import Scene

Ids = Mapping[
    str, tuple[PairKey, int]
]  # of the marks of a camera: camera and target, and the number


def check_name_map(
    given: Any, what: str, form: str, known: Collection[str], no: str, things: str, kind: type = str
) -> Mapping[str, Any]:
    """Return what an argument calls things, {our name: that in the log}; empty for None.

    InputError: another `form`, or a name that is none of those known, as `check_known` says it.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(isinstance(own, kind) for own in given.values()):
        raise InputError(f"{what}: expected {form}, got {format_value(given)}")
    for name in given:
        check_known(name, known, f"{what}: {no}", things)
    return given


def map_joint_names(names: Any, scene: Scene) -> Mapping[str, str]:
    """Return what joints of a scene are called in a log, where that is something else.

    InputError: a joint that the scene does not have, or two that are one in the log.
    """
    known = sorted({*scene.coordinate_names, *scene.velocity_names})
    form = "{joint: joint in the bag}"
    called = check_name_map(names, "names", form, known, "no joint {}", "joints")
    if len(set(called.values())) < len(called):
        raise InputError(f"names: two joints are one in the bag, in {format_value(dict(called))}")
    return called


def map_mark_ids(controller: Controller, camera: str, marks: Any) -> tuple[Ids, dict[PairKey, int]]:
    """Return what a log calls the marks of a camera, and how many each target has.

    InputError: other ids than there are marks, an id that is two, or ids of what is no target.
    """
    targets = dict.fromkeys(sight.target.name for sight in controller.sights)
    no, kind = "no target {}", object
    given = check_name_map(marks, "marks", "{target: ids}", targets, no, "targets", kind)
    own = [sight for sight in controller.sights if sight.eye.name == camera]
    found: dict[str, tuple[PairKey, int]] = {}
    for sight in own:
        for i, each in enumerate(
            _target_mark_ids(given, sight.target.name, len(sight.target.marks))
        ):
            if each in found:
                raise InputError(
                    f"marks: '{each}' is two marks, of '{found[each][0][1]}' and "
                    f"'{sight.target.name}'"
                )
            found[each] = sight.key, i
    return found, {sight.key: len(sight.target.marks) for sight in own}


def _target_mark_ids(marks: Mapping[str, Any], target: str, count: int) -> list[str]:
    """Return the ids of the marks of a target."""
    ids = marks.get(target, [f"{target}.{i}" for i in range(count)])
    texts = not isinstance(ids, str) and all(isinstance(each, str) for each in ids)
    if not texts or len(ids) != count:
        raise InputError(
            f"marks: '{target}' has {count} marks; expected as many ids, got {format_value(ids)}"
        )
    return list(ids)
