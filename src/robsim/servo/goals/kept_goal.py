"""Goals that remain the image that was shown while objects and cameras move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.servo.goals.body_place import BodyPlace, Places, list_bodies
from robsim.servo.goals.goal import TaughtGoal
from robsim.servo.nested_tasks import list_servo_parts, replace_servo_tasks
from robsim.world.scene import Scene

AnyTask = TypeVar("AnyTask")


def list_shown_goals(task: Any) -> list[TaughtGoal]:
    """Return the shown goals of a task and of the tasks within it.

    >>> from robsim import IBVS, Priorities
    >>> [goal.q for goal in list_shown_goals(Priorities([IBVS([0.1]), IBVS()]))]
    [array([0.1]), None]
    """
    goals = (getattr(each, "goal", None) for each in list_servo_parts(task))
    return [each for each in goals if isinstance(each, TaughtGoal)]


def keep_shown_goals(task: AnyTask, before: Scene, after: Scene) -> AnyTask:
    """Return a task whose shown goals remain the images of the scene `before`.

    Each shown goal, at any depth, keeps the place of every object and camera that has another pose
    in the scene `after`, if the body is or carries a camera or the target of the goal. A place that
    the goal already has remains: it is older. A body on another carrier than before has no place.

    Parameters
    ----------
    task : Task
        Task with goals that were shown in `before`.
    before, after : Scene
        The scene before and after bodies have moved.

    Returns
    -------
    Task
        The changed task; the task itself if it has no shown goal that depends on a moved body.

    Raises
    ------
    InputError
        If a camera or a target of the task does not exist.

    Examples
    --------
    >>> import robsim as rs
    >>> one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    >>> moved = one.at("objects.plate.position", "35, 5, 10 cm")
    >>> task = keep_shown_goals(moved.task, one.scene, moved.scene)
    >>> [(each.name, each.pose.position) for each in task.goal.places]
    [('plate', array([0.31, 0.  , 0.1 ]))]
    >>> f"{1000 * float(moved.with_(task=task).run().distance_to_goal):.1f} mm"
    '0.0 mm'
    """
    moved = _find_moved_bodies(before, after)
    return _replace_shown_goals(task, lambda servo: _keep_places(servo, before, moved))


def show_goals_anew(task: AnyTask) -> AnyTask:
    """Return a task whose shown goals are shown in the scene as it is, each at its own q.

    >>> from robsim import IBVS, Pose
    >>> kept = IBVS(TaughtGoal([0.1], places={"plate": Pose.at(1)}))
    >>> show_goals_anew(kept) == IBVS([0.1])
    True
    """
    return _replace_shown_goals(task, lambda servo: TaughtGoal(servo.goal.q))


def show_goals_at(task: AnyTask, q: ArrayLike) -> AnyTask:
    """Return a task whose shown goals are shown at q (nq,) in the scene as it is.

    >>> from robsim import IBVS
    >>> show_goals_at(IBVS(), [0.2]).goal.q
    array([0.2])
    """
    return _replace_shown_goals(task, lambda _: TaughtGoal(q))


def _replace_shown_goals(task: AnyTask, make_goal: Callable[[Any], TaughtGoal]) -> AnyTask:
    """Return a task with other shown goals; `make_goal` gets the servo task of each."""

    def change(servo: Any) -> Any:
        if not isinstance(getattr(servo, "goal", None), TaughtGoal):
            return servo
        goal = make_goal(servo)
        return servo if goal == servo.goal else replace(servo, goal=goal)

    return cast(AnyTask, replace_servo_tasks(task, change))


def _find_moved_bodies(before: Scene, after: Scene) -> dict[str, BodyPlace]:
    """Return the places in `before` of bodies with another pose on the same carrier in `after`."""
    later = list_bodies(after)
    return {
        name: BodyPlace(name, body.pose)
        for name, body in list_bodies(before).items()
        if name in later
        and later[name].on == body.on
        and not np.array_equal(later[name].pose.matrix, body.pose.matrix)
    }


def _keep_places(servo: Any, scene: Scene, moved: dict[str, BodyPlace]) -> TaughtGoal:
    """Return the goal of a servo task with the places of the moved bodies on which it depends."""
    goal: TaughtGoal = servo.goal
    kept = cast(Places, goal.places)
    lacking = moved.keys() - {each.name for each in kept}
    if not lacking:
        return goal
    own = _find_involved_bodies(servo, scene)
    added = tuple(place for name, place in moved.items() if name in lacking & own)
    return replace(goal, places=(*kept, *added))


def _find_involved_bodies(servo: Any, scene: Scene) -> set[str]:
    """Return the cameras and targets of a servo task, and the bodies that carry them."""
    bodies = list_bodies(scene)
    names = {name for pairs in servo.sights(scene) for pair in pairs for name in pair.key}
    found = set[str]()
    while names:
        found |= names
        names = {bodies[name].on for name in names} & bodies.keys()
    return found
